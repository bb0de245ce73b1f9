"""Run the studies and the commands, keep what came of them, and write the pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hierarchy.errors import UnknownNameError
from scenarios.config.scenario import OWN
from scenarios.reproduce import commands, pages, rows
from scenarios.reproduce.blocks import BLOCKS
from scenarios.reproduce.rows import Rows
from scenarios.reproduce.studies import SEED, STUDIES, AnyStudy, Watched
from scenarios.reproduce.watched import rows_of_watched
from scenarios.sweep.whole import Progress, Workers, compare_starts

QUICK = 10  # with `quick`, one in so many starts, but never fewer than two


@dataclass(frozen=True)
class Chosen:
    """What is to be made: studies, and pages for the commands in them."""

    studies: tuple[AnyStudy, ...]
    pages: tuple[str, ...]


def chosen(names: Sequence[str]) -> Chosen:
    """Return studies and pages by name, all without names; raises UnknownNameError."""
    known = {study.name: study for study in STUDIES}
    for name in names:
        if name not in known and name not in commands.PAGES:
            raise UnknownNameError("study or page", name, (*known, *commands.PAGES))
    if not names:
        return Chosen(STUDIES, commands.PAGES)
    return Chosen(tuple(known[name] for name in names if name in known),
                  tuple(name for name in names if name not in known))


def reproduce(studies: Sequence[AnyStudy], out: Path, quick: bool = False,
              workers: int | None = None, progress: Progress | None = None,
              told: Callable[[AnyStudy], object] = lambda study: None) -> dict[str, Rows]:
    """Run studies and return their rows by name; runs that `out` has are not repeated.

    quick : a tenth of the starts. told : called with each study before it starts.
    Raises what `compare_starts` raises.
    """
    found = {}
    for study in studies:
        told(study)
        starts = max(2, study.starts // QUICK) if quick else study.starts
        found[study.name] = _run(replace(study, starts=starts), out / study.name, workers, progress)
    return found


def _run(study: AnyStudy, out: Path, workers: int | None, progress: Progress | None) -> Rows:
    command = f"hierarchy reproduce {study.name}"
    if isinstance(study, Watched):
        return rows_of_watched(study, command, SEED, out, Workers(workers), progress)
    said = progress and (lambda name, done, total: progress(study.name, done, total))
    done = compare_starts([column.load() for column in study.columns], [OWN], study.starts, SEED,
                          out, workers=workers, progress=said, command=command)
    (results,) = done.found.values()
    return rows.rows_of(study.name, results, command, SEED)


def outputs(asked: Sequence[str], root: Path, out: Path,
            told: Callable[[str], object] = lambda line: None) -> dict[str, str]:
    """Run the commands of pages, one after the other, and return what they print.

    Those whose output `out` has are not repeated, and those that fail are left out. told : called
    with each before it starts, and with the reason of a failure.
    """
    texts = [(root / page).read_text(encoding="utf-8") for page in asked]
    found = {}
    for command in dict.fromkeys(one for text in texts for one in commands.commands(text)):
        told(f"{command} ...")
        try:
            found[command] = commands.run(command, root, out)
        except commands.CommandError as error:
            told(f"left as it is: {error}")
    return found


def write_documents(found: Mapping[str, Rows], printed: Mapping[str, str], root: Path
                    ) -> list[Path]:
    """Keep rows and outputs beside the documents of a checkout and fill its pages.

    Returns what was written. Raises HierarchyError for a page that needs a study or an output that
    is not there; the others are kept.
    """
    folder = root / pages.RESULTS
    kept = [rows.write(one, folder) for one in found.values()] + commands.keep(printed, root)
    return kept + pages.write(root, BLOCKS, rows.read(folder))
