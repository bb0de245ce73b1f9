"""Output of the command line: tables of metrics, lists, certificates, progress."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from time import monotonic
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.measure.runs import Row, Run
    from scenarios.results.columns import Results

_WIDTH = 80   # columns of a terminal
_NAMES = 26   # columns of it for the names of metrics
_EVERY = 10.0  # [s] between two lines about progress


def troubles(recording: Any) -> list[str]:
    """Return one line per kind of problem: its ticks; and per missed level: what held it back."""
    from scenarios.measure.happenings import given_up

    faults = [f"{kind}: {action} in {len(ticks)} ticks, first in tick {ticks[0]} "
              f"(t = {recording['t'][ticks[0]]:.3f} s)"
              for (kind, action), ticks in recording.troubles().items()]
    missed = [_filled(str(one)) for one in given_up(recording)]
    return [line for lines in (faults, missed) if lines for line in ("", *lines)]


def certified(recording: Any, damping: float) -> str:
    """Return how many ticks were certified, and the first that was not."""
    ticks = recording["certified"]
    text = f"certified: {ticks.sum()} of {recording.ticks} ticks"
    if ticks.all():
        return text
    first = int(ticks.argmin())
    text += f"; the first one not certified is tick {first} (t = {recording['t'][first]:.3f} s)"
    if damping > 0.0:
        text += (f"\n(damping = {damping:g}: near a singularity the answer differs on purpose from "
                 "the undamped one that is certified)")
    return text


def print_json(data: Any) -> None:
    """Print plain data as one JSON object; a number that is not finite is null."""
    from scenarios.files import finite

    print(json.dumps(finite(data), indent=2, allow_nan=False))


def print_table(runs: list[Run]) -> None:
    """Print the metrics of runs, where strict resolvers diverge, and the verdict by goal."""
    from scenarios.measure.motions import partings
    from scenarios.measure.runs import flags, table
    from scenarios.measure.verdict import lines, verdicts

    found = verdicts(runs)
    goals = [f"  {goal}" for goal in found[0].goals] if len(found) == 1 else []
    _print_rows(dict.fromkeys(run.title for run in runs), "", [run.label for run in runs],
                table(runs), "best of its row, or within 1 % of that",
                ["", *map(str, partings(runs)), *flags(runs), *lines(found), *goals])


def print_samples(name: str, results: Results) -> None:
    """Print the verdict, success rates, and the spread of each metric by resolver."""
    from scenarios.measure.runs import Cell, Row
    from scenarios.results.columns import rows, verdict

    shares = [Row(what, "", "", "", tuple(Cell(str(share)) for share in by.values()))
              for what, by in results.shares().items()]
    _print_rows([f"{name}: {results.samples} samples, paired", *verdict(results)],
                "median [quartiles]", results.labels, [*shares, *rows(results)],
                "separated from all others by the tests of its row alone")


def _print_rows(above: Iterable[str], corner: str, labels: Sequence[str], rows: Sequence[Row],
                best: str, below: Iterable[str] = ()) -> None:
    """Print lines and a table of labelled columns, in as many tables as 80 columns need.

    `best` says what a star means.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(markup=False, highlight=False)
    console.print("", *map(_filled, above), sep="\n")
    heads = [re.sub(r"(?<=[^ :-])[ :-]", lambda at: at[0].strip() + "\n", one) for one in labels]
    cells = [[Text(cell.text + ("*" if cell.kind == "best" else " "),
                   "bold" if cell.kind == "best" else "").append(
                       f"\n{cell.more} " if cell.more else "", "not bold dim")
              for cell in row.cells] for row in rows]
    widest = max(len(line) for text in (*heads, *(cell.plain for some in cells for cell in some))
                 for line in text.splitlines())
    fit = max(1, (_WIDTH - _NAMES) // (widest + 1))
    beside = -(-len(labels) // -(-len(labels) // fit))  # so that tables are about equally wide
    for first in range(0, len(labels), beside):
        laid_out = Table(corner, box=None, padding=(0, 1, 0, 0), pad_edge=False)
        for head in heads[first:first + beside]:
            laid_out.add_column(Text(head), justify="right", no_wrap=True)
        for row, some in zip(rows, cells, strict=True):
            laid_out.add_row(Text(row.heading), *some[first:first + beside])
        console.print("", laid_out)
    if any(cell.kind == "best" for row in rows for cell in row.cells):
        console.print("", f"* {best}", sep="\n")
    for line in below:
        console.print(_filled(line))


def _filled(line: str) -> str:
    """Return a line as lines of 80 columns, those after the first indented further."""
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return fill(line.replace(" %", "\N{NO-BREAK SPACE}%"), _WIDTH, subsequent_indent=indent,
                break_on_hyphens=False).replace("\N{NO-BREAK SPACE}", " ")


def print_lists(lists: dict[str, dict[str, str]], as_json: bool = False) -> None:
    """Print names with descriptions by heading in 80 columns, or all as JSON."""
    if as_json:
        return print_json(lists)
    for what, entries in lists.items():
        print(f"{what}:")
        width = max((len(name) for name in entries), default=0)
        for name, text in entries.items():
            print(fill(text, _WIDTH, initial_indent=f"  {name:{width}}  ",
                       subsequent_indent=" " * (width + 4)) or f"  {name}")


def print_files(files: list[Path], as_json: bool) -> None:
    """Print the files that a command has written."""
    names = [shown(file) for file in files]
    print_json({"files": names}) if as_json else print(*names, sep="\n")


def first_line(thing: Any) -> str:
    """Return the first line of the docstring of a class or an instance."""
    return (thing.__doc__ or "").strip().partition("\n")[0]


@contextmanager
def interruptible(kept: str, folder: Path) -> Iterator[None]:
    """Say at an interruption what is kept, if the folder is there."""
    try:
        yield
    except KeyboardInterrupt:
        if folder.is_dir():
            print(f"hierarchy: {kept}", file=sys.stderr)
        raise


def exit_code(fault: str | None, wrong: bool = False) -> int:
    """Return 0, or print a fault or what is wrong on standard error and return 1 or 2."""
    if fault is None:
        return 0
    print(f"hierarchy: {'error' if wrong else 'fault'}: {fault}", file=sys.stderr)
    return 1 + wrong


def shown(path: Path) -> str:
    """Return a path relative to the current folder, if it is below it."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except (OSError, ValueError):  # the current folder has gone, or is elsewhere
        return str(path)


def kept_in(folder: Path, recording: Any) -> str:
    """Return how long a run was, and where it is."""
    from hierarchy.words import counted

    return f"{counted(recording.ticks, 'tick')} in {shown(folder)}"


@contextmanager
def bar(what: str = "ticks") -> Iterator[Callable[[str, int, int], None]]:
    """Yield a function to call with (label, done, total); `what` is the unit of the count.

    It shows a bar on standard error, or prints a line there now and then if that is no terminal.
    """
    if not sys.stderr.isatty():
        yield lines(what)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(),
               TextColumn(f"{{task.completed:.0f}}/{{task.total:.0f}} {what}"),
               TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        tasks: dict[str, int] = {}

        def told(label: str, done: int, total: int) -> None:
            if label not in tasks:
                tasks[label] = int(progress.add_task(escape(label), total=total))
            progress.update(tasks[label], completed=done)  # type: ignore[arg-type]

        yield told


def lines(what: str, clock: Callable[[], float] = monotonic) -> Callable[[str, int, int], None]:
    """Return a function like that of `bar` that prints a line every 10 s, with what is left.

    clock : returns the present time [s].
    """
    begun: dict[str, tuple[float, int]] = {}
    said = clock()

    def told(label: str, done: int, total: int) -> None:
        nonlocal said
        now = clock()
        start, first = begun.setdefault(label, (now, done))
        if now - said < _EVERY or done >= total:
            return
        said = now
        pace = (now - start) / (done - first) if done > first else None
        left = "" if pace is None else f", about {(total - done) * pace:.0f} s left"
        print(f"{label}: {done} of {total} {what}{left}", file=sys.stderr, flush=True)

    return told
