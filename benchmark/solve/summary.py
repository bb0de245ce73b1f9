"""Judged rows summed up: for each entrant, over some or all families."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from benchmark.solve.judge import ENDED, FAILED, MODEST, REFUSED, SOLVED, WRONG
from benchmark.store import Row
from benchmark.timing import times_of
from hierarchy.problem import Array
from solvers.problems.files import Collection

TIMES = {"cold": "", "warm": "warm_", "cold_inside": "inside_", "warm_inside": "warm_inside_"}
"""Prefix of the names of times in a summary, by those of the raw rows."""


def summary(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> Row:
    """Sum up the rows of one entrant.

    asked, right (share), wrong, modest, failed, ended, answered : problems by verdict. absolute,
    relative, moved : largest of those called solved. Times by TIMES. iterations, warm_iterations :
    medians. warm_right : share. same : whether all second solves gave the same bits. memory [KiB].
    rough : along sequences, the largest step of x beside that of the proved answers. NaN : unknown.

    steps : of each sequence, by family, the largest step of the proved answers.
    """
    counts = Counter(row["verdict"] for row in rows)
    claimed = [row for row in rows if row["verdict"] in (SOLVED, WRONG)]
    asked = counts.total() - counts[REFUSED]
    rough = [_step([row["x"] for row in own]) / steps[family]
             for family, own in by(rows, "family") if steps and steps.get(family)]
    found: Row = {
        "entrant": rows[0]["entrant"], "version": rows[0].get("version"), "problems": len(rows),
        "asked": asked, "right": counts[SOLVED] / asked if asked else np.nan,
        "wrong": counts[WRONG], "modest": counts[MODEST], "failed": counts[FAILED],
        "ended": sum(counts[verdict] for verdict in ENDED), "answered": len(claimed),
        **{key: _largest(row[key] for row in claimed)
           for key in ("absolute", "relative", "moved")},
        "iterations": _over(np.median, (row.get("iterations") for row in rows)),
        "warm_iterations": _over(np.median, (row.get("warm_iterations") for row in rows)),
        "warm_right": _over(np.mean, (row["warm_right"] for row in rows)),
        "same": all(row.get("same") is not False for row in rows),
        "memory_mb": max(row["memory"] for row in rows) / 1024, "rough": _largest(rough)}
    for key, prefix in TIMES.items():
        found |= times_of([time for row in rows for time in row.get(f"{key}_ns") or ()], prefix)
    return found


def summaries(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> list[Row]:
    """Return the summary of each entrant."""
    return [summary(own, steps) for _, own in by(rows, "entrant")]


def cells(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> list[Row]:
    """Return the summary of each entrant in each family."""
    return [{"family": family, **summary(own, steps)}
            for family, some in by(rows, "family") for _, own in by(some, "entrant")]


def by(rows: Iterable[Row], key: str) -> list[tuple[str, list[Row]]]:
    """Return the rows in groups, in the order in which they first occur."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row[key], []).append(row)
    return list(groups.items())


def steps_of(collections: Mapping[str, Collection]) -> dict[str, float]:
    """Return the largest step of the proved answers along each sequence, by family."""
    found = {}
    for name, one in collections.items():
        known = [proof.x if proof.complete else None for proof in one.answers or ()]
        step = _step(known)
        if one.head.sequence and not np.isnan(step):
            found[name] = step
    return found


def profile(rows: Sequence[Row], ratios: Array) -> dict[str, Array]:
    """Return the performance profile of each entrant (Dolan and More 2002) at ratios (k,).

    For each ratio the share of all problems that the entrant solves, calls solved, and needs no
    more than that ratio of the time of the fastest entrant that does. Problems that it cannot be
    asked count as not solved.
    """
    problems: dict[tuple[str, int], dict[str, float]] = {}
    for row in rows:
        own = problems.setdefault((row["family"], row["problem"]), {})
        own[row["entrant"]] = (float(np.median(row["cold_ns"])) if row["verdict"] == SOLVED
                               else np.inf)
    fastest = np.array([min(own.values()) for own in problems.values()])
    found = {}
    for name in dict.fromkeys(row["entrant"] for row in rows):
        times = np.array([own.get(name, np.inf) for own in problems.values()])
        ratio = np.divide(times, fastest, out=np.full(len(times), np.inf),
                          where=np.isfinite(fastest))
        found[name] = np.array([(ratio <= most).mean() for most in ratios])
    return found


def _step(points: Sequence[Array | None]) -> float:
    """Return the largest distance of two successive points of one length; NaN if there is none."""
    steps = [float(np.linalg.norm(one - other)) for one, other in pairwise(points)
             if one is not None and other is not None and len(one) == len(other)]
    return max(steps, default=np.nan)


def _largest(values: Iterable[float]) -> float:
    return max((value for value in values if not np.isnan(value)), default=np.nan)


def _over(reduce: Callable[..., Any], values: Iterable[float | None]) -> float:
    found = [value for value in values if value is not None]
    return float(reduce(found)) if found else np.nan
