"""Raw rows judged: what an entrant says counts for nothing, only its x and the proved answers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from hierarchy.problem import Array, Hierarchy
from scenarios.bench.open.store import RawRow
from solvers.problems.files import Collection
from solvers.proof import Proof

RIGHT = 1e-6
"""Largest miss of an answer that is right: of each level, relative to |a| (1 + |x|)."""

SOLVED, WRONG = "solved", "called solved, wrong"
MODEST, FAILED = "called failed, right", "failed"
REFUSED, RAISED, CRASHED, HUNG = "not asked", "raised", "crashed", "time limit"


@final
@dataclass(frozen=True)
class Judged:
    """One entrant on one problem; the first six fields are those of the raw row.

    verdict : one of the eight texts above.
    absolute, relative : largest miss beyond the least of a level, in the unit of its rows, and
        relative to |a| (1 + |x|) with the largest row of the level; NaN without x.
    level : the first missed by more than RIGHT; L for the distance to the reference, or -1.
    moved : how far the last level moved the violation of one above, relative; NaN if not known.
    cold, warm : times of calls from Python [ns]; cold_inside, warm_inside : those that a compiled
        package took itself. iterations, warm_iterations : or None.
    warm_right : whether the warm answer is right and called solved; None without one.
    same : whether a second solve gave the same bits; None without one.
    memory : growth of the process while it solved the file [KiB]. x : (n,) or None.
    yardstick : time of a fixed piece of work before the file [ns], 0 if not known.
    """

    entrant: str
    version: str
    family: str
    half: str
    seed: int
    problem: int
    verdict: str
    absolute: float
    relative: float
    level: int
    moved: float
    cold: tuple[int, ...]
    warm: tuple[int, ...]
    cold_inside: tuple[int, ...]
    warm_inside: tuple[int, ...]
    iterations: int | None
    warm_iterations: int | None
    warm_right: bool | None
    same: bool | None
    memory: int
    yardstick: int
    x: Array | None

    @property
    def right(self) -> bool:
        """Whether the answer is right, whatever the entrant calls it."""
        return self.verdict in (SOLVED, MODEST)


def judge(rows: Iterable[RawRow], collections: Mapping[str, Collection]) -> list[Judged]:
    """Judge the rows that belong to problems with answers.

    collections : by SHA-256 of the problems. Rows of others, and of problems of which nothing is
        proved, are left out.
    """
    found = []
    for row in rows:
        collection = collections.get(row["sha256"])
        if collection is None or collection.answers is None:
            continue
        proof = collection.answers[row["problem"]]
        if proof.judged:
            found.append(_judged(row, collection.problems[row["problem"]], proof))
    return found


def _judged(row: RawRow, h: Hierarchy, proof: Proof) -> Judged:
    x, warm_x = _vector(row["x"]), _vector(row["warm_x"])
    absolute, relative, level = _miss(h, proof, x)
    warm_right = (None if warm_x is None
                  else bool(row["warm_solved"]) and _miss(h, proof, warm_x)[1] <= RIGHT)
    return Judged(
        row["entrant"], row["version"], row["family"], row["half"], row["seed"], row["problem"],
        _verdict(row, relative), absolute, relative, level,
        _moved(h, proof, x, _vector(row["without"])), _times(row["cold_ns"]),
        _times(row["warm_ns"]), _times(row["cold_inside_ns"]), _times(row["warm_inside_ns"]),
        row["iterations"], row["warm_iterations"], warm_right, row["same"],
        (row["rss_kib"] or 0) - (row["start_kib"] or 0), row["yardstick_ns"] or 0, x)


def _verdict(row: RawRow, relative: float) -> str:
    if row["ended"]:
        return HUNG if row["ended"] == HUNG else CRASHED
    if row["refused"]:
        return REFUSED
    if row["raised"]:
        return RAISED
    right = relative <= RIGHT
    if row["solved"]:
        return SOLVED if right else WRONG
    return MODEST if right else FAILED


def _miss(h: Hierarchy, proof: Proof, x: Array | None) -> tuple[float, float, int]:
    """Return the largest miss of the proved levels, absolute and relative, and the first missed.

    The distance to the reference counts as one more level.
    """
    if x is None:
        return np.nan, np.nan, -1
    if len(x) != h.n or not np.isfinite(x).all():
        return np.inf, np.inf, 0
    count = proof.judged
    beyond, sizes = h.violations(x)[:count] - proof.least[:count], _sizes(h, proof)[:count]
    if count > len(h.sizes):
        least = np.linalg.norm(proof.x - h.reference)
        beyond = np.append(beyond, np.linalg.norm(x - h.reference) - least)
        sizes = np.append(sizes, 1.0 + np.linalg.norm(proof.x))
    miss = np.maximum(beyond, 0.0)
    missed = np.flatnonzero(miss / sizes > RIGHT)
    return (float(miss.max()), float((miss / sizes).max()),
            int(missed[0]) if missed.size else -1)


def _moved(h: Hierarchy, proof: Proof, x: Array | None, without: Array | None) -> float:
    """Return the largest change of a violation above by the last level that has rows."""
    if x is None or without is None or not (np.isfinite(x).all() and np.isfinite(without).all()):
        return np.nan
    above = int(np.flatnonzero(h.sizes)[-1])
    count = min(above, proof.judged)
    change = abs(h.violations(x) - h.violations(without))[:count] / _sizes(h, proof)[:count]
    return float(change.max(initial=0.0))


def _sizes(h: Hierarchy, proof: Proof) -> Array:
    """Return the norm of the largest row of each level times 1 + |x|: (L,), never zero."""
    norms = np.linalg.norm(h.A, axis=1)
    largest = np.array([norms[first:last].max(initial=0.0)
                        for first, last in zip(h.offsets[:-1], h.offsets[1:], strict=True)])
    reach = 1.0 + (float(np.linalg.norm(proof.x)) if proof.complete else 0.0)
    return np.where(largest > 0.0, largest, 1.0) * reach


def _times(values: list[int] | None) -> tuple[int, ...]:
    return tuple(values or ())


def _vector(values: list[float] | None) -> Array | None:
    return None if values is None else np.array(values, dtype=np.float64)
