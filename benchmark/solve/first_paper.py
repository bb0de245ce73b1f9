"""The experiments of the paper that introduced the Task Priority Matrix: accuracy, and growth."""

from __future__ import annotations

from benchmark.report import Report
from benchmark.solve import accuracy, growth


def run(arms: int = accuracy.ARMS, checked: int = accuracy.CHECKED,
        seconds: float = growth.SECONDS) -> Report:
    """Measure errors on random arms and times over sizes; see `accuracy.run` and `growth.run`."""
    errors, times = accuracy.run(arms, checked), growth.run(seconds)
    return Report("After the first paper", [*errors.sections, *times.sections],
                  {**errors.rows, **times.rows})
