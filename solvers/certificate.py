"""Certificate: is this x the answer of a hierarchy? Uses the data alone, trusting no solver.

Every row is judged by its own norm. Let t_i be the violation of row i at x divided by the norm of
the row: a length in the space of x. Let F_(k-1) be the set of all y at which every row of the
levels above has the violation that it has at x: equalities and violated rows keep their value, the
others stay within their sides. F_(k-1) is convex, so x is optimal for level k exactly when the
normal cone of F_(k-1) at x balances the gradient (Karush-Kuhn-Tucker), that is when

    sum_i |a_i|^2 t_i u_i + sum_j y_j u_j + sum_l z_l c_l = 0,   y >= 0,  z >= 0,          (1)

modulo the span of the equalities and violated rows above. The u_i are the unit rows of the level
that are equalities or violated, the u_j those that are on a side, and the c_l the unit rows above
that are on a side, all pointing outwards.

The residual of a level is the smallest change of t for which (1) holds: the Euclidean norm over the
rows of the level, relative to 1 + |x|. Or, if it is smaller, the smallest turn [rad] of the rows of
the level for which (1) holds with t as it is. So x is accepted if it is exactly optimal once each
side is shifted by no more than `tolerance` (1 + |x|) along its row, or each row is turned by no
more than `tolerance`, whatever the norm of the row, and rejected if no such change explains it. A
level whose rows had to be turned can still fall, by no more than the turn times the distance that x
moves; the levels below are judged with the turned rows. The same test, with the rows of all levels
above and x - reference for t, decides whether x is the nearest; it needs no turn.

Double precision sets two limits. First, rows that agree up to an angle of `parallel` count as
dependent: a direction that only their difference can see is free, and lower levels may use it.
Their span is then known only up to that angle, so x may be right under either reading, with angles
from a tenth of `parallel` to four times it, or for rows turned by no more than it that are exactly
dependent. Second, a row smaller than 1e-13 of the largest row of its level is dust, which rounding
in the large row could have produced: an x that meets it is accepted, and so is one that ignores it.

The smallest change is a non-negative least-squares problem in coordinates that put large rows
first, so that rounding in rows of norm 1000 does not hide a row of norm 0.001.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError, expect, number
from hierarchy.gate import array_of
from hierarchy.notebook import html_table
from hierarchy.problem import Array, Hierarchy

TOLERANCE = 1e-8
"""Largest residual of an answer, and largest distance of a row that counts as on its side, relative
to 1 + |x|."""
PARALLEL = 1e-8
"""Angle [rad] up to which a row counts as dependent on others."""
_EITHER = 0.25, 4.0, 0.1   # times `parallel`: up to these angles rows may count as dependent too
_EXACTLY = 1e-4     # times `parallel`: the same for rows made exactly dependent
_DUST = 1e-13       # norm of a row relative to the largest of its level: smaller ones are dust
_UNSEEN = 1e4       # weight of directions that no row of a level sees, relative to the weakest seen
_BLOCK = 32         # columns that LAPACK reflects at a time
_LARGEST = 1e150    # length: its square stays finite
_SMALL = 1e-15      # relative: smaller steps and pivots are rounding
_ROUNDING = 64 * float(np.finfo(float).eps)

Mask = NDArray[np.bool_]


@final
@dataclass(frozen=True, repr=False)
class Certificate:
    """The verdict on one x.

    violations : (L,) Euclidean norm of each level's violation.
    stationarity : (L,) residual of each level: the smallest shift of its sides for which x is
        optimal, as a length (violation divided by the norm of the row), relative to 1 + |x|; or
        the smallest turn of its rows [rad], if that is smaller.
    nearest : length of the remaining step towards the reference that changes no level, relative to
        1 + |x|.
    tolerance : largest residual that is accepted.
    names : names of the levels.
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
        """Whether every level's violation is as small as the levels above allow."""
        return self.level is None

    @property
    def is_nearest(self) -> bool:
        """Whether no step towards the reference remains."""
        return self.nearest <= self.tolerance

    @property
    def certified(self) -> bool:
        """Whether x is the answer: the optimal x nearest to the reference."""
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

    def __repr__(self) -> str:
        return f"Certificate({self})"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [
            (name, f"{missed:.3g}", f"{residual:.1e}",
             "yes" if residual <= self.tolerance else "no")
            for name, missed, residual in zip(self.names, self.violations, self.stationarity,
                                              strict=True)]
        near = "yes" if self.is_nearest else "no"
        rows.append(("nearest to the reference", "", f"{self.nearest:.1e}", near))
        return html_table(f"Certificate: {self}", ("level", "violation", "residual", "optimal"),
                          rows)


