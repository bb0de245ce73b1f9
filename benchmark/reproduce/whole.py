"""Run the studies and the commands, store what came of them, and write the pages."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter

from benchmark.reproduce import pages, studies
from benchmark.reproduce.blocks import judged, statements
from benchmark.reproduce.studies import STUDIES, Rows, rows_of
from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.words import counted
from scenarios.cli.options import INTERRUPTED
from scenarios.cli.progress import bar
from scenarios.cli.terminal import print_json, shown
from scenarios.files import make_folder, reason, write_text
from scenarios.results.sampled import Workers

_QUICK = 10  # with --quick, one in so many starts, but never fewer than two


def fill() -> int:
    """Write the pages of the checkout from the rows and outputs that are stored."""
    written, lacking = pages.fill(pages.ROOT, studies.read(pages.ROOT / pages.RESULTS))
    print(*map(shown, written), sep="\n")
    return _lacking(lacking)


@dataclass
class _Made:
    """What has been made so far, and the files it was written to as it ended."""

    out: Path
    root: Path | None  # of the checkout whose pages are written
    rows: dict[str, Rows] = field(default_factory=dict)
    files: dict[Path, None] = field(default_factory=dict)
    lacking: list[str] = field(default_factory=list)

    def add(self, found: Rows | None, command: str = "", printed: str = "") -> None:
        """Store rows or an output, and write the pages."""
        folder = self.root and self.root / pages.RESULTS
        if found is not None:
            self.rows[found.study] = found
            self.files |= {studies.write(found, one): None for one in (self.out, folder) if one}
        elif self.root:
            file = pages.file_of(command, self.root)
            write_text(file, printed)
            self.files[file] = None
        if self.root and folder:
            changed, self.lacking = pages.fill(self.root, studies.read(folder))
            self.files |= dict.fromkeys(changed)


def run(names: list[str], out: Path, quick: bool = False, workers: int | None = None,
        as_json: bool = False, root: Path | None = None) -> int:
    """Run studies and commands; unless `quick`, write the pages; print the statements' verdicts."""
    begun, root = perf_counter(), root or pages.ROOT
    some, asked = chosen(names, root)
    if quick and not some:
        raise HierarchyError(f"--quick runs studies, and {', '.join(asked)} has the output of "
                             "commands; leave --quick out")
    made = _Made(make_folder(out), None if quick else root)
    try:
        for found in ran(some, out, quick, workers):
            made.add(found)
        for command, printed in () if quick else outputs(asked, root, out / "output"):
            made.add(None, command, printed)
    except OSError as error:
        why = (f"{error.filename or 'a file'} cannot be written: {reason(error)}"
               if error.strerror else str(error))
        _say(f"hierarchy: fault: {why}")
        return 1
    except KeyboardInterrupt:
        _say("hierarchy: interrupted; the same command continues from here")
        return INTERRUPTED
    _report(made, of_pages(asked, root) if quick else {}, as_json)
    _say(f"{minutes(perf_counter() - begun)} in all")
    return _lacking(made.lacking)


def chosen(names: list[str], root: Path) -> tuple[list[str], list[str]]:
    """Return studies, and pages with commands, by name; all without names. See UnknownNameError."""
    known = pages.marked(root)
    for name in names:
        if name not in STUDIES and name not in known:
            raise UnknownNameError("study or page", name, (*STUDIES, *known))
    return ([name for name in STUDIES if name in names or not names],
            [name for name in known if name in names or not names])


def ran(names: list[str], out: Path, quick: bool, workers: int | None) -> Iterator[Rows]:
    """Run studies and yield the rows of each as it ends; runs that `out` has are not repeated."""
    with bar("runs") as progress:
        for count, name in enumerate(names, 1):
            study = STUDIES[name]
            if quick:
                study = replace(study, starts=max(2, study.starts // _QUICK))
            _say(f"{name} (study {count} of {len(names)}): {study.title}, "
                 f"{counted(len(study.names), 'column')} from {study.starts} starts")
            begun = perf_counter()
            found = rows_of(study, out / name, Workers(workers), progress)
            _say(f"  {minutes(perf_counter() - begun)}")
            yield found


def outputs(asked: list[str], root: Path, out: Path) -> Iterator[tuple[str, str]]:
    """Run the commands of pages, one after the other; yield each with what it prints as it ends.

    Those whose output `out` has are not repeated, and those that fail are left out.
    """
    found = of_pages(asked, root)
    for count, command in enumerate(found, 1):
        _say(f"command {count} of {len(found)}: {command} ...")
        begun = perf_counter()
        try:
            printed = pages.run(command, root, out)
        except pages.CommandError as error:
            _say(f"left as it is: {error}")
            continue
        _say(f"  {minutes(perf_counter() - begun)}")
        yield command, printed


def of_pages(asked: list[str], root: Path) -> dict[str, list[str]]:
    """Return the commands in pages, each with the pages that its output stands in."""
    found: dict[str, list[str]] = {}
    for page in asked:
        for command in pages.commands((root / page).read_text(encoding="utf-8")):
            found.setdefault(command, []).append(page)
    return found


def minutes(seconds: float) -> str:
    """Return a duration as minutes and seconds: "41:07 min"."""
    return f"{round(seconds) // 60}:{round(seconds) % 60:02} min"


def _lacking(lacking: list[str]) -> int:
    if lacking:
        raise HierarchyError("; ".join(lacking))
    return 0


def _report(made: _Made, left: dict[str, list[str]], as_json: bool) -> None:
    """Print the statements with their verdicts, the files, and the commands that were left out."""
    files = [shown(path) for path in made.files]
    every = [(text, study, *judged(rows, decides)) for study, rows in made.rows.items()
             for text, decides in statements(study)]
    if as_json:
        return print_json({"files": files, "not_made": left, "claims": [
            dict(zip(("text", "study", "found", "verdict"), one, strict=True)) for one in every]})
    for text, _, found, verdict in every:
        print(f"{verdict:>20}  {text}\n{'':22}{found}")
    print("", *files, sep="\n")
    if left:
        print("\nNot made with --quick, because they have no starts to take a tenth of:")
        print(*(f"  {command} ({', '.join(pages)})" for command, pages in left.items()), sep="\n")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
