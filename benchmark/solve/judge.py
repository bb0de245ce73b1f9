"""Raw rows judged and summed up: what a solver says counts for nothing, only its x.

Where the answer of a problem is proved, x is compared with the least violations; else with what
`certify` finds from the data alone.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from benchmark.process import CRASHED, HUNG, SLOW
from benchmark.report import Row
from benchmark.timing import times_of
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import gathered
from solvers.certificate import certify
from solvers.problems.files import Collection
from solvers.proof import Proof

RIGHT = 1e-6
"""Largest miss of an answer that is right: of each level, relative to |a| (1 + |x|)."""

SOLVED, WRONG = "solved", "called solved, wrong"
MODEST, FAILED = "called failed, right", "failed"
REFUSED, RAISED = "not asked", "raised"
ENDED = (RAISED, CRASHED, HUNG)
_TIMES = {"cold": "", "warm": "warm_", "cold_inside": "inside_", "warm_inside": "warm_inside_"}


class Miss(NamedTuple):
    """Largest miss beyond the least of a level, and the first level missed by more than RIGHT.

    absolute in the unit of its rows, relative to |a| (1 + |x|) with the largest row of the level;
    NaN without x. level is L for the distance to the reference, or -1.
    """

    absolute: float = np.nan
    relative: float = np.nan
    level: int = -1


def judge(rows: Iterable[Row], collections: Mapping[str, Collection]) -> list[Row]:
    """Judge the rows that belong to problems with answers; see `judged`.

    collections : by SHA-256 of the problems. Rows of others, and of problems of which nothing is
        proved, are left out.
    """
    found = []
    for row in rows:
        one = collections.get(row["sha256"])
        if one is not None and one.answers is not None:
            proof = one.answers[row["problem"]]
            if proof.judged:
                found.append(judged(row, one.problems[row["problem"]], proof))
    return found


def judged(row: Row, h: Hierarchy, proof: Proof | None) -> Row:
    """Return a row with x and warm_x as arrays, the fields of its `Miss`, and

    verdict : one of the texts above. moved : how far the last level moved the violation of one
    above, relative; NaN if not known. warm_right : whether the warm answer is right and called
    solved; None without one. memory : growth of the process while it solved the file [KiB], or NaN.
    """
    x, warm, without = (None if row.get(key) is None else np.array(row[key], dtype=np.float64)
                        for key in ("x", "warm_x", "without"))
    miss = miss_of(h, proof, x)
    warm_right = (None if warm is None else
                  bool(row["warm_solved"]) and miss_of(h, proof, warm).relative <= RIGHT)
    return {**row, **miss._asdict(), "verdict": _verdict(row, miss.relative), "x": x,
            "warm_right": warm_right, "moved": _moved(h, proof, x, without),
            "memory": (row.get("rss_kib") or np.nan) - (row.get("start_kib") or 0)}


def _verdict(row: Row, relative: float) -> str:
    if row.get("ended"):
        return HUNG if row["ended"] == HUNG else CRASHED
    if row.get("refused") or row.get("raised"):
        return REFUSED if row.get("refused") else RAISED
    right = relative <= RIGHT
    return (SOLVED if right else WRONG) if row["solved"] else (MODEST if right else FAILED)


def miss_of(h: Hierarchy, proof: Proof | None, x: Array | None) -> Miss:
    """Return by how much x misses the proved levels; the distance to the reference is one more."""
    if x is None:
        return Miss()
    if not _is_answer(h, x):
        return Miss(np.inf, np.inf, 0)
    if proof is None:
        found = certify(h, x, RIGHT)
        miss = relative = np.append(found.stationarity, found.nearest)
    else:
        count = proof.judged
        beyond, sizes = h.violations(x)[:count] - proof.least[:count], _sizes(h, proof)[:count]
        if count > len(h.sizes):
            least = np.linalg.norm(proof.x - h.reference)
            beyond = np.append(beyond, np.linalg.norm(x - h.reference) - least)
            sizes = np.append(sizes, 1.0 + np.linalg.norm(proof.x))
        miss = np.maximum(beyond, 0.0)
        relative = miss / sizes
    missed = np.flatnonzero(relative > RIGHT)
    return Miss(float(miss.max(initial=0.0)), float(relative.max(initial=0.0)),
                int(missed[0]) if missed.size else -1)


def _moved(h: Hierarchy, proof: Proof | None, x: Array | None, without: Array | None) -> float:
    """Return the largest change of a violation above by the last level that has rows."""
    if x is None or without is None or not (_is_answer(h, x) and _is_answer(h, without)):
        return np.nan
    above = int(np.flatnonzero(h.sizes)[-1])
    count = above if proof is None else min(above, proof.judged)
    change = abs(h.violations(x) - h.violations(without))[:count] / _sizes(h, proof)[:count]
    return float(change.max(initial=0.0))


def _is_answer(h: Hierarchy, x: Array) -> bool:
    return x.shape == (h.n,) and bool(np.isfinite(x).all())


def _sizes(h: Hierarchy, proof: Proof | None) -> Array:
    """Return the norm of the largest row of each level times 1 + |x|: (L,), never zero."""
    largest = np.array([np.linalg.norm(A, axis=1).max(initial=0.0) for A, _, _ in h.levels()])
    reach = 1.0 + (float(np.linalg.norm(proof.x)) if proof is not None and proof.complete else 0.0)
    return np.where(largest > 0.0, largest, 1.0) * reach


def summary(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> Row:
    """Sum up the rows of one entrant.

    asked, right (share), wrong, modest, failed, ended, answered : problems by verdict. slow : not
    asked because others took too long. absolute, relative, moved : largest of those called solved.
    Times, also warm and inside. iterations, warm_iterations : medians. warm_right : share. same :
    whether all second solves gave the same bits. memory [KiB]. rough : along sequences, the largest
    step of x beside that of the proved answers. NaN : unknown.

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
        "slow": sum(row.get("refused") == SLOW for row in rows),
        **{key: over(np.max, (row[key] for row in claimed))
           for key in ("absolute", "relative", "moved")},
        "iterations": over(np.median, (row.get("iterations") for row in rows)),
        "warm_iterations": over(np.median, (row.get("warm_iterations") for row in rows)),
        "warm_right": over(np.mean, (row["warm_right"] for row in rows)),
        "same": all(row.get("same") is not False for row in rows),
        "memory_mb": over(np.max, (row["memory"] for row in rows)) / 1024,
        "rough": over(np.max, rough)}
    for key, prefix in _TIMES.items():
        found |= times_of([time for row in rows for time in row.get(f"{key}_ns") or ()], prefix)
    return found


