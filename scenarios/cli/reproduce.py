"""`hierarchy reproduce`: make the numbers of the documents, and write them into the pages."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from hierarchy.errors import HierarchyError
from scenarios.cli.options import INTERRUPTED
from scenarios.cli.progress import bar
from scenarios.cli.terminal import print_json, shown
from scenarios.files import make_folder, reason
from scenarios.reproduce import rows
from scenarios.reproduce.blocks import CLAIMS
from scenarios.reproduce.pages import checkout
from scenarios.reproduce.rows import Rows
from scenarios.reproduce.whole import (
    Chosen,
    chosen,
    minutes,
    of_pages,
    outputs,
    reproduce,
    write_documents,
)
from scenarios.sweep.engine import EngineError


@dataclass
class _Made:
    """What has been made so far, and the files it was written to as it ended."""

    out: Path
    root: Path | None  # of the checkout whose pages are written
    rows: dict[str, Rows] = field(default_factory=dict)
    files: dict[Path, None] = field(default_factory=dict)
    lacking: list[str] = field(default_factory=list)

    def add(self, found: dict[str, Rows], printed: dict[str, str]) -> None:
        """Keep rows or an output, and write the pages."""
        self.rows |= found
        self.files |= dict.fromkeys(rows.write(one, self.out) for one in found.values())
        if self.root:
            written, self.lacking = write_documents(found, printed, self.root)
            self.files |= dict.fromkeys(written)


def reproduce_command(names: list[str], out: Path, quick: bool, workers: int | None,
                      as_json: bool = False) -> int:
    """Run studies and commands; unless `quick`, write the pages; print what the claims came to."""
    asked, begun = chosen(names), perf_counter()
    if quick and not asked.studies:
        raise HierarchyError(f"--quick runs studies, and {', '.join(asked.pages)} has the output "
                             "of commands; leave --quick out")
    made = _Made(make_folder(out), None if quick else checkout())
    left = _left(asked.pages) if quick else {}
    try:
        _make(asked, made, quick, workers)
    except (OSError, EngineError) as error:
        _say(f"hierarchy: fault: {_fault(error)}")
        return 1
    except KeyboardInterrupt:
        _say("hierarchy: interrupted; the same command continues from here")
        return INTERRUPTED
    _report(made, left, as_json)
    _say(f"{minutes(perf_counter() - begun)} in all")
    if made.lacking:
        raise HierarchyError("; ".join(made.lacking))
    return 0


def _make(asked: Chosen, made: _Made, quick: bool, workers: int | None) -> None:
    with bar("runs") as progress:
        for one in reproduce(asked.studies, made.out, quick, workers, progress, _say):
            made.add({one.study: one}, {})
    if made.root:
        for command, printed in outputs(asked.pages, made.root, made.out / "output", _say):
            made.add({}, {command: printed})


def _left(asked: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the commands that are not run; an installed package has no pages that name them."""
    try:
        return of_pages(asked, checkout())
    except HierarchyError:
        return {}


def _fault(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or 'a file'} cannot be written: {reason(error)}"
    return str(error)


def fill_command() -> int:
    """Write the pages of the checkout from the rows and outputs that are kept."""
    written, lacking = write_documents({}, {}, checkout())
    print(*map(shown, written), sep="\n")
    if lacking:
        raise HierarchyError("; ".join(lacking))
    return 0


def _report(made: _Made, left: dict[str, list[str]], as_json: bool) -> None:
    """Print the claims with their verdicts, the files, and the commands that were left out."""
    files = [shown(path) for path in made.files]
    judged = [(claim, claim.judge(made.rows[claim.study])) for claim in CLAIMS
              if claim.study in made.rows]
    if as_json:
        print_json({"files": files, "not_made": left, "claims": [
            {"text": claim.text, "study": claim.study, "found": one.found, "verdict": one.verdict}
            for claim, one in judged]})
        return
    for claim, one in judged:
        print(f"{one.verdict:>20}  {claim.text}\n{'':22}{one.found}")
    print("", *files, sep="\n")
    if left:
        print("\nNot made with --quick, because they have no starts to take a tenth of:")
        print(*(f"  {command} ({', '.join(pages)})" for command, pages in left.items()), sep="\n")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
