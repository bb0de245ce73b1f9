"""Time of a change of priorities over the number of joints: python -m benchmark.studies.edits.

A `Factorization` is kept while levels are swapped, reordered, deleted and inserted; beside it what
has to be done without one: `tpm` from the rows in their new order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import typer

from benchmark.report import Report, Section
from benchmark.tables import Table, short, wide
from benchmark.timing import Timed, take_turns
from hierarchy.problem import Array
from solvers import make
from solvers.factorization import Factorization

JOINTS, LEVELS, ROWS = (7, 30, 100, 300), (5, 10), 3
SECONDS = 20.0
_AGREE = 1e-9  # of the factorization and `tpm`, over 1 + |x|


def run(seconds: float = SECONDS, joints: Sequence[int] = JOINTS, levels: Sequence[int] = LEVELS
        ) -> Report:
    """Time edits, solves and fresh factorizations at every size, all in turns on one core."""
    rows = take_turns([timed for count in levels for n in joints for timed in _field(n, count)],
                      seconds, turns=20)
    tables = []
    for count in levels:
        some, columns = wide([row for row in rows if row["levels"] == count], "what", "joints",
                             "median_us", short)
        tables.append(Table(f"Median time [us] over the number of joints; {count} levels of {ROWS} "
                            "rows", some, columns, "what"))
    return Report("Changes of priorities", [Section("", tables)], {"edits": rows})


def _field(n: int, count: int) -> list[Timed]:
    """Return what is timed on one random stack; each edit on a factorization of its own."""
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

    def swap_and_solve() -> None:
        both.swap(0, 1)
        both.solve(b)

    gone.delete(top)
    put_back = _done(gone, lambda: gone.insert(top, A[0], 0))
    take_out = _done(new, lambda: new.delete(top))
    todo: list[tuple[str, Callable[[], Any], Callable[[], Any] | None]] = [
        ("swap the first two", _done(first, lambda: first.swap(0, 1)), None),
        ("swap the last two", _done(last, lambda: last.swap(count - 2, count - 1)), None),
        ("reverse the order", _done(back, lambda: back.reorder(order)), None),
        ("delete the first", _done(gone, lambda: gone.delete(top)), put_back),
        ("insert as the first", _done(new, lambda: new.insert(top, A[0], 0)), take_out),
        ("F", lambda: asked.F, None), ("solve", lambda: asked.solve(b), None),
        ("swap the first two, solve", swap_and_solve, None),
        ("tpm on the rows", lambda: tpm.solve(h), None), ("factor afresh", kept, None)]
    return [Timed(call, {"what": what, "joints": n, "levels": count}, before)
            for what, call, before in todo]


def _done(factored: Factorization, edit: Callable[[], None]) -> Callable[[], None]:
    """Return an edit with the work that follows from it."""
    def call() -> None:
        edit()
        factored.update()

    return call


def _check(factored: Factorization, b: Array) -> None:
    for _ in range(2):
        x, y = factored.solve(b).x, make("tpm").solve(factored.hierarchy(b)).x
        if np.abs(x - y).max() > _AGREE * (1.0 + np.abs(y).max()):
            raise AssertionError("the factorization does not answer as tpm does")
        factored.swap(0, 1)


def main(seconds: float = SECONDS) -> None:
    """Print the tables; seconds : for all times together."""
    run(seconds).say()


if __name__ == "__main__":
    typer.run(main)