def certify(h: Hierarchy, x: ArrayLike, tolerance: float = TOLERANCE,
            parallel: float = PARALLEL, witnesses: ArrayLike | None = None) -> Certificate:
    """Judge level by level whether x (n,) is the answer of h; see the module's docstring.

    x counts as on a side within `tolerance` (1 + |x|) of its hyperplane, and the row as violated
    beyond it. A row on a side can push only towards that side. Residuals that rounding alone
    explains count as zero. An x or data that are not finite, sides that cross, or lengths whose
    squares overflow, are never certified.

    With a metric W all lengths and angles are those of W: in place of x it judges
    y = L^T (x - reference), with W = L L^T.

    Of a hierarchy that gives, each of the `witnesses` (K, n), those of the resolution, must be
    optimal for the levels down to one that gives, and so proves its least miss. x must be the
    answer with the room that follows. The residual of such a level is the larger of the two.

    tolerance : largest residual, relative to 1 + |x|.
    parallel : angle [rad] up to which rows count as dependent.

    Raises HierarchyError: x has the wrong shape, or there is not one witness for each level that
    gives.
    """
    expect("certify: h", h, Hierarchy, "make one with Hierarchy.from_levels([(A, b), ...])")
    number("certify: tolerance", tolerance, 0.0)
    number("certify: parallel [rad]", parallel, 0.0)
    if h.giving:
        return _certify_giving(h, x, tolerance, parallel, witnesses)
    with np.errstate(all="ignore"):
        slack = h.slacks(x)
        h, x = _euclidean(h, np.asarray(x, dtype=np.float64))
        violations = np.array([_length(slack[level]) for level in _levels(h)])
        rows = _Rows.of(h, x, tolerance)
        if rows is None:
            unknown = np.full(len(violations), np.inf)
            return Certificate(unknown, unknown.copy(), np.inf, tolerance, h.names)
        verdicts = (Certificate(violations, *_judged(levels, x - h.reference, rows.reach, tolerance,
                                                     angle), tolerance, h.names)
                    for levels, angle in _readings(h, x, rows, tolerance, parallel))
        first = next(verdicts)
        return first if first.certified else next((v for v in verdicts if v.certified), first)


def _certify_giving(h: Hierarchy, x: ArrayLike, tolerance: float, parallel: float,
                    witnesses: ArrayLike | None) -> Certificate:
    giving, found = h.giving, array_of("certify: witnesses", () if witnesses is None else witnesses)
    if found.shape != (len(giving), h.n):
        raise HierarchyError(f"certify: {len(giving)} levels give, so witnesses must be "
                             f"({len(giving)}, {h.n}), those of the resolution; got {found.shape}")
    least, room = np.zeros(len(h.sizes)), h
    for level, witness in zip(giving, found, strict=True):
        part = certify(room.upper_part(level + 1), witness, tolerance, parallel)
        least[:level + 1] = np.maximum(least[:level + 1], part.stationarity)
        room = room.relaxed(level, witness)
    last = certify(room, x, tolerance, parallel)
    missed, least = h.slacks(x), np.maximum(least, last.stationarity)
    return Certificate(np.array([_length(missed[level]) for level in _levels(h)]), least,
                       last.nearest, tolerance, h.names)


def _euclidean(h: Hierarchy, x: Array) -> tuple[Hierarchy, Array]:
    """Return h and x in variables in which the metric is the identity; NaN if there are none."""
    if h.metric is None:
        return h, x
    try:
        L = np.linalg.cholesky(h.metric)
    except np.linalg.LinAlgError:
        L = np.full_like(h.metric, np.nan)
    at = h.A @ h.reference
    changed = h.changed(A=np.linalg.solve(L, h.A.T).T, lower=h.lower - at, upper=h.upper - at,
                        reference=None, metric=None)
    return changed, L.T @ (x - h.reference)


def _levels(h: Hierarchy) -> list[slice]:
    return [slice(*pair) for pair in pairwise(h.offsets.tolist())]


