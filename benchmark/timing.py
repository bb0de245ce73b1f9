"""The machine, one core of it, and calls timed in turns, so that its noise affects all equally."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from benchmark.worker import Repeats, timed
from hierarchy.problem import Array
from scenarios.measure.run_folder import versions

FOR_P999 = 1000  # times needed for a 99.9th percentile
TURN = Repeats(least=1, turn=1_000_000)
_PACKAGES = "scipy", "quadprog", "daqp", "piqp", "clarabel"  # besides those of a run


@contextmanager
def one_core() -> Iterator[None]:
    """Pin this process to one of its cores, if the system can, and restore them afterwards."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def machine() -> dict[str, str]:
    """Return processor, cores and versions by name, without personal data."""
    return versions(*_PACKAGES)


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


def take_turns(calls: Sequence[tuple[Mapping[str, Any], Callable[[], Any]]], seconds: float
               ) -> list[dict[str, Any]]:
    """Let calls take turns on one core for `seconds` [s], at least one each; return their rows.

    calls : what the row of its times begins with, and the call. One turn before them is not
    counted: it compiles and fills caches.
    """
    times: list[list[int]] = [[] for _ in calls]
    with one_core():
        for _, call in calls:
            call()
            timed(call, TURN)
        end = perf_counter() + seconds
        while not times[0] or perf_counter() < end:
            for own, (_, call) in zip(times, calls, strict=True):
                call()
                own += timed(call, TURN)[0]
    return [{**about, "solves": len(own), **times_of(own)}
            for own, (about, _) in zip(times, calls, strict=True)]
