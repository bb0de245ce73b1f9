"""From the approximate answer of a quadratic program to the exact one, verified."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

from hierarchy.problem import Array

REFINEMENTS = 60  # most steps from a backend's active set to the exact one
AT_ONCE = 10  # steps that change all rows on the wrong side, before as many that change one
MOST_HELD = 0.8  # share of the active rows: if more are at their side, the others alone leave
EXACT = 1e-10  # relative tolerance of the optimality conditions
LITTLE = 1e-3  # rows violated by less are assumed to hold at a nearby minimiser
LARGEST = 1e50  # entry: sums of products of four stay finite; beyond, backends run for minutes
ROUNDING = 1e-15  # entry of a row over its norm: rounding
ROUGH = 1e-3  # weight, relative to a goal, of what the goal cannot see: its active rows are seen
ACTIVE = 1e-6  # distance to its side, relative to 1 + |side|, at which a row is a candidate


class Rows(NamedTuple):
    """Rows lower <= A z <= upper."""

    A: Array
    lower: Array
    upper: Array

    def excess(self, z: Array) -> Array:
        """Amount by which A z is above `upper` (positive) or below `lower` (negative)."""
        value: Array = self.A @ z
        return value - np.clip(value, self.lower, self.upper)

    @staticmethod
    def none(n: int) -> Rows:
        """Return no rows, of n unknowns."""
        return Rows(np.empty((0, n)), np.empty(0), np.empty(0))

    def from_(self, x: Array) -> Rows:
        """Return the same rows for the unknown d of x + d."""
        value = self.A @ x
        return Rows(self.A, self.lower - value, self.upper - value)

    def seen(self, N: Array, rank_tolerance: float) -> Rows:
        """Return the same rows for the unknown z of N z, with zeros for rows dependent on N."""
        A, sizes = self.A @ N, lengths(self.A)
        A[lengths(A) <= rank_tolerance * sizes] = 0.0
        A[abs(A) <= ROUNDING * sizes[:, None]] = 0.0
        return Rows(A, self.lower, self.upper)

    def normalised(self) -> Rows:
        """Return the rows divided by their norms, without rows of zeros."""
        size = lengths(self.A)
        rows, size = self.where(size > 0.0), size[size > 0.0]
        return Rows(rows.A / size[:, None], rows.lower / size, rows.upper / size)

    def where(self, chosen: NDArray[np.bool_]) -> Rows:
        """Return the rows chosen by a mask."""
        if chosen.all():
            return self
        return Rows(*(part[chosen] for part in self))

    def sided(self) -> Rows:
        """Return the rows with a finite side."""
        return self.where(np.isfinite(self.lower) | np.isfinite(self.upper))

    def and_(self, other: Rows) -> Rows:
        """Return these rows with the other rows below them."""
        return Rows(*map(np.concatenate, zip(self, other, strict=True)))

    def sides(self, z: Array, near: float) -> Array:
        """Return +1 where A z is near or above `upper`, -1 near or below `lower`, else 0.

        near : distance that counts as near, relative to 1 + |side|.
        """
        value, (low, up) = self.A @ z, near * (1.0 + np.abs([self.lower, self.upper]))
        with np.errstate(invalid="ignore"):  # inf - inf is NaN, which nothing is near
            return np.asarray(1.0 * (value >= self.upper - up) - (value <= self.lower + low))

    def at(self, side: Array) -> Array:
        """Return `upper` where side > 0, `lower` elsewhere."""
        return np.where(side > 0, self.upper, self.lower)


def lengths(A: Array) -> Array:
    """Return the norms of rows, in less than half the time of `numpy.linalg.norm`."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", A, A)))


def split(M: Array, norms: Array, rank_tolerance: float) -> tuple[Array, Array]:
    """Return orthonormal bases of M's (k, p) row space (p, rank) and null space (p, p - rank).

    norms : (k,) of the rows before any projection, relative to which M is judged.
    """
    if not len(M):
        return np.empty((M.shape[1], 0)), np.eye(M.shape[1])
    scaled = M / np.where(norms > 0.0, norms, 1.0)[:, None]
    _, s, Vt = np.linalg.svd(scaled, full_matrices=True)
    rank = int((s > rank_tolerance).sum())
    return Vt[:rank].T, Vt[rank:].T


def least(M: Array, r: Array, norms: Array, rank_tolerance: float) -> tuple[Array, Array]:
    """Return the shortest y that minimises ||M y - r||, and a basis of the null space of M.

    Rank is that of rows relative to their `norms`. Heavy rows come first and columns are pivoted,
    so that the error of each row is relative to its own norm (Cox, Higham 1998).
    """
    from scipy.linalg.lapack import dgelsy

    own, free = split(M, norms, rank_tolerance)
    order, rank = np.argsort(-lengths(M), kind="stable"), own.shape[1]
    if rank == 0:
        return np.zeros(len(own)), free
    y = dgelsy((M @ own)[order], r[order], np.zeros(rank, np.int32), 0.0, 4 * rank + 1)[1]
    return own @ y[:rank], free


