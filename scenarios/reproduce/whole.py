"""Run the studies, keep their rows, and write the pages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from hierarchy.errors import UnknownNameError
from scenarios.config.scenario import OWN
from scenarios.reproduce import pages, rows
from scenarios.reproduce.blocks import BLOCKS
from scenarios.reproduce.rows import Rows
from scenarios.reproduce.studies import SEED, STUDIES, AnyStudy, Watched
from scenarios.reproduce.watched import rows_of_watched
from scenarios.sweep.whole import Progress, compare_starts

QUICK = 10  # with `quick`, one in so many starts, but never fewer than two


def chosen(names: Sequence[str]) -> list[AnyStudy]:
    """Return the studies of these names, all without names; raises UnknownNameError."""
    known = {study.name: study for study in STUDIES}
    for name in names:
        if name not in known:
            raise UnknownNameError("study", name, tuple(known))
    return [known[name] for name in names] if names else list(STUDIES)


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
        found[study.name] = _run(replace(study, starts=starts), out, workers, progress)
    return found


def _run(study: AnyStudy, out: Path, workers: int | None, progress: Progress | None) -> Rows:
    command = f"hierarchy reproduce {study.name}"
    if isinstance(study, Watched):
        return rows_of_watched(study, command, SEED, progress)
    done = compare_starts([column.load() for column in study.columns], [OWN], study.starts, SEED,
                          out / study.name, workers=workers, progress=progress, command=command)
    (results,) = done.found.values()
    return rows.rows_of(study.name, results, command, SEED)


def write_documents(found: dict[str, Rows], root: Path) -> list[Path]:
    """Keep rows beside the documents of a checkout and fill its pages; return what was written.

    Raises HierarchyError for a page that needs a study without rows; the rows are kept.
    """
    folder = root / pages.RESULTS
    kept = [rows.write(one, folder) for one in found.values()]
    return kept + pages.write(root, BLOCKS, rows.read(folder))
