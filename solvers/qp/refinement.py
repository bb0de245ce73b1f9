"""From a nearly right answer of a program with rows to the exact one, with proof."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

from hierarchy.problem import Array

REFINEMENTS = 25  # bound on the steps from a backend's active set to the exact one
AT_ONCE = 10  # of them change all rows that are on the wrong side, the others one row at a time
EXACT = 1e-10  # relative tolerance of the optimality conditions
LITTLE = 1e-3  # rows broken by less are thought to hold at a nearby minimiser
LARGEST = 1e100  # of an entry: products of three are finite; nnls ends the process on infinite ones
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

    @staticmethod
    def none(n: int) -> Rows:
        """Return no rows, of n unknowns."""
        return Rows(np.empty((0, n)), np.empty(0), np.empty(0))

    def from_(self, x: Array) -> Rows:
        """Return the same rows on d, where the unknown is x + d."""
        value = self.A @ x
        return Rows(self.A, self.lower - value, self.upper - value)

    def seen(self, N: Array, rank_tolerance: float) -> Rows:
        """Return the same rows on z, where the unknown is N z; zeros where N leaves only those."""
        A = self.A @ N
        A[norm(A, axis=1) <= rank_tolerance * norm(self.A, axis=1)] = 0.0
        return Rows(A, self.lower, self.upper)

    def normalised(self) -> Rows:
        """Return the rows divided by their norms, without those of zeros."""
        size = norm(self.A, axis=1)
        rows, size = self.where(size > 0.0), size[size > 0.0]
        return Rows(rows.A / size[:, None], rows.lower / size, rows.upper / size)

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


def refined(z: Array, E: Array, e: Array, limits: Rows, kept: Rows, rank_tolerance: float
            ) -> tuple[Array, Array] | None:
    """Move from a backend's z to the exact minimiser for its active set, corrected where needed.

    Minimised is ||E z - e||^2 + ||excess of limits||^2 within the kept rows. Returns z, and +1,
    -1 or 0 for each limit that is violated above, below, or not. The result has passed the
    optimality conditions; None where no step did. Rows are of the order of one; what their singular
    values fall short of `rank_tolerance` is not moved.
    """
    active, excess = kept.sides(z, ACTIVE), limits.excess(z)
    broken = np.sign(excess) * (abs(excess) > ACTIVE)
    for step in range(REFINEMENTS):
        on, out = active != 0, broken != 0
        B, c = np.vstack([E, limits.A[out]]), np.concatenate([e, limits.at(broken)[out]])
        G, g = kept.A[on], kept.at(active)[on]
        step_on, free = _least(G, g - G @ z, rank_tolerance)
        new = z + step_on
        step_in, still = _least(B @ free, c - B @ new, rank_tolerance)
        new = _moved_inside(new + free @ step_in, free @ still,
                            kept.where(~on).and_(limits.where(~out)))
        if not np.isfinite(new).all():
            return None
        scale = EXACT * (1.0 + norm(new))
        over, excess = kept.excess(new), limits.excess(new)
        near = np.where(on, active, kept.sides(new, EXACT))
        gradient = E.T @ (e - E @ new) - limits.A.T @ excess
        multipliers, rest = _multipliers(near, kept.A, gradient)
        next_broken = np.sign(excess) * (abs(excess) > scale)
        if (abs(over) <= scale).all() and rest <= EXACT * (1.0 + norm(B.T @ c)):
            return np.asarray(new), np.asarray(next_broken)
        next_active = np.where(multipliers > 0.0, near, 0.0)
        next_active = np.where(abs(over) > scale, np.sign(over), next_active)
        if (next_active == active).all() and (next_broken == broken).all():
            return None
        if step >= AT_ONCE:  # all at once has cycled: only the first row that is to change
            next_active = _first_change(active, next_active)
            if (next_active != active).any():
                next_broken = broken
            else:
                next_broken = _first_change(broken, next_broken)
        active, broken = next_active, next_broken
    return None


def _least(M: Array, r: Array, tolerance: float) -> tuple[Array, Array]:
    """Return the shortest y that minimises ||M y - r||, and a basis of what does not change M y.

    Singular values up to `tolerance` are zero.
    """
    U, s, Vt = np.linalg.svd(M)
    rank = int((s > tolerance).sum())
    return Vt[:rank].T @ ((U.T[:rank] @ r) / s[:rank]), Vt[rank:].T


def _moved_inside(z: Array, D: Array, rows: Rows) -> Array:
    """Return the point z + D y nearest to z at which rows hold that it breaks by a little.

    The least-distance problem of Lawson and Hanson (1974, ch. 23), by non-negative least squares.
    Returns z where they hold, are broken by much, or cannot all hold.
    """
    off = float(abs(rows.excess(z)).max(initial=0.0))
    if not EXACT < off < LITTLE or not D.shape[1]:
        return z
    value, M = rows.A @ z, rows.A @ D
    up, low = np.isfinite(rows.upper), np.isfinite(rows.lower)
    G = np.vstack([-M[up], M[low]])
    g = np.concatenate([value[up] - rows.upper[up], rows.lower[low] - value[low]]) / off
    target = np.zeros(D.shape[1] + 1)
    target[-1] = 1.0
    u, rest = _non_negative(np.vstack([G.T, g]), target)
    if not ACTIVE < rest < np.inf:  # 1 / rest is the length of y: they hold nowhere, or far away
        return z
    return np.asarray(z + D @ (G.T @ u) * (off / (1.0 - g @ u)))


def _first_change(old: Array, new: Array) -> Array:
    """Return `old` with the first entry in which `new` differs."""
    changed = old.copy()
    for i in np.flatnonzero(old != new)[:1]:
        changed[i] = new[i]
    return changed


def _multipliers(side: Array, A: Array, gradient: Array) -> tuple[Array, float]:
    """Multipliers >= 0 of the rows with a side that balance a gradient best, and what they leave.

    Rows may be dependent: any multipliers that leave nothing prove the minimum.
    """
    found, on = np.zeros(len(side)), side != 0
    if not on.any():
        return found, float(norm(gradient))
    found[on], rest = _non_negative((side[on, None] * A[on]).T, gradient)
    return found, rest


def below_largest(*arrays: Array) -> bool:
    """Whether all entries are finite and smaller than LARGEST."""
    return all(bool((np.abs(array) < LARGEST).all()) for array in arrays)


def _non_negative(A: Array, b: Array) -> tuple[Array, float]:
    """Return u >= 0 that minimises ||A u - b||, and that norm; infinite where none was found."""
    from scipy.optimize import nnls  # type: ignore[import-untyped]

    if not below_largest(A, b):
        return np.zeros(A.shape[1]), np.inf
    try:
        u, rest = nnls(A, b)
    except RuntimeError:  # its bound on iterations
        return np.zeros(A.shape[1]), np.inf
    return np.asarray(u), float(rest)
