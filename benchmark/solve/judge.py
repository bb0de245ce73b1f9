"""Raw rows judged: what a solver says counts for nothing, only its x.

Where the answer of a problem is proved, x is compared with the least violations; else with what
`certify` finds from the data alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from benchmark.process import CRASHED, HUNG
from benchmark.store import Row
from hierarchy.problem import Array, Hierarchy
from solvers.certificate import certify
from solvers.problems.files import Collection
from solvers.proof import Proof

RIGHT = 1e-6
"""Largest miss of an answer that is right: of each level, relative to |a| (1 + |x|)."""

SOLVED, WRONG = "solved", "called solved, wrong"
MODEST, FAILED = "called failed, right", "failed"
REFUSED, RAISED = "not asked", "raised"
ENDED = (RAISED, CRASHED, HUNG)


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
    solved; None without one. memory : growth of the process while it solved the file [KiB].
    """
    x, warm = _vector(row.get("x")), _vector(row.get("warm_x"))
    miss = miss_of(h, proof, x)
    warm_right = (None if warm is None else
                  bool(row["warm_solved"]) and miss_of(h, proof, warm).relative <= RIGHT)
    return {**row, **miss._asdict(), "verdict": _verdict(row, miss.relative), "x": x,
            "warm_right": warm_right, "moved": _moved(h, proof, x, _vector(row.get("without"))),
            "memory": (row.get("rss_kib") or 0) - (row.get("start_kib") or 0)}


def _verdict(row: Row, relative: float) -> str:
    if row.get("ended"):
        return HUNG if row["ended"] == HUNG else CRASHED
    if row.get("refused"):
        return REFUSED
    if row.get("raised"):
        return RAISED
    right = relative <= RIGHT
    if row["solved"]:
        return SOLVED if right else WRONG
    return MODEST if right else FAILED


def miss_of(h: Hierarchy, proof: Proof | None, x: Array | None) -> Miss:
    """Return by how much x misses the proved levels; the distance to the reference is one more."""
    if x is None:
        return Miss()
    if len(x) != h.n or not np.isfinite(x).all():
        return Miss(np.inf, np.inf, 0)
    if proof is None:
        found = certify(h, x, RIGHT)
        residuals = np.append(found.stationarity, found.nearest)
        return _largest(residuals, residuals)
    count = proof.judged
    beyond, sizes = h.violations(x)[:count] - proof.least[:count], _sizes(h, proof)[:count]
    if count > len(h.sizes):
        least = np.linalg.norm(proof.x - h.reference)
        beyond = np.append(beyond, np.linalg.norm(x - h.reference) - least)
        sizes = np.append(sizes, 1.0 + np.linalg.norm(proof.x))
    miss = np.maximum(beyond, 0.0)
    return _largest(miss, miss / sizes)


def _largest(absolute: Array, relative: Array) -> Miss:
    missed = np.flatnonzero(relative > RIGHT)
    return Miss(float(absolute.max()), float(relative.max()),
                int(missed[0]) if missed.size else -1)


def _moved(h: Hierarchy, proof: Proof | None, x: Array | None, without: Array | None) -> float:
    """Return the largest change of a violation above by the last level that has rows."""
    if x is None or without is None or not (np.isfinite(x).all() and np.isfinite(without).all()):
        return np.nan
    above = int(np.flatnonzero(h.sizes)[-1])
    count = above if proof is None else min(above, proof.judged)
    change = abs(h.violations(x) - h.violations(without))[:count] / _sizes(h, proof)[:count]
    return float(change.max(initial=0.0))


def _sizes(h: Hierarchy, proof: Proof | None) -> Array:
    """Return the norm of the largest row of each level times 1 + |x|: (L,), never zero."""
    norms = np.linalg.norm(h.A, axis=1)
    largest = np.array([norms[first:last].max(initial=0.0)
                        for first, last in zip(h.offsets[:-1], h.offsets[1:], strict=True)])
    reach = 1.0 + (float(np.linalg.norm(proof.x)) if proof is not None and proof.complete else 0.0)
    return np.where(largest > 0.0, largest, 1.0) * reach


def _vector(values: Any) -> Array | None:
    return None if values is None else np.array(values, dtype=np.float64)
