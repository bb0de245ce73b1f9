"""The experiments of the paper that introduced the Task Priority Matrix, with the resolvers here.

F. Flacco, "The Tasks Priority Matrix: a new tool for hierarchical redundancy resolution" (2016):
errors of the tasks over many random arms of six joints, and time over the number of tasks and of
joints.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

ARMS, CHECKED, SECONDS = 10_000, 300, 40.0
Rows = list[dict[str, Any]]

_ERRORS = """\
Errors: norm of a task's violation [m/s and rad/s], over the least that it can have; x: distance \
to the exact answer over 1 + |x|, on a sample. The exact answer comes from rational arithmetic, \
for damped cases from numpy's SVD. cert: share of the sample that `certify` accepts. Arms: random \
Denavit-Hartenberg tables, alpha of -90, 0, 90 deg in one half and any in the other, a and d up \
to 0.5 m; targets up to 1 m/s or rad/s."""
_TIMES = """\
Times: one call from Python, one core, all resolvers in turns; power: slope of the upper half of \
sizes, log over log."""


def run(out: Path | None = None, arms: int = ARMS, checked: int = CHECKED,
        seconds: float = SECONDS) -> tuple[Rows, Rows]:
    """Measure errors and times; see `errors` and `times`."""
    return errors(out, arms, checked), times(out, seconds)


def errors(out: Path | None = None, arms: int = ARMS, checked: int = CHECKED) -> Rows:
    """Measure every resolver's errors on random arms; print a table for each case, return the rows.

    Writes errors.csv and machine.json into the folder `out` if given.

    arms : of every case; `checked` of them are compared with exact answers.
    """
    from scenarios.bench import accuracy
    from scenarios.bench.rows import write_rows

    rows = accuracy.run(arms, max(1, min(checked, arms)))
    _print(_ERRORS)
    if out is not None:
        write_rows(rows, out / "errors.csv")
        _write_machine(out)
    return rows


def times(out: Path | None = None, seconds: float = SECONDS) -> Rows:
    """Time every resolver over tasks and joints for `seconds` [s] in all; print, return the rows.

    Writes growth.csv, growth.svg, growth.png and machine.json into the folder `out` if given.
    """
    from scenarios.bench import growth

    rows = growth.run(seconds)
    _print(_TIMES)
    if out is not None:
        from scenarios.bench.growth_figure import time_over_size
        from scenarios.bench.rows import write_rows
        from scenarios.draw.figures.drawing import write

        write_rows(rows, out / "growth.csv")
        write(time_over_size(rows), str(out / "growth"))
        _write_machine(out)
    return rows


def _print(notes: str) -> None:
    from rich.console import Console

    Console(highlight=False, markup=False).print(notes)


def _write_machine(out: Path) -> None:
    from scenarios.bench.machine import machine
    from scenarios.files import write_json

    write_json(out / "machine.json", machine())