def _readings(h: Hierarchy, x: Array, rows: _Rows, tolerance: float, parallel: float
              ) -> Iterator[tuple[list[_Rows], float]]:
    """Yield the levels that x may be optimal for, and the angle up to which their rows depend."""
    levels = [rows.part(level) for level in _levels(h)]
    for factor in (1.0, *_EITHER):
        yield levels, factor * parallel
    turned = _Rows.of(_made_dependent(h, rows, parallel), x, tolerance)
    if turned is not None:
        yield [turned.part(level) for level in _levels(h)], _EXACTLY * parallel


def _made_dependent(h: Hierarchy, rows: _Rows, parallel: float) -> Hierarchy:
    """Return h with those rows on a side exactly dependent that are so up to an angle.

    In each level the row with the largest remainder is independent, as long as there is one.
    """
    A, basis, on = h.A.copy(), np.empty((0, h.n)), rows.fixed | rows.upper | rows.lower
    for level in _levels(h):
        left = level.start + np.flatnonzero(on[level])
        while len(left) and len(basis) < h.n:
            rest = _outside(rows.unit[left], basis)
            size = norm(rest, axis=1)
            chosen, near = int(np.argmax(size)), size <= parallel
            A[left[near]] -= rest[near] * np.exp(rows.size[left[near]])[:, None]
            if not near[chosen]:
                basis = np.vstack([basis, rest[chosen] / size[chosen]])
            near[chosen] = True
            left = left[~near]
    return h.changed(A=A)


def _judged(levels: list[_Rows], gap: Array, reach: float, tolerance: float, parallel: float
            ) -> tuple[Array, float]:
    """Return the residuals of the levels and of the distance to the reference, over reach."""
    stationarity, cone = np.zeros(len(levels)), _NormalCone(len(gap), parallel)
    for k, level in enumerate(levels):
        if cone.Z.shape[1] == 0:
            break
        left, level = _residual(cone, level, tolerance * reach)
        stationarity[k] = left / reach
        cone.add(level)
    C, f = cone.rows.T, cone.Z.T @ gap  # the step left is the projection of -gap on the polar cone
    unknown = _ROUNDING / cone.thinnest + cone.angle
    nearest = _balanced(C, np.ones_like(C), f, np.full(len(f), norm(gap)), unknown,
                        1e-3 * tolerance * reach)
    return stationarity, nearest / reach


class _Rows(NamedTuple):
    """Unit rows and the position of x relative to them, as lengths.

    unit (m, n); size (m,) logarithm of the norm, -inf for a row of zeros; t (m,) signed distance
    beyond a side; fixed, upper, lower (m,): the row must keep its value, is on its upper side, is
    on its lower side; reach = 1 + |x|.
    """

    unit: Array
    size: Array
    t: Array
    fixed: Mask
    upper: Mask
    lower: Mask
    reach: float

    @staticmethod
    def of(h: Hierarchy, x: Array, tolerance: float) -> _Rows | None:
        """Return the rows of all levels, or None if a number is too large or not finite."""
        largest = np.abs(h.A).max(axis=1, initial=0.0)
        seen = largest > 0.0
        scale = np.where(seen, largest, 1.0)
        unit = h.A / scale[:, None]
        length = np.where(seen, np.sqrt(np.einsum("ij,ij->i", unit, unit)), 1.0)
        unit = unit / length[:, None]
        low = np.where(seen, h.lower / scale / length, -np.inf)  # a zero row does not constrain x
        up = np.where(seen, h.upper / scale / length, np.inf)
        value, reach = unit @ x, 1.0 + _length(x)
        t = np.maximum(value - up, 0.0) - np.maximum(low - value, 0.0)
        known = [reach, _length(x - h.reference), *np.abs(t), *np.abs(value)]
        if not (np.array(known) < _LARGEST).all() or not (h.lower <= h.upper).all():
            return None
        band = tolerance * reach
        fixed = (h.lower == h.upper) | (np.abs(t) > band)
        size = np.where(seen, np.log(scale) + np.log(length), -np.inf)
        return _Rows(unit, size, t, fixed & seen,
                     ~fixed & (value >= up - band), ~fixed & (value <= low + band), reach)

    def part(self, rows: slice) -> _Rows:
        """Return the rows of one level."""
        return _Rows._make([*(of[rows] for of in self[:-1]), self.reach])


