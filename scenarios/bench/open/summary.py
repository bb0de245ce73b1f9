"""Judged rows summed up: for each half, each entrant and each family."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import final

import numpy as np

from hierarchy.problem import Array
from scenarios.bench.open.judge import REFUSED, RIGHT, SOLVED, WRONG, Judged

FOR_P999 = 1000  # times needed for a 99.9th percentile
_LIMITS = (50.0, 95.0, 99.9, 100.0)


@final
@dataclass(frozen=True)
class Times:
    """Median, 95th and 99.9th percentile and largest time [us]; NaN where not known."""

    median: float
    p95: float
    p999: float
    largest: float

    @staticmethod
    def of(nanoseconds: Sequence[int]) -> Times:
        """Sum up times [ns]."""
        if not nanoseconds:
            return Times(np.nan, np.nan, np.nan, np.nan)
        found = np.percentile(nanoseconds, _LIMITS) / 1e3
        rare = float(found[2]) if len(nanoseconds) >= FOR_P999 else np.nan
        return Times(float(found[0]), float(found[1]), rare, float(found[3]))


@final
@dataclass(frozen=True)
class Summary:
    """One entrant on the problems of one half, of one family or of several.

    Attributes
    ----------
    counts : of the verdicts, by name.
    absolute, relative, moved : largest of those called solved; see `Judged`.
    cold, warm : times of all solves of problems that were answered, from Python; cold_inside,
        warm_inside : those that a compiled package took itself.
    iterations, warm_iterations : medians, NaN if not known.
    warm_right : share of the warm answers that are right, NaN without any.
    same : whether all second solves gave the same bits.
    memory : growth of the process [KiB].
    rough : along sequences, the largest step of x between two ticks beside that of the proved
        answers; NaN without a sequence.
    """

    entrant: str
    counts: Counter[str]
    absolute: float
    relative: float
    moved: float
    cold: Times
    warm: Times
    cold_inside: Times
    warm_inside: Times
    iterations: float
    warm_iterations: float
    warm_right: float
    same: bool
    memory: int
    rough: float

    @property
    def asked(self) -> int:
        """Number of problems that the entrant can be asked."""
        return self.counts.total() - self.counts[REFUSED]

    @property
    def right(self) -> float:
        """Share of the problems asked that are solved and called so."""
        return self.counts[SOLVED] / self.asked if self.asked else np.nan


def summary(rows: Sequence[Judged], steps: dict[str, float]) -> Summary:
    """Sum up the rows of one entrant.

    steps : of each sequence, by family, the largest step of the proved answers.
    """
    counts = Counter(row.verdict for row in rows)
    claimed = [row for row in rows if row.verdict in (SOLVED, WRONG)]
    warm = [row.warm_right for row in rows if row.warm_right is not None]
    return Summary(
        rows[0].entrant, counts, _largest(row.absolute for row in claimed),
        _largest(row.relative for row in claimed), _largest(row.moved for row in claimed),
        _together(row.cold for row in rows), _together(row.warm for row in rows),
        _together(row.cold_inside for row in rows), _together(row.warm_inside for row in rows),
        _median(row.iterations for row in rows), _median(row.warm_iterations for row in rows),
        float(np.mean(warm)) if warm else np.nan, all(row.same is not False for row in rows),
        max(row.memory for row in rows), _largest(
            _step([row.x for row in own]) / steps[family]
            for family, own in by(rows, lambda row: row.family) if steps.get(family)))


def by(rows: Sequence[Judged], key: Callable[[Judged], str]) -> list[tuple[str, list[Judged]]]:
    """Return the rows in groups, in the order in which they first occur."""
    order = list(dict.fromkeys(map(key, rows)))
    grouped = groupby(sorted(rows, key=lambda row: order.index(key(row))), key)
    return [(name, list(own)) for name, own in grouped]


def _together(times: Iterable[tuple[int, ...]]) -> Times:
    return Times.of([time for own in times for time in own])


def _step(points: Sequence[Array | None]) -> float:
    """Return the largest distance of two successive points, NaN if one is missing."""
    steps = [float(np.linalg.norm(one - other))
             for one, other in pairwise(points)
             if one is not None and other is not None]
    return max(steps, default=np.nan)


def _largest(values: object) -> float:
    found = [value for value in values if not np.isnan(value)]  # type: ignore[attr-defined]
    return max(found, default=np.nan)


def _median(values: object) -> float:
    found = [value for value in values if value is not None]  # type: ignore[attr-defined]
    return float(np.median(found)) if found else np.nan


def profile(rows: Sequence[Judged], ratios: Array) -> dict[str, Array]:
    """Return the performance profile of each entrant (Dolan and More 2002) at ratios (k,).

    For each ratio the share of all problems that the entrant solves, calls solved, and needs no
    more than that ratio of the time of the fastest entrant that does. Problems that it cannot be
    asked count as not solved.
    """
    problems: dict[tuple[str, int], dict[str, float]] = {}
    for row in rows:
        own = problems.setdefault((row.family, row.problem), {})
        own[row.entrant] = float(np.median(row.cold)) if row.verdict == SOLVED else np.inf
    names = dict.fromkeys(row.entrant for row in rows)
    found = {}
    for name in names:
        ratio = np.array([own.get(name, np.inf) / min(own.values())
                          if np.isfinite(min(own.values())) else np.inf
                          for own in problems.values()])
        found[name] = np.array([(ratio <= most).mean() for most in ratios])
    return found


__all__ = ["RIGHT", "Summary", "Times", "by", "profile", "summary"]
