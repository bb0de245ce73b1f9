"""How times grow far beyond the letter's sizes: python docs/studies/scaling.py.

One solve over tasks, rows and joints, by everyone that keeps priorities; and a whole tick of
`ellipse-hqp` over control points and obstacles, where `hcod` has a row for every pair of them.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from scaling_timed import Size

SIZES: dict[str, tuple[Size, ...]] = {
    "tasks": tuple((70, count, 3) for count in (1, 2, 3, 4, 5, 7, 10, 14, 20)),
    "rows": tuple((100, 5, each) for each in (1, 2, 3, 4, 6, 9, 14, 20)),
    "joints": tuple((n, 5, 3) for n in (6, 7, 10, 15, 20, 30, 45, 70, 100, 150, 200, 300))}
PAIRS = ((8, 3), (8, 8), (16, 8), (16, 16), (32, 16), (32, 32), (64, 32), (64, 64), (64, 128),
         (64, 256))          # (control points, obstacles)
SECONDS = 90.0
_TICKS = 1500            # of the run whose states are used
_WIDTH = 100             # characters of a table


def run(out: Path | None = None, seconds: float = SECONDS,
        sizes: dict[str, tuple[Size, ...]] | None = None,
        pairs: Sequence[tuple[int, int]] = PAIRS) -> list[dict[str, Any]]:
    """Time all sizes in turns on one core for `seconds` [s], and at least once; return the rows.

    Prints a table a figure; writes scaling.csv, machine.json and scaling.svg and .png into the
    folder `out` if given.
    """
    from rich.console import Console
    from scaling_timed import Ticks, solves_of

    from scenarios.bench.machine import one_core
    from scenarios.config import load
    from scenarios.loop.simulation import simulate

    solves = [solve for figure, some in (SIZES if sizes is None else sizes).items()
              for solve in solves_of(figure, some)]
    path = simulate(load("ellipse-hqp", [f"control.duration={_TICKS / 1000}"]))
    ticks = [Ticks(*pair, path) for pair in pairs]
    turns = [*(solve.timed.take_turn for solve in solves), *(tick.take_turn for tick in ticks)]
    with one_core():
        for solve in solves:
            solve.timed.call()
        for tick in ticks:
            tick.warm_up()
        end = perf_counter() + seconds
        while True:
            for turn in turns:
                turn()
            if perf_counter() > end:
                break
    rows = [*(solve.row() for solve in solves), *(row for tick in ticks for row in tick.rows())]
    console = Console(highlight=False, markup=False, width=_WIDTH)
    for figure in dict.fromkeys(row["figure"] for row in rows):
        _print(console, figure, [row for row in rows if row["figure"] == figure])
    if out is not None:
        _write(rows, out)
    return rows


def _print(console: Console, figure: str, rows: Sequence[dict[str, Any]]) -> None:
    from scaling_figure import fixed
    from scaling_timed import PARTS

    from scenarios.bench.growth import exponents
    from scenarios.bench.rows import table_of_numbers

    sizes = list(dict.fromkeys(row[figure] for row in rows))
    of = {(row["resolver"], row[figure]): row["median_us"] for row in rows}
    powers = exponents(rows, figure)
    console.print(f"Median time [us] over the number of {figure}; {fixed(figure, rows)}")
    heads = list(dict.fromkeys(f"{row['points']}x{row['obstacles']}" if figure == "pairs"
                               else str(row[figure]) for row in rows))
    table = table_of_numbers((*heads, "power"))
    for label in dict.fromkeys(row["resolver"] for row in rows):
        table.add_row(label, *(_digits(of[label, size]) for size in sizes), f"{powers[label]:.2f}")
    console.print(table)
    if figure == "pairs":
        failures = sum(row["failures"] for row in rows if row["resolver"] == PARTS[-1])
        ticks = sum(row["solves"] for row in rows if row["resolver"] == PARTS[-1])
        console.print(f"Ticks not solved: {failures} of {ticks}.")
    console.print("")


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"


def _write(rows: Sequence[dict[str, Any]], out: Path) -> None:
    from scaling_figure import time_over_sizes

    from scenarios.bench.machine import machine
    from scenarios.bench.rows import write_rows
    from scenarios.draw.figures.drawing import write
    from scenarios.files import write_json

    write_rows(rows, out / "scaling.csv")
    write_json(out / "machine.json", machine())
    write(time_over_sizes(rows), str(out / "scaling"))


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python docs/studies/scaling.py",
                                     description="Times over tasks, rows, joints and pairs.")
    parser.add_argument("--out", type=Path, default=None,
                        help="new or empty folder; default: a new one in runs/")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="for all times together")
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: one core is timed
    from scenarios.files import claim, next_free

    folder = claim(given.out if given.out is not None else next_free(Path("runs") / "scaling"))
    run(folder, given.seconds)
    print(f"Numbers and figure: {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