class _NormalCone:
    """Normal cone of F_k at x: Z (n, p), a basis of the freedom left by the span, and unit rows."""

    def __init__(self, n: int, parallel: float) -> None:
        self.Z = np.eye(n)
        self.parallel = parallel
        self.rows = np.empty((0, n))   # coordinates in Z of rows on a side, normalised again
        self._kept = np.empty((0, n))  # the same rows as given
        self.thinnest = 1.0  # smallest nonzero pivot: amplifies rounding
        self.angle = 0.0  # largest pivot taken for zero: error of the span

    def add(self, level: _Rows) -> None:
        """Add a level: rows in the span, and rows on their upper or lower side."""
        if level.fixed.any():
            self.Z, pivot, angle = _complement(self.Z, level.unit[level.fixed], self.parallel)
            self.thinnest, self.angle = min(self.thinnest, pivot), max(self.angle, angle)
        self._kept = np.vstack([self._kept, _on_sides(level, level.size)[0]])
        seen = self._kept @ self.Z
        left = norm(seen, axis=1)
        faint, free = left[left <= self.parallel], left > self.parallel
        self._kept, seen, left = self._kept[free], seen[free], left[free]
        self.rows = seen / left[:, None]
        self.thinnest = min(self.thinnest, float(left.min(initial=1.0)))
        self.angle = max(self.angle, float(faint.max(initial=0.0)))


def _complement(Z: Array, rows: Array, parallel: float) -> tuple[Array, float, float]:
    """Return a basis of the part of Z (n, p) outside the span of unit rows, and two pivots.

    The pivots are the smallest that counts and the largest that counts as zero.
    """
    Q, R, _ = _qr((rows @ Z).T)
    pivots = np.abs(np.diagonal(R))
    rank = int(np.count_nonzero(pivots > parallel))
    return (Z @ Q[:, rank:], float(pivots[:rank].min(initial=1.0)),
            float(pivots[rank:].max(initial=0.0)))


def _residual(cone: _NormalCone, level: _Rows, enough: float) -> tuple[float, _Rows]:
    """Return the least change of t that balances the gradient of a level: a length.

    Or, if it is smaller, the least turn of its rows times 1 + |x|, and the level with turned rows.
    """
    whole = _length(level.t)
    if whole <= enough:  # a change to no violation at all is small enough
        return whole, level
    size = np.exp(level.size - level.size.max())
    judged = level.fixed & (size > _DUST)
    dust = level.fixed & ~judged
    if not judged.any():  # here too: each row is on its side
        return float(np.abs(level.t[~dust]).max(initial=0.0)), level
    Z = _complement(cone.Z, level.unit[dust], cone.parallel)[0] if dust.any() else cone.Z
    change = min(_least_change(cone, level, Z, size, judged, enough), whole)
    if change <= enough:
        return change, level
    turn, turned = _least_turn(cone, level, Z, size, judged)
    return (level.reach * turn, turned) if level.reach * turn < change else (change, level)


def _least_change(cone: _NormalCone, level: _Rows, Z: Array, size: Array, judged: Mask,
                  enough: float) -> float:
    """Return the residual of (1) in coordinates of Z (n, p), for the judged rows of a level."""
    own, own_size, own_t = _on_sides(level, size)
    cone_rows = np.vstack([cone.rows @ (cone.Z.T @ Z), (own @ Z) * own_size[:, None]**2])
    C, terms, Q, thinnest, angle = _weighted(level.unit[judged] @ Z, size[judged], cone_rows,
                                             cone.parallel)
    rank = Q.shape[1]
    unseen = _independent(C[rank:], terms[rank:], cone.parallel)
    C, terms = np.vstack([C[:rank], unseen]), terms[:rank + len(unseen)]
    held = np.eye(len(own_t), C.shape[1], len(cone.rows))
    none, t = np.zeros(len(unseen)), level.t[judged]
    f = np.concatenate([Q.T @ t, none, -np.maximum(own_t, 0.0)])
    sizes = np.concatenate([np.abs(Q).T @ np.abs(t), none, np.zeros(len(own_t))])
    unknown = np.full(len(f), _ROUNDING / min(cone.thinnest, thinnest) + max(cone.angle, angle))
    beyond = slice(rank, len(C))  # up to the angle at which rows count as dependent
    unknown[beyond] = np.maximum(unknown[beyond], cone.parallel)
    return _balanced(np.vstack([C, held]), np.vstack([terms, held]), f, sizes, unknown,
                     1e-3 * enough)


