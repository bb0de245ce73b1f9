"""The experiments of the paper that introduced the Task Priority Matrix, with the resolvers here.

F. Flacco, "The Tasks Priority Matrix: a new tool for hierarchical redundancy resolution" (2016):
errors of the tasks over many random arms of six joints, and time over the number of tasks and of
joints. `hierarchy bench first-paper`, or with options `python -m scenarios.bench.first_paper`.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

ARMS, CHECKED, SECONDS = 10_000, 1_000, 60.0

NOTES = """\
Errors: norm of a task's violation [m/s and rad/s], over the least that it can have; x: distance \
to the exact answer over 1 + |x|, on a sample. The exact answer comes from rational arithmetic, \
for damped cases from numpy's SVD. cert: share of the sample that `certify` accepts. Arms: random \
Denavit-Hartenberg tables, alpha of -90, 0, 90 deg in one half and any in the other, a and d up \
to 0.5 m; targets up to 1 m/s or rad/s. Times: one call from Python, one core, everybody in \
turns; power: slope of the upper half of sizes, log over log."""


def run(out: Path | None = None, arms: int = ARMS, checked: int = CHECKED,
        seconds: float = SECONDS) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Judge everyone on random arms, time everyone over tasks and joints; return both tables.

    Prints both; writes errors.csv, growth.csv, machine.json and growth.svg and .png into `out` if
    given.

    arms : of every case; `checked` of them are held against exact answers.
    seconds : [s] for all times together.
    """
    from rich.console import Console

    from scenarios.bench import accuracy, growth
    from scenarios.bench.machine import machine

    errors = accuracy.run(arms, max(1, min(checked, arms)))
    times = growth.run(seconds)
    Console(highlight=False, markup=False).print(NOTES)
    if out is not None:
        from scenarios.bench.growth_figure import time_over_size
        from scenarios.bench.rows import write_rows
        from scenarios.draw.figures.drawing import write
        from scenarios.files import write_json

        write_rows(errors, out / "errors.csv")
        write_rows(times, out / "growth.csv")
        write_json(out / "machine.json", machine())
        write(time_over_size(times), str(out / "growth"))
    return errors, times


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python -m scenarios.bench.first_paper",
                                     description="Errors and times of the first paper's kind.")
    parser.add_argument("--out", type=Path, default=None,
                        help="new or empty folder; default: a new one in runs/")
    parser.add_argument("--arms", type=int, default=ARMS, help="how many of each case")
    parser.add_argument("--checked", type=int, default=CHECKED,
                        help="how many of them against exact answers")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="for all times together")
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: one core is timed
    from scenarios.files import claim, next_free

    folder = claim(given.out if given.out is not None else next_free(Path("runs") / "first-paper"))
    run(folder, given.arms, given.checked, given.seconds)
    print(f"\nNumbers: {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
