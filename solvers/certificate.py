"""Is this x the answer of a hierarchy? Judged from the data alone, trusting no solver.

Let w_k be the violation of level k at x, and F_(k-1) all y at which every row of the levels above
has the violation that it has at x: an equality and a violated row keep their value, the others stay
inside their sides. F_(k-1) is convex, so x is optimal for level k exactly when the gradient
A_k^T w_k is balanced by the normal cone of F_(k-1) at x,

    -A_k^T w_k in span{a_i : equality or violated} + cone{+a_i : on upper, -a_i : on lower},

with rows a_i of the levels above (Karush-Kuhn-Tucker). x is the answer when that holds for every
level, and for x - reference with the rows of all levels. The projection d of -A_k^T w_k on the
polar of that cone, found with a QR factorisation for the span and non-negative least squares for
the cone, is the feasible direction of steepest descent (Moreau); |d|^2 / |A_k d| is what the
violation loses along it to first order. This is the residual: zero at the answer, of the order of
the error in A_k x elsewhere, at most |w_k| always. It is a lower bound: where rows of a level are
nearly parallel, more could be gained than the steepest direction shows, and the level named may be
one below the level at fault.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike, NDArray

from hierarchy.problem import Array, Hierarchy

TOLERANCE = 1e-8
"""Largest relative residual of an answer, and distance to a side, relative to 1 + |x|, up to which
a row is on it."""
PARALLEL = 1e-9  # a unit row with no more than this outside a span lies in it
_FLAT = 1e-4     # curvature of a level along d, relative to its largest row, not told from zero
_ROUNDING = 64 * float(np.finfo(float).eps)

Mask = NDArray[np.bool_]


@final
@dataclass(frozen=True)
class Certificate:
    """What was found at one x.

    Attributes
    ----------
    violations : (L,) Euclidean norm of each level's violation.
    stationarity : (L,) how much of it could be removed without touching the levels above, to first
        order, relative to |A_k| (1 + |x|), where |A_k| is the norm of the rows that are equalities
        or violated.
    nearest : length of the step towards the reference that no level would feel, relative to
        1 + |x|.
    tolerance : what residuals were compared with.
    names : of the levels.
    """

    violations: Array
    stationarity: Array
    nearest: float
    tolerance: float
    names: tuple[str, ...]

    @property
    def level(self) -> int | None:
        """Index of the first level that is not optimal, or None."""
        failing = np.flatnonzero(~(self.stationarity <= self.tolerance))
        return int(failing[0]) if failing.size else None

    @property
    def optimal(self) -> bool:
        """Whether every level is as small as the levels above allow."""
        return self.level is None

    @property
    def is_nearest(self) -> bool:
        """Whether no step towards the reference is left."""
        return self.nearest <= self.tolerance

    @property
    def certified(self) -> bool:
        """Whether x is the answer: optimal, and of all optimal x the nearest to the reference."""
        return self.optimal and self.is_nearest

    def __str__(self) -> str:
        if self.level is not None:
            return (f"not optimal at {self.names[self.level]}: residual "
                    f"{self.stationarity[self.level]:.1e}, tolerance {self.tolerance:.0e}")
        if not self.is_nearest:
            return (f"optimal at every level, but not nearest to the reference: residual "
                    f"{self.nearest:.1e}, tolerance {self.tolerance:.0e}")
        worst = max([self.nearest, *self.stationarity])
        return (f"certified: optimal at every level and nearest to the reference, to "
                f"{worst:.1e}")


def certify(h: Hierarchy, x: ArrayLike, tolerance: float = TOLERANCE) -> Certificate:
    """Judge whether x (n,) is the answer of h, level by level; see the module's text.

    A row's side counts as reached when x is within `tolerance` (1 + |x|) of its hyperplane, and as
    violated beyond. Within, the row may push to its own side only: exact where it is satisfied, and
    where it is violated by so little, its own level holds it there. Rows that are dependent up to
    an angle of 1e-9 count as dependent, and what rounding alone can leave of a gradient counts as
    zero. An x, or data, that is not finite is never certified.

    Raises
    ------
    HierarchyError : x has the wrong shape.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        slack = h.slacks(x)
        x = np.asarray(x, dtype=np.float64)
        size = np.sqrt(np.einsum("ij,ij->i", h.A, h.A))
        reach = 1.0 + float(np.sqrt(x @ x))
        gap = x - h.reference
        sane = np.isfinite([reach, size @ size, gap @ gap, slack @ slack]).all()
    if not sane or np.isnan(h.lower).any() or np.isnan(h.upper).any():
        unknown = np.full(len(h.sizes), np.inf)
        return Certificate(unknown, unknown.copy(), np.inf, tolerance, h.names)
    pairs = list(zip(h.offsets[:-1].tolist(), h.offsets[1:].tolist(), strict=True))
    violations = np.array([np.sqrt(slack[i:j] @ slack[i:j]) for i, j in pairs])
    stationarity = np.zeros(len(pairs))
    held, unit = _held(h, x, slack, size, reach * tolerance)
    cone = _NormalCone(h.n)
    for k, (i, j) in enumerate(pairs):
        if cone.rank == h.n:
            break
        if slack[i:j].any():
            stationarity[k] = _residual(cone, h, slack, size, slice(i, j)) / reach
        cone.add(unit[i:j], *(mask[i:j] for mask in held))
    d = cone.descent(gap, float(norm(gap)))
    return Certificate(violations, stationarity, float(norm(d)) / reach, tolerance, h.names)