def _independent(heavy: Array, terms: Array, parallel: float) -> Array:
    """Return as many rows as are independent, up to that angle, with the span of rows (q, k).

    Of dependent rows only rounding would remain, and theirs is larger than a light row. For the
    same reason entries that are rounding of `terms` (q, k), the same in each row, become zero.
    """
    _, R, order = _qr(heavy)
    pivots = np.abs(np.diagonal(R))
    rank = int(np.count_nonzero(pivots > parallel * pivots.max(initial=0.0)))
    rows = np.empty((rank, heavy.shape[1]))
    rows[:, order] = R[:rank]
    rows[np.abs(rows) <= _ROUNDING * terms[:rank]] = 0.0
    return rows


def _least_turn(cone: _NormalCone, level: _Rows, Z: Array, size: Array, judged: Mask
                ) -> tuple[float, _Rows]:
    """Return the turn [rad] of the judged rows with which (1) holds for t, and the rows turned.

    It is measured as if all rows had the norm of the smallest: a heavy row excuses no light one.
    """
    force = np.where(judged, size**2 * level.t, 0.0)
    own, _, _ = _on_sides(level, size)
    C = np.hstack([(cone.rows @ (cone.Z.T @ Z)).T, (own @ Z).T])
    f = Z.T @ (level.unit.T @ force)
    left = min((C @ _non_negative(C, -f, 0.0, by_scipy) + f for by_scipy in (False, True)),
               key=_length)
    least, square = float((size[judged]**2).min()) * _length(level.t[judged]), float(force @ force)
    if not (least > 0.0 and square > 0.0):
        return np.inf, level
    turned = level.unit - np.outer(force / square, Z @ left)
    return _length(left) / least, level._replace(unit=turned)


def _on_sides(level: _Rows, size: Array) -> tuple[Array, Array, Array]:
    """Return the outward unit rows of a level that are on a side, their sizes and distances t."""
    up, low = level.upper, level.lower
    return (np.concatenate([level.unit[up], -level.unit[low]]),
            np.concatenate([size[up], size[low]]), np.concatenate([level.t[up], -level.t[low]]))


def _balanced(C: Array, terms: Array, f: Array, size: Array, unknown: Array | float,
              enough: float) -> float:
    """Return the least |C z + f| for z >= 0, ignoring entries within the unknown share of terms.

    That share is what rounding or rows counted as parallel may explain. Any z proves what it
    reaches. A search that rounding ends early on dependent columns is repeated by scipy's, which
    chooses otherwise, and then without the rows that only repeat heavier ones.
    """
    least = np.inf
    for by_scipy, repeated in ((False, True), (True, True), (False, False)):
        z = _non_negative(C if repeated else _unrepeated(C, terms), -f, enough, by_scipy)
        left = C @ z + f
        noise = unknown * (size + terms @ z)
        least = min(least, _length(left[np.abs(left) > noise]))
        if least <= enough:
            break
    return least


def _unrepeated(C: Array, terms: Array) -> Array:
    """Return C with zeros for the rows of which heavier ones leave only rounding of `terms`.

    Beside rows of 1e15 that rounding would be larger than a row of 1.
    """
    C, basis = C.copy(), np.empty((0, C.shape[1]))
    for i in np.argsort(-np.abs(C).max(axis=1, initial=0.0), kind="stable"):
        size = _length(C[i])
        left = _outside(C[i] / size if size > 0.0 else C[i], basis)
        if size * _length(left) <= _ROUNDING * _length(terms[i]):
            C[i] = 0.0
        else:
            basis = np.vstack([basis, left / _length(left)])
    return C


def _outside(rows: Array, basis: Array) -> Array:
    """Return what rows (.., n) have outside the span of an orthonormal basis (k, n)."""
    for _ in range(2):  # once more: of a row nearly in the span, rounding remains
        rows = rows - (rows @ basis.T) @ basis
    return rows


