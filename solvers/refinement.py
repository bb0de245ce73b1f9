"""From a nearly right answer of a program with rows to the exact one, with proof."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

from hierarchy.problem import Array

REFINEMENTS = 20  # bound on the steps from a backend's active set to the exact one
EXACT = 1e-10  # relative tolerance of the optimality conditions
ACTIVE = 1e-6  # distance to its side, relative to 1 + |side|, at which a row is a candidate


@final
@dataclass(frozen=True)
class Rows:
    """Rows lower <= A z <= upper."""

    A: Array
    lower: Array
    upper: Array

    def excess(self, z: Array) -> Array:
        """How far A z is above `upper` (positive) or below `lower` (negative)."""
        value: Array = self.A @ z
        return value - np.clip(value, self.lower, self.upper)

    def seen(self, N: Array, x: Array) -> Rows:
        """Return the same rows on z, where the unknown is x + N z."""
        value = self.A @ x
        return Rows(self.A @ N, self.lower - value, self.upper - value)

    def where(self, chosen: NDArray[np.bool_]) -> Rows:
        """Return the rows chosen by a mask."""
        return Rows(self.A[chosen], self.lower[chosen], self.upper[chosen])

    def and_(self, other: Rows) -> Rows:
        """Return these rows and, below them, the others."""
        return Rows(np.vstack([self.A, other.A]), np.concatenate([self.lower, other.lower]),
                    np.concatenate([self.upper, other.upper]))

    def relaxed(self, slack: float) -> Rows:
        """Return the rows with both sides moved out by `slack`."""
        return Rows(self.A, self.lower - slack, self.upper + slack)

    def sides(self, z: Array, near: float) -> Array:
        """+1 where A z is near or above `upper`, -1 near or below `lower`, 0 elsewhere.

        near : how near, relative to 1 + |side|.
        """
        value = self.A @ z
        up, low = np.isfinite(self.upper), np.isfinite(self.lower)
        side = np.zeros(len(value))
        side[low] -= value[low] <= self.lower[low] + near * (1.0 + abs(self.lower[low]))
        side[up] += value[up] >= self.upper[up] - near * (1.0 + abs(self.upper[up]))
        return side

    def at(self, side: Array) -> Array:
        """Value of `upper` where side > 0, of `lower` elsewhere."""
        return np.where(side > 0, self.upper, self.lower)


def split(M: Array, norms: Array, rank_tolerance: float) -> tuple[Array, Array]:
    """Orthonormal bases of the row space (p, rank) of M (k, p) and of its null space (p, p - rank).

    norms (k,) of the rows before any projection: M is measured against them.
    """
    scaled = M / np.where(norms > 0.0, norms, 1.0)[:, None]
    _, s, Vt = np.linalg.svd(scaled, full_matrices=True)
    rank = int((s > rank_tolerance).sum())
    return Vt[:rank].T, Vt[rank:].T


def refined(z: Array, E: Array, e: Array, limits: Rows, kept: Rows) -> Array | None:
    """Move from a backend's z to the exact minimiser for its active set, corrected where needed.

    The result has passed the optimality conditions; None where no step did.
    """
    active, excess = kept.sides(z, ACTIVE), limits.excess(z)
    broken = np.sign(excess) * (abs(excess) > ACTIVE)
    for _ in range(REFINEMENTS):
        on, out = active != 0, broken != 0
        B, c = np.vstack([E, limits.A[out]]), np.concatenate([e, limits.at(broken)[out]])
        G, g = kept.A[on], kept.at(active)[on]
        new = z + np.linalg.pinv(G, rcond=EXACT) @ (g - G @ z)
        free = split(G, np.ones(len(G)), EXACT)[1]
        new = new + free @ np.linalg.lstsq(B @ free, c - B @ new, rcond=EXACT)[0]
        scale = EXACT * (1.0 + norm(new))
        over, excess = kept.excess(new), limits.excess(new)
        near = np.where(on, active, kept.sides(new, EXACT))
        multipliers, rest = _multipliers(near, kept.A, B.T @ (c - B @ new))
        next_broken = np.sign(excess) * (abs(excess) > scale)
        feasible = (abs(over) <= scale).all()
        if feasible and (next_broken == broken).all() and rest <= EXACT * (1.0 + norm(B.T @ c)):
            return np.asarray(new)
        next_active = np.where(multipliers > 0.0, near, 0.0)
        next_active = np.where(abs(over) > scale, np.sign(over), next_active)
        if (next_active == active).all() and (next_broken == broken).all():
            return None
        active, broken = next_active, next_broken
    return None


def _multipliers(side: Array, A: Array, gradient: Array) -> tuple[Array, float]:
    """Multipliers >= 0 of the rows with a side that balance a gradient best, and what they leave.

    Rows may be dependent: any multipliers that leave nothing prove the minimum.
    """
    from scipy.optimize import nnls  # type: ignore[import-untyped]

    found, on = np.zeros(len(side)), side != 0
    if not on.any():
        return found, float(norm(gradient))
    try:
        found[on], rest = nnls((side[on, None] * A[on]).T, gradient)
    except RuntimeError:  # its bound on iterations
        rest = np.inf
    return found, float(rest)
