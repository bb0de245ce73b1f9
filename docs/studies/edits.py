"""Time of a change of priorities over the number of joints: python docs/studies/edits.py.

A `Factorization` is kept while levels are swapped, reordered, deleted and inserted; beside it what
has to be done without one: `tpm` from the rows in their new order.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, perf_counter_ns
from typing import Any, final

import numpy as np
from rich.console import Console

from hierarchy.problem import Array
from scenarios.bench.machine import one_core
from scenarios.bench.rows import table_of_numbers, write_rows
from solvers import make
from solvers.factorization import Factorization

JOINTS, LEVELS, ROWS = (7, 30, 100, 300), (5, 10), 3
SECONDS = 20.0
_AGREE = 1e-9  # of the factorization and `tpm`, over 1 + |x|
_TURN = 200    # calls of one kind before the next has its turn


@final
@dataclass
class _Timed:
    """Something to time: what goes before it untimed, the thing itself, and its times [ns]."""

    what: str
    joints: int
    levels: int
    before: Callable[[], Any]
    call: Callable[[], Any]
    times: list[int] = field(default_factory=list)

    def take_turn(self) -> None:
        for _ in range(_TURN):
            self.before()
            start = perf_counter_ns()
            self.call()
            self.times.append(perf_counter_ns() - start)

    def row(self) -> dict[str, Any]:
        median, p95, p999 = np.percentile(self.times, [50, 95, 99.9]) / 1e3
        return {"what": self.what, "joints": self.joints, "levels": self.levels,
                "rows": ROWS * self.levels, "calls": len(self.times), "median_us": float(median),
                "p95_us": float(p95), "p99.9_us": float(p999)}


def run(out: Path | None = None, seconds: float = SECONDS,
        joints: Sequence[int] = JOINTS, levels: Sequence[int] = LEVELS) -> list[dict[str, Any]]:
    """Time edits, solves and fresh factorizations at every size; print tables, return the rows.

    All take turns on one core for `seconds` [s] in all, and at least once. Writes edits.csv into
    the folder `out` if given.
    """
    with one_core():
        everything = [timed for count in levels for n in joints for timed in _field(n, count)]
        for timed in everything:
            timed.take_turn()
            timed.times.clear()
        end = perf_counter() + seconds
        while True:
            for timed in everything:
                timed.take_turn()
            if perf_counter() > end:
                break
    rows = [timed.row() for timed in everything]
    console = Console(highlight=False, markup=False)
    for count in levels:
        _print(console, [row for row in rows if row["levels"] == count])
    if out is not None:
        write_rows(rows, out / "edits.csv")
    return rows


def _field(n: int, count: int) -> list[_Timed]:
    """What is timed on one random stack; each edit on a factorization of its own."""
    rng = np.random.default_rng(n)
    A = [rng.normal(size=(ROWS, n)) for _ in range(count)]
    b, tpm = rng.normal(size=ROWS * count), make("tpm")

    def kept() -> Factorization:
        factored = Factorization(A)
        factored.update()
        return factored

    _check(kept(), b)
    first, last, back, gone, new, asked, both = (kept() for _ in range(7))
    order, h, top = list(range(count))[::-1], asked.hierarchy(b), "level 1"

    def put_back() -> None:
        gone.insert(top, A[0], 0)
        gone.update()

    def take_out() -> None:
        new.delete(top)
        new.update()

    def swap_and_solve() -> None:
        both.swap(0, 1)
        both.solve(b)

    gone.delete(top)
    todo: list[tuple[str, Callable[[], Any], Callable[[], Any]]] = [
        ("swap the first two", _nothing, _done(first, lambda: first.swap(0, 1))),
        ("swap the last two", _nothing, _done(last, lambda: last.swap(count - 2, count - 1))),
        ("reverse the order", _nothing, _done(back, lambda: back.reorder(order))),
        ("delete the first", put_back, _done(gone, lambda: gone.delete(top))),
        ("insert as the first", take_out, _done(new, lambda: new.insert(top, A[0], 0))),
        ("F", _nothing, lambda: asked.F),
        ("solve", _nothing, lambda: asked.solve(b)),
        ("swap the first two, solve", _nothing, swap_and_solve),
        ("tpm on the rows", _nothing, lambda: tpm.solve(h)),
        ("factor afresh", _nothing, kept)]
    return [_Timed(what, n, count, before, call) for what, before, call in todo]


def _done(factored: Factorization, edit: Callable[[], None]) -> Callable[[], None]:
    """An edit and the work that follows from it."""
    def call() -> None:
        edit()
        factored.update()

    return call


def _nothing() -> None:
    """What goes before a call that needs nothing."""


def _check(factored: Factorization, b: Array) -> None:
    for _ in range(2):
        x, y = factored.solve(b).x, make("tpm").solve(factored.hierarchy(b)).x
        if np.abs(x - y).max() > _AGREE * (1.0 + np.abs(y).max()):
            raise AssertionError("the factorization does not answer as tpm does")
        factored.swap(0, 1)


def _print(console: Console, rows: Sequence[dict[str, Any]]) -> None:
    joints = list(dict.fromkeys(row["joints"] for row in rows))
    of = {(row["what"], row["joints"]): row["median_us"] for row in rows}
    console.print(f"Median time [us] over the number of joints; {rows[0]['levels']} levels of "
                  f"{ROWS} rows")
    table = table_of_numbers(map(str, joints))
    for what in dict.fromkeys(row["what"] for row in rows):
        table.add_row(what, *(f"{of[what, n]:.1f}" for n in joints))
    console.print(table)
    console.print(said(rows), "", sep="\n")


def said(rows: Sequence[dict[str, Any]]) -> str:
    """Return in a sentence how a change of priorities stands to `tpm` from the rows."""
    of = {(row["what"], row["joints"]): row["median_us"] for row in rows}
    joints = sorted({row["joints"] for row in rows})
    low = [of["swap the first two", n] for n in joints]
    gains = ", ".join(
        f"{of['tpm on the rows', n] / of['swap the first two, solve', n]:.1g} at {n}"
        for n in joints)
    return (f"Shows: a swap takes {min(low):.1f} to {max(low):.1f} us at any number of joints. "
            f"Time of tpm on the rows over that of a swap and a solve: {gains} joints.")


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python docs/studies/edits.py",
                                     description="Time of a change of priorities.")
    parser.add_argument("--out", type=Path, default=None,
                        help="new or empty folder; default: a new one in runs/")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="for all times together")
    given = parser.parse_args()
    from scenarios.files import claim, next_free

    folder = claim(given.out if given.out is not None else next_free(Path("runs") / "edits"))
    run(folder, given.seconds)
    print(f"Numbers: {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
