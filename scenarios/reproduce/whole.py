"""Run the studies and the commands, keep what came of them, and write the pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from hierarchy.errors import UnknownNameError
from hierarchy.words import counted
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
              told: Callable[[str], object] = lambda line: None) -> Iterator[Rows]:
    """Run studies and yield the rows of each as it ends; runs that `out` has are not repeated.

    quick : a tenth of the starts. told : called with a line about each study before it starts, and
    with its time after it. Raises what `compare_starts` raises.
    """
    with Workers(workers) as some:
        for count, study in enumerate(studies, 1):
            starts = max(2, study.starts // QUICK) if quick else study.starts
            told(f"{study.name} (study {count} of {len(studies)}): {study.title}, "
                 f"{counted(len(study.columns), 'column')} from {starts} starts")
            begun = perf_counter()
            found = _run(replace(study, starts=starts), out / study.name, some, progress)
            told(f"  {minutes(perf_counter() - begun)}")
            yield found


def minutes(seconds: float) -> str:
    """Return a duration as minutes and seconds: "41:07 min"."""
    return f"{round(seconds) // 60}:{round(seconds) % 60:02} min"


def _run(study: AnyStudy, out: Path, workers: Workers, progress: Progress | None) -> Rows:
    command = f"hierarchy reproduce {study.name}"
    if isinstance(study, Watched):
        return rows_of_watched(study, command, SEED, out, workers, progress)
    said = progress and (lambda name, done, total: progress(study.name, done, total))
    done = compare_starts([column.load() for column in study.columns], [OWN], study.starts, SEED,
                          out, workers=workers, progress=said, command=command)
    (results,) = done.found.values()
    return rows.rows_of(study.name, results, command, SEED)


def of_pages(asked: Sequence[str], root: Path) -> dict[str, list[str]]:
    """Return the commands in pages, each with the pages that its output stands in."""
    found: dict[str, list[str]] = {}
    for page in asked:
        for command in commands.commands((root / page).read_text(encoding="utf-8")):
            found.setdefault(command, []).append(page)
    return found


def outputs(asked: Sequence[str], root: Path, out: Path,
            told: Callable[[str], object] = lambda line: None) -> Iterator[tuple[str, str]]:
    """Run the commands of pages, one after the other; yield each with what it prints as it ends.

    Those whose output `out` has are not repeated, and those that fail are left out. told : called
    with each before it starts, and with its time or the reason of a failure after it.
    """
    found = of_pages(asked, root)
    for count, command in enumerate(found, 1):
        told(f"command {count} of {len(found)}: {command} ...")
        begun = perf_counter()
        try:
            printed = commands.run(command, root, out)
        except commands.CommandError as error:
            told(f"left as it is: {error}")
            continue
        told(f"  {minutes(perf_counter() - begun)}")
        yield command, printed


def write_documents(found: Mapping[str, Rows], printed: Mapping[str, str], root: Path
                    ) -> tuple[list[Path], list[str]]:
    """Keep rows and outputs beside the documents of a checkout and fill its pages.

    Returns what was written, and why some pages cannot be filled.
    """
    folder = root / pages.RESULTS
    kept = [rows.write(one, folder) for one in found.values()] + commands.keep(printed, root)
    changed, lacking = pages.write(root, BLOCKS, rows.read(folder))
    return kept + changed, lacking