def _weighted(P: Array, size: Array, rows: Array, parallel: float
              ) -> tuple[Array, Array, Array, float, float]:
    """Return the effect of rows (k, p) on the balance of a level, as columns (p, k), in lengths.

    P (m, p) are projections of the unit rows of the level, for rows of these sizes (m,). What these
    see comes first, large rows first. Also returns the size of the terms summed in each entry, to
    which rounding is relative; Q (m, rank), orthonormal, for which |Q^T t| is the least change of t
    without help from the cone; and smallest pivot and error of the span of P.
    """
    V, T, thinnest, angle, rank = _graded(P, size, parallel)
    by_size = np.argsort(-size, kind="stable")
    sorted_Q, R, order = _qr((T[:rank] * size**2).T[by_size])
    Q, R = np.empty((len(size), rank)), R[:rank]
    Q[by_size] = sorted_Q[:, :rank]
    seen, outside, length = rows @ V[:, :rank], rows @ V[:, rank:], norm(rows, axis=1)
    seen[np.abs(seen) <= _ROUNDING * length[:, None]] = 0.0
    inside = _solve_triangular(R, seen[:, order].T, trans=1)
    turned = parallel * (length + np.abs(Q @ inside).T @ size**2)
    outside[norm(outside, axis=1) <= turned] = 0.0  # in the span, if each row turns by so much
    weight = _UNSEEN / float(np.abs(np.diagonal(R)).min(initial=_UNSEEN))
    return (np.vstack([inside, weight * outside.T]),
            np.vstack([np.abs(inside), np.tile(weight * length, (outside.shape[1], 1))]),
            Q, thinnest, angle)


def _graded(P: Array, size: Array, parallel: float) -> tuple[Array, Array, float, float, int]:
    """Return an orthonormal basis V (p, p), T = V^T P^T, its smallest pivot, its error, its rank.

    Pivots are chosen by the size of the remainder of a row. A row with a remainder of at most
    `parallel` of itself is not a pivot, and its remainder counts as zero.
    """
    candidate = norm(P, axis=1) > parallel
    while True:
        chosen = np.flatnonzero(candidate)
        V, R, order = _qr((P[chosen] * size[chosen, None]).T)
        pivots = np.abs(np.diagonal(R)) / size[chosen[order]][:len(R)]
        lost = pivots <= parallel
        if not lost.any():
            break
        candidate[chosen[order[int(np.argmax(lost))]]] = False
    T = V.T @ P.T
    left = np.sqrt(np.cumsum(T[::-1]**2, axis=0)[::-1])
    out = left <= 0.5 * parallel  # half: the remainder of a pivot must survive rounding
    out[len(pivots):] = True
    angle = float(np.minimum(np.abs(T)[out].max(initial=0.0), parallel))
    T[out] = 0.0
    return V, T, float(pivots.min(initial=1.0)), angle, len(pivots)


def _non_negative(C: Array, b: Array, enough: float, by_scipy: bool = False) -> Array:
    """Return z >= 0 that minimises |C z - b| (Lawson and Hanson 1974, ch. 23).

    Stops early once |C z - b| <= enough, and in any case after three steps per column. Or, by
    scipy's search, which ends elsewhere.
    """
    z, largest = np.zeros(C.shape[1]), float(np.abs(b).max(initial=0.0))
    peak = np.abs(C).max(axis=0, initial=0.0)
    usable = (peak > 0.0) & (peak < np.inf)
    if not usable.any() or not 0.0 < largest < np.inf:
        return z
    D, peak = C[:, usable], peak[usable]
    if by_scipy:
        z[usable] = _by_scipy(D / peak, b / largest) * (largest / peak)
        return z if np.isfinite(z).all() else np.zeros(len(z))
    heavy = np.argsort(-np.abs(C).max(axis=1), kind="stable")  # rows differ in weight
    z[usable] = largest * _active_set(D[heavy], b[heavy] / largest, D[heavy] / peak, enough,
                                      largest)
    return z


def _by_scipy(D: Array, b: Array) -> Array:
    """Return y >= 0 that minimises |D y - b|, zero if that takes too many steps.

    It gets finite numbers of at most 1: others can end the process.
    """
    from scipy.optimize import nnls

    try:
        return np.asarray(nnls(D, b)[0])
    except RuntimeError:
        return np.zeros(D.shape[1])


