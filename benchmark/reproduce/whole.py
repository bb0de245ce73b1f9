"""Make the runs of the protocol and the outputs of commands, store them, and write the pages."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from benchmark.reproduce import fronts, pages, protocol
from benchmark.reproduce.blocks import POINTS, ROWS, Stored, every, said
from benchmark.reproduce.protocol import PROTOCOL, Rows
from hierarchy.errors import HierarchyError, UnknownNameError
from scenarios.cli.options import INTERRUPTED
from scenarios.cli.terminal import bar, print_json, shown
from scenarios.files import make_folder, reason, write_text
from scenarios.results.sampled import Workers

NAME, TUNED = "protocol", "fronts"  # of the runs
PICTURE = "docs/images/fronts.png"


def fill(root: Path | None = None) -> int:
    """Write the pages of the checkout from the rows and outputs that are stored."""
    root = root or pages.ROOT
    written, lacking = pages.fill(root, Stored.read(root))
    print(*map(shown, written), sep="\n")
    return _lacking(lacking)


def run(names: list[str], out: Path, quick: bool = False, workers: int | None = None,
        as_json: bool = False, root: Path | None = None) -> int:
    """Make runs and outputs; unless `quick`, write the pages as they end; print the verdicts."""
    begun, root = perf_counter(), root or pages.ROOT
    runs, asked = chosen(names, root)
    if quick and NAME not in runs:
        raise HierarchyError(f"--quick makes runs, and {', '.join(asked)} has the output of "
                             "commands; leave --quick out")
    make_folder(out)
    rows, lacking = None, list[str]()
    try:
        for rows in _ran(out / NAME, quick, workers) if NAME in runs else ():
            if not quick:
                protocol.write(rows, root / ROWS)
                lacking = pages.fill(root, Stored.read(root))[1]
        for _ in () if quick else _others(runs, asked, out, workers, root):
            lacking = pages.fill(root, Stored.read(root))[1]
    except OSError as error:
        why = (f"{error.filename or 'a file'} cannot be written: {reason(error)}"
               if error.strerror else str(error))
        _say(f"hierarchy: fault: {why}")
        return 1
    except KeyboardInterrupt:
        _say("hierarchy: interrupted; the same command continues from here")
        return INTERRUPTED
    if rows is not None:
        _report(rows, as_json)
    _say(f"{minutes(perf_counter() - begun)} in all")
    return _lacking(lacking)


def _others(runs: list[str], asked: list[str], out: Path, workers: int | None, root: Path
            ) -> Iterator[None]:
    """Make and store fronts and their figure, then outputs of commands; yield after each."""
    if TUNED in runs:
        with bar("runs") as progress:
            points = fronts.run(out / TUNED, Workers(workers), progress)
        fronts.write(points, root / POINTS)
        fronts.figure(points).savefig(root / PICTURE, dpi=120)
        yield
    for command, printed in outputs(asked, root, out / "output"):
        write_text(pages.file_of(command, root), printed)
        yield


def chosen(names: list[str], root: Path) -> tuple[list[str], list[str]]:
    """Return the kinds of runs that are asked for, and pages with commands; all without names.

    Raises UnknownNameError.
    """
    known = pages.marked(root)
    for name in names:
        if name not in (NAME, TUNED, *known):
            raise UnknownNameError("page", name, (NAME, TUNED, *known))
    return ([name for name in (NAME, TUNED) if name in names or not names],
            [name for name in known if name in names or not names])


def _ran(out: Path, quick: bool, workers: int | None) -> Iterator[Rows]:
    with bar("runs") as progress:
        yield from protocol.run(protocol.quick(PROTOCOL) if quick else PROTOCOL, out,
                                Workers(workers), progress)


def outputs(asked: list[str], root: Path, out: Path) -> Iterator[tuple[str, str]]:
    """Run the commands of pages, one after the other; yield each with what it prints as it ends.

    Those whose output `out` has are not repeated, and those that fail are left out.
    """
    found = dict.fromkeys(command for page in asked for command in
                          pages.commands((root / page).read_text(encoding="utf-8")))
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


def minutes(seconds: float) -> str:
    """Return a duration as minutes and seconds: "41:07 min"."""
    return f"{round(seconds) // 60}:{round(seconds) % 60:02} min"


def _lacking(lacking: list[str]) -> int:
    if lacking:
        raise HierarchyError("; ".join(lacking))
    return 0


def _report(rows: Rows, as_json: bool) -> None:
    """Print the claims with what was found and the verdicts."""
    if as_json:
        return print_json([{"claim": one.claim.name, "text": one.claim.text, "p": one.p,
                            "found": said(one, rows), "verdict": one.decided}
                           for one in every(rows)])
    for one in every(rows):
        print(f"{one.decided}: {one.claim.text}\n    {said(one, rows)}")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
