"""Calls timed in turns, so that noise of the machine affects all equally."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from time import perf_counter
from typing import Any, final

import numpy as np

from benchmark.machine import one_core
from benchmark.worker import Repeats, timed
from hierarchy.problem import Array

FOR_P999 = 1000  # times needed for a 99.9th percentile
TURN = Repeats(least=1, turn=1_000_000)


@final
@dataclass
class Timed:
    """A call, what the row of its times begins with, and the times [ns] so far.

    before : called untimed before each turn.
    """

    call: Callable[[], Any]
    about: Mapping[str, Any] = field(default_factory=dict)
    before: Callable[[], Any] | None = None
    times: list[int] = field(default_factory=list)

    def take_turn(self) -> None:
        """Call untimed, for the caches, then timed for a millisecond; once after a `before`."""
        (self.before or self.call)()
        self.times += timed(self.call, Repeats(1, 1) if self.before else TURN)

    def row(self) -> dict[str, Any]:
        """Return the row of a table: what it is about, and its times."""
        return {**self.about, "solves": len(self.times), **times_of(self.times)}


def times_of(nanoseconds: Sequence[float] | Array, prefix: str = "") -> dict[str, float]:
    """Return median, 95th and 99.9th percentile, largest and smallest time [us]; NaN if unknown."""
    names = [f"{prefix}{name}" for name in ("median_us", "p95_us", "p99.9_us", "most_us",
                                            "least_us")]
    if not len(nanoseconds):
        return dict.fromkeys(names, nan)
    found = np.percentile(nanoseconds, (50.0, 95.0, 99.9, 100.0, 0.0)) / 1e3
    if len(nanoseconds) < FOR_P999:
        found[2] = nan
    return dict(zip(names, map(float, found), strict=True))


def take_turns(everyone: Sequence[Timed], seconds: float, turns: int = 1) -> list[dict[str, Any]]:
    """Time all in turns on one core for `seconds` [s], each at least so often; return their rows.

    One turn before them is not counted: it compiles and fills caches.
    """
    with one_core():
        for one in everyone:
            one.take_turn()
            one.times.clear()
        end = perf_counter() + seconds
        while turns > 0 or perf_counter() < end:
            turns -= 1
            for one in everyone:
                one.take_turn()
    return [one.row() for one in everyone]