def refined(z: Array, E: Array, e: Array, limits: Rows, kept: Rows, rank_tolerance: float
            ) -> tuple[Array, Array] | None:
    """Move from a backend's z to the exact minimiser, repairing the active set where necessary.

    Minimises ||E z - e||^2 + ||excess of limits||^2 within the kept rows. Returns z, and +1, -1 or
    0 for each limit that is violated above, below, or not. The result satisfies the optimality
    conditions; None if no step did, from a projection of z either. Rows are of order one;
    directions with singular values up to `rank_tolerance` do not move.
    """
    program = _Refinement(E, e, limits, kept, rank_tolerance)
    return program.solved_from(z) or program.solved_from(program.projected(z))


class _Refinement(NamedTuple):
    """The program of `refined`; active (kept,) and broken (limits,) are sides, see `Rows.sides`."""

    E: Array
    e: Array
    limits: Rows
    kept: Rows
    rank_tolerance: float

    def solved_from(self, z: Array) -> tuple[Array, Array] | None:
        """Return what `refined` returns, from the active set at z."""
        kept, limits, k = self.kept, self.limits, len(self.kept.A)
        excess = limits.excess(z)
        sides = np.concatenate([kept.sides(z, ACTIVE), np.sign(excess) * (abs(excess) > ACTIVE)])
        for step in range(REFINEMENTS):
            new = self.minimiser(z, sides[:k], sides[k:])
            if not np.isfinite(new).all():
                return None
            optimal, wanted = self.judged(new, sides[:k], sides[k:])
            if optimal:
                return new, wanted[k:]
            changed = np.flatnonzero(wanted != sides)
            if not len(changed):
                return None
            if step // AT_ONCE % 2:  # changing all rows at once has cycled
                changed = changed[step // 2 % len(changed), None]
            sides[changed] = wanted[changed]
        return None

    def minimiser(self, z: Array, active: Array, broken: Array) -> Array:
        """Return the minimiser nearest to z that holds the active rows at their sides."""
        on, out = active != 0, broken != 0
        B, c = self._acting(broken)
        G, g = self.kept.A[on], self.kept.at(active)[on]
        step_on, free = least(G, g - G @ z, lengths(G), self.rank_tolerance)
        new = z + step_on
        step_in, unseen = least(B @ free, c - B @ new, lengths(B), self.rank_tolerance)
        others = self.kept.where(~on).and_(self.limits.where(~out))
        return _moved_inside(new + free @ step_in, free @ unseen, others)

    def projected(self, z: Array) -> Array:
        """Return the minimiser to some digits, as a projection onto the kept rows.

        It is nearest, as E measures distances, to the minimiser without rows; along what E does
        not see, next to z.
        """
        U, s, Vt = np.linalg.svd(self.E)
        largest = s.max(initial=0.0) or 1.0
        rank, k = int((s > ROUGH * largest).sum()), self.limits.lower.size
        stretch = np.full(len(z), 1.0 / (ROUGH * largest))
        stretch[:rank] = 1.0 / s[:rank]
        D = Vt.T * stretch
        centre = z + D[:, :rank] @ (U.T @ (self.e - self.E @ z))[:rank]
        on, out = self.kept.from_(centre), self.limits.from_(centre)
        M = np.block([[on.A @ D, np.zeros((on.lower.size, k))], [out.A @ D, -np.eye(k)]])
        y = _shortest(Rows(M, np.concatenate([on.lower, out.lower]),
                           np.concatenate([on.upper, out.upper])))
        return np.asarray(centre + D @ y[:len(z)])

    def judged(self, z: Array, active: Array, broken: Array) -> tuple[bool, Array]:
        """Return whether z is optimal, and the sides that its rows and multipliers suggest."""
        scale = EXACT * (1.0 + norm(z))
        over, excess = self.kept.excess(z), self.limits.excess(z)
        acting, side = active != 0, self.kept.at(active)
        held = acting & (abs(self.kept.A @ z - side) <= scale + EXACT * abs(side))
        near = np.where(held, active, self.kept.sides(z, EXACT))
        forces, settled = self._settled(z, near, broken, excess)
        multipliers, balanced = self._balanced(z, near, excess)
        next_active = np.where((multipliers > 0.0) | (forces > 0.0), near, 0.0)
        if MOST_HELD * acting.sum() < held.sum() < acting.sum():
            next_active = near
        next_active = np.where(abs(over) > scale, np.sign(over), next_active)
        sizes = lengths(self.limits.A)
        moves = sizes > 0.0
        next_broken = np.sign(excess) * (abs(excess) > scale * np.where(moves, sizes, 1.0))
        left_out = (next_broken != 0) & (next_broken != broken) & moves
        optimal = (abs(over) <= scale).all() and not left_out.any() and settled and balanced
        return bool(optimal), np.concatenate([next_active, next_broken])

    def _settled(self, z: Array, near: Array, broken: Array, excess: Array) -> tuple[Array, bool]:
        """Return multipliers of the kept rows, and whether the gradient is theirs."""
        gradient = self.E.T @ (self.e - self.E @ z) - self.limits.A.T @ excess
        forces, on, (B, c) = np.zeros(len(near)), near != 0, self._acting(broken)
        forces[on], rest = _non_negative((near[on, None] * self.kept.A[on]).T, gradient)
        return forces, bool(rest <= EXACT * (1.0 + norm(B.T @ c)))

    def _balanced(self, z: Array, near: Array, excess: Array) -> tuple[Array, bool]:
        """Return multipliers of the kept rows, and whether missed rows balance, however small.

        Next to rows of another scale their forces are lost in `_settled`. Rows that are met may
        hold them like constraints.
        """
        M = np.vstack([self.E, self.limits.A])
        r, sizes = np.concatenate([self.e - self.E @ z, -excess]), lengths(M)
        missed = abs(r) > EXACT * sizes * (1.0 + norm(z))
        missed &= sizes > 0.0
        if not missed.any():
            return abs(near), True
        met, k = ~missed, len(self.E)
        side = self.limits.sides(z, EXACT)[met[k:], None]
        holding = np.vstack([near[:, None] * self.kept.A, side * self.limits.A[met[k:]],
                             self.E[met[:k]], -self.E[met[:k]]])
        length = lengths(holding)
        u, rest = _non_negative((holding / np.where(length > 0.0, length, 1.0)[:, None]).T,
                                M[missed].T @ r[missed])
        return u[:len(near)], rest <= ACTIVE * float(sizes[missed] @ abs(r[missed]))

    def _acting(self, broken: Array) -> tuple[Array, Array]:
        """Return B and c: the goal and the broken limits are ||B z - c||^2."""
        out = broken != 0
        return (np.vstack([self.E, self.limits.A[out]]),
                np.concatenate([self.e, self.limits.at(broken)[out]]))


def _moved_inside(z: Array, D: Array, rows: Rows) -> Array:
    """Return the point z + D y nearest to z at which slightly violated rows hold.

    Returns z if the rows hold, are violated by more than a little, or cannot all hold.
    """
    off = float(abs(rows.excess(z)).max(initial=0.0))
    if not ROUNDING < off < LITTLE or not D.shape[1]:
        return z
    shift = rows.from_(z)
    return np.asarray(z + D @ _shortest(Rows(rows.A @ D, shift.lower, shift.upper)))


def _shortest(rows: Rows) -> Array:
    """Return the shortest y within the rows; zeros if none was found.

    The least-distance problem of Lawson and Hanson (1974, ch. 23), by non-negative least squares.
    """
    up, low = np.isfinite(rows.upper), np.isfinite(rows.lower)
    off = float(abs(np.clip(0.0, rows.lower, rows.upper)).max(initial=0.0)) or 1.0
    G = np.vstack([-rows.A[up], rows.A[low]])
    g = np.concatenate([-rows.upper[up], rows.lower[low]]) / off
    target = np.zeros(G.shape[1] + 1)
    target[-1] = 1.0
    u, rest = _non_negative(np.vstack([G.T, g]), target)
    if not ACTIVE < rest < np.inf:  # 1 / rest is the length of y: no point, or none nearby
        return np.zeros(G.shape[1])
    return np.asarray(G.T @ u * (off / (1.0 - g @ u)))


def below_largest(*arrays: Array, scale: float = 1.0) -> bool:
    """Whether all entries are finite and smaller than LARGEST times `scale`."""
    return all(bool((np.abs(array) < LARGEST * scale).all()) for array in arrays)


def _non_negative(A: Array, b: Array) -> tuple[Array, float]:
    """Return u >= 0 that minimises ||A u - b||, and that norm; infinite if none was found."""
    from scipy.optimize import nnls

    if not A.shape[1]:  # on which it may end the process
        return np.zeros(0), float(norm(b))
    if not below_largest(A, b):
        return np.zeros(A.shape[1]), np.inf
    try:
        u, rest = nnls(A, b)
    except RuntimeError:  # its iteration limit
        return np.zeros(A.shape[1]), np.inf
    return np.asarray(u), float(rest)