def _active_set(D: Array, b: Array, unit: Array, enough: float, scale: float) -> Array:
    """Return y >= 0 that minimises |D y - b|, or reaches enough / scale; unit (D) picks columns."""
    y, left, free = _first_guess(D, b)
    refused, tried = np.zeros(len(y), dtype=bool), {free.tobytes()}
    for _ in range(3 * len(y) + 3):
        slopes, terms = unit.T @ left, np.abs(unit).T @ np.abs(left)
        slopes[free | refused | (terms == 0.0)] = 0.0
        slopes /= np.where(terms > 0.0, terms, 1.0)
        best = int(np.argmax(slopes))
        if norm(left) * scale <= enough or slopes[best] <= _SMALL:
            break
        moved = _freed(D, b, y, free, best)
        if moved is None or moved[2].tobytes() in tried:  # chosen by rounding
            refused[best] = True
        else:
            y, left, free = moved
            tried.add(free.tobytes())
            refused[:] = False
    return y


def _first_guess(D: Array, b: Array) -> tuple[Array, Array, Mask]:
    """Return the least squares of all columns, repeated without those that come out negative.

    Returns y, the residual, and the mask of the free columns.
    """
    free = np.ones(D.shape[1], dtype=bool)
    while free.any():
        y, left = _least_squares(D, b, free)
        if (y[free] > 0.0).all():
            return y, left, free
        free &= y > 0.0
    return np.zeros(D.shape[1]), b, free


def _freed(D: Array, b: Array, y: Array, free: Mask, new: int) -> tuple[Array, Array, Mask] | None:
    """Return the least squares y >= 0 after one more entry is freed, its residual, and the mask.

    None if the new entry would become negative, which means that rounding chose it.
    """
    free = free.copy()
    free[new] = True
    for first in (True, *[False] * len(y)):
        s, left = _least_squares(D, b, free)
        if first and s[new] <= 0.0:
            return None
        stop = free & (s <= 0.0)
        if not stop.any():
            break
        share = y[stop] / (y[stop] - s[stop])
        y = y + float(share.min()) * (s - y)
        free[np.flatnonzero(stop)[share <= share.min()]] = False
        y[~free] = 0.0
    return s, left, free


def _least_squares(D: Array, b: Array, free: Mask) -> tuple[Array, Array]:
    """Return the least squares of the free columns and its residual; QR with pivoting.

    Heavy rows come first. The residual comes from Q, not from a difference, so the small residual
    of a heavy row is as accurate as the rest (Cox, Higham 1998).
    """
    s, chosen = np.zeros(D.shape[1]), D[:, free]
    Q, R, order = _qr(chosen)
    inside, diagonal = Q.T @ b, np.abs(np.diagonal(R))
    depth = len(diagonal)
    rounding = _SMALL * np.minimum(norm(chosen, axis=0)[order[:depth]],  # of columns and rows
                                   np.abs(chosen).max(axis=1, initial=0.0)[:depth])
    pivots = diagonal > rounding
    rank = len(pivots) if pivots.all() else int(np.argmin(pivots))
    s[np.flatnonzero(free)[order[:rank]]] = _solve_triangular(R[:rank, :rank], inside[:rank])
    return s, Q[:, rank:] @ inside[rank:]


def _qr(matrix: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return Q (m, m), R (m, n) and the order (n,) of its columns; scipy's `qr` takes longer."""
    from scipy.linalg import lapack

    (m, n), Q = matrix.shape, np.eye(len(matrix))
    if not matrix.size:
        return Q, np.empty((m, n)), np.arange(n)
    raw, order, tau, _, _ = lapack.dgeqp3(matrix, 2 * n + (n + 1) * _BLOCK)
    Q[:, :n] = raw[:, :m]
    return lapack.dorgqr(Q, tau, m * _BLOCK)[0], np.triu(raw), order - 1


def _solve_triangular(R: Array, b: Array, trans: int = 0) -> Array:
    """Return R^-1 b, or R^-T b if trans is 1, for the upper triangle of R (k, k) and b (k, ..)."""
    from scipy.linalg import lapack

    return np.asarray(lapack.dtrtrs(R, b, trans=trans)[0]) if b.size else b.copy()


def _length(v: Array) -> float:
    """Return the Euclidean norm, computed without overflow."""
    return float(np.hypot.reduce(v, initial=0.0))
