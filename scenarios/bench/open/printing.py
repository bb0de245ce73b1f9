"""The results as text."""

from __future__ import annotations

from math import isnan, nan

from rich.console import Console
from rich.table import Table

from scenarios.bench.open.judge import CRASHED, FAILED, HUNG, MODEST, RAISED, RIGHT, SOLVED, WRONG
from scenarios.bench.open.results import Half, Results
from scenarios.bench.open.summary import Summary

NOTES = f"""\
right: share of the problems asked that are solved, and called so: every level missed by no more \
than {RIGHT:g} |a| (1 + |x|). wrong: called solved, but missed by more. modest: right, but not \
called so. failed: neither. ended: raised, crashed, or took too long. miss: largest of those \
called solved, in the rows' unit, and relative to |a| (1 + |x|). moved: how far the last level \
moved one above, relative likewise. same: the same bits twice. rough: largest step between two \
ticks, beside that of the proved answers. MB: growth of the process. Times in microseconds, of one \
call from Python; C++: of the solve alone, taken inside the compiled package."""
CHOSEN = ("EQ7", "INEQ7", "HUM38", "ellipse-hqp", "humanoid-reach")
"""Families whose times are drawn."""
TIMED = ("EQ7", "INEQ7", "HUM38", "human-hqp")
"""Families whose times are printed."""
_NARROW = 80  # columns of a terminal
_LABEL, _FAMILY = 23, 19  # width of the entrants' column and of a family's three
_NAME, _PAIR = 18, 13     # width of the families' column, and of an entrant's two


def say(console: Console, found: Results) -> None:
    """Print the tables of every half, the fresh ones first."""
    for half in found.halves:
        tables = (answers(half), sizes(half), times(half, console.width),
                  *insides(half, console.width))
        console.print(*(part for table in tables for part in (table, "")), sep="\n")
    console.print(NOTES, "", sep="\n")
    for label, why in found.missing.items():
        console.print(f"skipped: {label} ({why})")


def answers(half: Half) -> Table:
    """Return the table of what became of the problems of a half."""
    count = sum(len(half.collections[name].problems) for name in half.families)
    table = _table(f"{half.title}: {count} problems of {len(half.families)} families",
                   ("asked", "right", "wrong", "modest", "failed", "ended"))
    for label in half.entrants:
        table.add_row(label, *counted(half.whole[label]))
    return table


def sizes(half: Half) -> Table:
    """Return the table of how well the problems of a half were solved."""
    table = _table(f"{half.title}: quality",
                   ("miss", "relative", "moved", "same", "rough", "MB"))
    for label in half.entrants:
        one = half.whole[label]
        table.add_row(label, power(one.absolute), power(one.relative), power(one.moved),
                      "yes" if one.same else "no", digits(one.rough), f"{one.memory / 1024:.0f}")
    return table


def counted(one: Summary) -> tuple[str, ...]:
    """Return problems asked, share right, and the other verdicts."""
    ended = sum(one.counts[verdict] for verdict in (RAISED, CRASHED, HUNG))
    return (str(one.asked), share(one.right), *(str(one.counts[verdict]) for verdict in
                                                (WRONG, MODEST, FAILED)), str(ended))


def times(half: Half, width: int) -> Table:
    """Return the table of times in a few families of a half, as many as fit the width."""
    room = max(1, (width - _LABEL) // _FAMILY)
    chosen = [name for name in TIMED if name in half.families][:room]
    heads = [head for name in chosen for head in (f"{name}\nmedian", "\np95", "\nwarm")]
    table = _table(f"{half.title}: times", heads)
    for label in half.entrants:
        cells = [half.cells.get((label, name)) for name in chosen]
        if any(one is not None and one.counts[SOLVED] for one in cells):
            table.add_row(label, *(text for one in cells for text in _timed(one)))
    return table


def insides(half: Half, width: int) -> list[Table]:
    """Return tables of times from Python and inside C++, of as many entrants as fit the width.

    One for cold and one for warm starts, each with the families that an entrant has solved.
    """
    return [table for warm in (False, True) if (table := _inside(half, warm, width)).row_count]


def _inside(half: Half, warm: bool, width: int) -> Table:
    chosen = [label for label in half.entrants
              if not isnan(_pair(half.whole[label], warm)[1])][:(width - _NAME) // _PAIR]
    heads = [head for label in chosen
             for head in ("\n".join([*label.split(" ", 1), "Python"]), "C++")]
    kind = "warm" if warm else "cold"
    table = _table(f"{half.title}: median of {kind} starts, compiled entrants", heads)
    for column in table.columns[1:]:
        column.header_style, column.vertical = "", "bottom"
    for family in half.families:
        pairs = [_pair(half.cells.get((label, family)), warm) for label in chosen]
        if not all(isnan(inside) for _, inside in pairs):
            table.add_row(family, *(digits(time) for pair in pairs for time in pair))
    return table


def _pair(one: Summary | None, warm: bool) -> tuple[float, float]:
    """Return the median from Python and inside, NaN without an answer that is solved."""
    if one is None or not one.counts[SOLVED]:
        return nan, nan
    return ((one.warm.median, one.warm_inside.median) if warm
            else (one.cold.median, one.cold_inside.median))


def _timed(one: Summary | None) -> tuple[str, ...]:
    if one is None or not one.counts[SOLVED]:
        return ("–",) * 3
    return digits(one.cold.median), digits(one.cold.p95), digits(one.warm.median)


def _table(title: str, heads: tuple[str, ...] | list[str]) -> Table:
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0),
                  pad_edge=False, min_width=min(len(title), _NARROW))
    table.add_column("", no_wrap=True)
    for head in heads:
        table.add_column(head, justify="right", no_wrap=True)
    return table


def share(value: float) -> str:
    """Return a share in percent; 100 only if it is all."""
    if isnan(value):
        return "–"
    return "100%" if value == 1.0 else f"{min(100.0 * value, 99.9):.1f}%"


def digits(value: float) -> str:
    """Return a number with three digits, or all digits before the decimal point."""
    if isnan(value):
        return "–"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.1f}" if value >= 10.0 else f"{value:.2f}"


def power(value: float) -> str:
    """Return a size as 1e-09."""
    return "–" if isnan(value) else "0" if value == 0.0 else f"{value:.0e}"