def by(rows: Iterable[Row], key: str) -> list[tuple[str, list[Row]]]:
    """Return the rows in groups, in the order in which they first occur."""
    return list(gathered((row[key], row) for row in rows).items())


def summaries(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> list[Row]:
    """Return the summary of each entrant."""
    return [summary(own, steps) for _, own in by(rows, "entrant")]


def cells(rows: Sequence[Row], steps: Mapping[str, float] | None = None) -> list[Row]:
    """Return the summary of each entrant in each family."""
    return [{"family": family, **one} for family, some in by(rows, "family")
            for one in summaries(some, steps)]


def steps_of(collections: Mapping[str, Collection]) -> dict[str, float]:
    """Return the largest step of the proved answers along each sequence, by family."""
    return {name: _step([proof.x if proof.complete else None for proof in one.answers or ()])
            for name, one in collections.items() if one.head.sequence}


def _step(points: Sequence[Array | None]) -> float:
    """Return the largest distance of two successive finite points of one shape; NaN without."""
    known = [x if x is not None and np.isfinite(x).all() else np.empty(0) for x in points]
    return max((float(np.linalg.norm(one - other)) for one, other in pairwise(known)
                if one.size and one.shape == other.shape), default=np.nan)


def profile(rows: Sequence[Row], ratios: Array) -> dict[str, Array]:
    """Return the performance profile of each entrant (Dolan and More 2002) at ratios (k,).

    For each ratio the share of all problems that the entrant solves, calls solved, and needs no
    more than that ratio of the time of the fastest entrant that does. Problems that it cannot be
    asked count as not solved.
    """
    problems: dict[tuple[str, int], dict[str, float]] = {}
    for row in rows:
        own = problems.setdefault((row["family"], row["problem"]), {})
        if row["verdict"] == SOLVED:
            own[row["entrant"]] = float(np.median(row["cold_ns"]))
    return {name: _shares([own[name] / min(own.values()) if name in own else np.inf
                           for own in problems.values()], ratios)
            for name, _ in by(rows, "entrant")}


def right_within(rows: Sequence[Row], thresholds: Array) -> dict[str, Array]:
    """Return the share of the problems asked that an entrant solves, were `RIGHT` a threshold.

    thresholds : (k,).
    """
    return {name: _shares([row["relative"] if row.get("solved") else np.inf for row in own
                           if row["verdict"] != REFUSED], thresholds)
            for name, own in by(rows, "entrant")
            if any(row["verdict"] != REFUSED for row in own)}


def _shares(values: Sequence[float], most: Array) -> Array:
    """Return which share of values is at most each of `most` (k,)."""
    return np.asarray(np.mean(np.array(values)[:, None] <= most, axis=0))


def over(reduce: Callable[..., Any], values: Iterable[float | None]) -> float:
    """Return what is made of the values that are known, NaN of none."""
    known = [value for value in values if value is not None and not np.isnan(value)]
    return float(reduce(known)) if known else np.nan