def _held(h: Hierarchy, x: Array, slack: Array, size: Array,
          band: float) -> tuple[tuple[Mask, Mask, Mask], Array]:
    """Rows that must keep their value, that are on their upper and lower side; unit rows (m, n)."""
    near = band * size
    value = h.A @ x
    fixed = (h.lower == h.upper) | (np.abs(slack) > near)
    upper = ~fixed & (value >= h.upper - near)
    lower = ~fixed & (value <= h.lower + near)
    return (fixed, upper, lower), h.A / np.where(size > 0.0, size, 1.0)[:, None]


def _residual(cone: _NormalCone, h: Hierarchy, slack: Array, size: Array, rows: slice) -> float:
    """What the violation of one level can still lose, relative to the norm of its rows in play."""
    play = (slack[rows] != 0.0) | (h.lower[rows] == h.upper[rows])
    largest = float(size[rows][play].max())
    if largest == 0.0:
        return 0.0
    A, w = h.A[rows][play] / largest, slack[rows][play] / largest
    length = size[rows][play] / largest
    d = cone.descent(A.T @ w, float(length @ np.abs(w)))
    steep = float(d @ d)
    if steep == 0.0:
        return 0.0
    curved = max(float(norm(A @ d)), _FLAT * np.sqrt(steep))
    return float(min(steep / curved, norm(w)) / norm(length))


class _NormalCone:
    """Normal cone of F_k at x: a span with orthonormal basis Q (n, rank), and signed unit rows."""

    def __init__(self, n: int) -> None:
        self.Q = np.empty((n, 0))
        self._rows = np.empty((0, n))
        self._seen = np.empty((0, n))  # the same rows outside the span, unit again
        self._thinnest = 1.0  # smallest pivot that was not taken for zero: rounding grows by it

    @property
    def rank(self) -> int:
        """Dimension of the span."""
        return self.Q.shape[1]

    def add(self, rows: Array, fixed: Mask, upper: Mask, lower: Mask) -> None:
        """Take in unit rows of a level: those in the span, those on their upper or lower side."""
        if fixed.any():
            self._widen(rows[fixed])
        if upper.any() or lower.any():
            self._rows = np.vstack([self._rows, rows[upper], -rows[lower]])
        if self._rows.size:
            seen = self._outside(self._rows)
            left = np.sqrt(np.einsum("ij,ij->i", seen, seen))
            kept = left > PARALLEL
            self._rows, self._seen = self._rows[kept], seen[kept] / left[kept, None]
            self._thinnest = float(left[kept].min(initial=self._thinnest))

    def descent(self, gradient: Array, size: float) -> Array:
        """Projection of -gradient on the polar cone; zero where rounding could have made it.

        size : of the terms that the gradient was summed from.
        """
        wanted = -self._outside(gradient)
        weights = 0.0
        if self._seen.size and wanted.any():
            multipliers = _nonnegative(self._seen.T, wanted)
            weights = float(multipliers.sum())
            wanted = wanted - self._seen.T @ multipliers
        noise = _ROUNDING * (size + weights) / self._thinnest
        return wanted if norm(wanted) > noise else np.zeros_like(wanted)

    def _outside(self, rows: Array) -> Array:
        for _ in range(2):  # once more, for rows that lie almost inside
            rows = rows - (rows @ self.Q) @ self.Q.T
        return rows

    def _widen(self, rows: Array) -> None:
        from scipy.linalg import qr  # type: ignore[import-untyped]

        q, r, _ = qr(self._outside(rows).T, mode="economic", pivoting=True, check_finite=False)
        pivots = np.abs(np.diagonal(r))
        rank = int(np.count_nonzero(pivots > PARALLEL))
        if rank:
            self._thinnest = min(self._thinnest, float(pivots[rank - 1]))
            self.Q = np.hstack([self.Q, q[:, :rank]])


def _nonnegative(C: Array, b: Array) -> Array:
    """Multipliers >= 0 that minimise |C multipliers - b|; zeros if no method ends."""
    from scipy.optimize import lsq_linear, nnls  # type: ignore[import-untyped]

    try:
        return np.asarray(nnls(C, b, maxiter=10 * sum(C.shape))[0])
    except RuntimeError:  # its bound on iterations
        return np.asarray(lsq_linear(C, b, (0.0, np.inf), method="bvls", tol=1e-15).x)
