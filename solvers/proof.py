"""Proved answers: a candidate x becomes the answer in 120 digits, with a bound, or nothing.

No code of a solver takes part, and none is trusted: a candidate only says which rows to think of as
violated and which as on a side. From there all arithmetic is decimal, in DIGITS digits, on the
exact values of the data.

1. Level by level, rows on a side hold exactly, and equalities and violated rows are least squares:
   a chain of linear systems, whose solution is x.
2. That x is the answer if it satisfies the conditions of Karush, Kuhn and Tucker at every level:
   each row is on the side of its bound that was assumed, and the gradient of each level is balanced
   by rows above (`certificate`, equation 1). Each condition is checked to ZERO.

Doubles cannot say whether rows are exactly dependent, or sides exactly equal. So rows that agree to
UNCLEAR count as dependent, a row that is violated by less counts as on its side, and one that is
that small beside the others counts as zero. The proof holds for the problem with rows turned and
sides shifted accordingly, and says by how much: mostly by nothing, or by rounding.

By more than ROUNDING, and the level is ill-posed: what the levels below it may use depends on what
is called zero. Its own least violation does not: to read the data more finely can only lower it.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import product
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import expect
from hierarchy.gate import array_of, sound_rows
from hierarchy.problem import Array, Hierarchy

DIGITS = 120
ZERO = Decimal("1e-60")     # relative: what the conditions may be missed by
UNCLEAR = 1e-8              # angle [rad], length / (1 + |x|), norm / largest norm: counts as zero
ROUNDING = 1e-12            # the same: what is more than that and counts as zero is ill-posed
_BANDS = (1e-8, 1e-10, 1e-6, 1e-7, 1e-12)  # what counts as on a side at the candidate, in turn

Exact = NDArray[np.object_]  # Decimals
Mask = NDArray[np.bool_]


@final
@dataclass(frozen=True)
class Proof:
    """The answer of a hierarchy, or of its first levels.

    x : (n,) the answer, rounded once from DIGITS digits to doubles; NaN unless it is proved.
    least : (L,) least violation of each level, its Euclidean norm, likewise; NaN where not proved.
    proved : number of levels, from the top, whose least violation is proved; L + 1 if x is, too.
    posed : number of levels, from the top, that have a least violation to speak of; L + 1 if also
        the nearest to the reference has a meaning.
    shift : largest shift of a side, a length relative to 1 + |x|, for which the proof holds.
    turn : largest turn of a row [rad] for which it holds.
    """

    x: Array
    least: Array
    proved: int
    posed: int
    shift: float
    turn: float

    @property
    def complete(self) -> bool:
        """Whether all levels are proved, and x as the nearest to the reference."""
        return self.proved > len(self.least)

    @property
    def judged(self) -> int:
        """Number of levels, from the top, that are proved and well posed; L + 1 if x is, too."""
        return min(self.proved, self.posed)


class _NoProofError(Exception):
    """The rows are not as the candidate says."""


def prove(h: Hierarchy, candidates: Iterable[ArrayLike], unclear: float = UNCLEAR) -> Proof:
    """Return what the candidates (n,) lead to: the answer of h, or of as many levels as possible.

    unclear : what counts as zero; see UNCLEAR.

    Slow: 0.02 s for 7 unknowns and 20 rows, 1 s for 38 unknowns and 106 rows.

    Raises HierarchyError: h has a metric, or levels that give.
    """
    expect("prove: h", h, Hierarchy, "make one with Hierarchy.from_levels")
    h.refuse_extras("prove: the hierarchy", "the proof")
    sound = sound_rows(*h.rows[:3]) and np.isfinite(h.reference).all()
    points = [array_of("prove: candidate", x) for x in candidates if sound]
    points = [x for x in points if x.shape == (h.n,) and np.isfinite(x).all()]
    levels = len(h.sizes)
    with localcontext() as context:
        context.prec = DIGITS
        for count, complete in [(levels, True), *((k, False) for k in range(levels, 0, -1))]:
            tried: set[bytes] = set()
            for x, band in product(points, _BANDS):
                rows = _Rows.at(h, x, band)
                key = np.vstack([rows.pulled, rows.on, rows.above & ~rows.equal])
                said = key[:, :int(h.offsets[count])].tobytes()
                if said in tried:
                    continue
                tried.add(said)
                with suppress(_NoProofError):
                    return _Attempt(h, rows, None if complete else x, count, unclear).proof()
    return Proof(np.full(h.n, np.nan), np.full(levels, np.nan), 0, levels + 1, 0.0, 0.0)


class _Rows(NamedTuple):
    """What a candidate says of each row (m,): zero or not, pulled, on a side, and on the upper."""

    seen: Mask
    equal: Mask
    pulled: Mask  # equalities and violated rows
    on: Mask
    above: Mask

    @staticmethod
    def at(h: Hierarchy, x: Array, band: float) -> _Rows:
        """Classify the rows at x; a side within `band`, relative to 1 + |x|, is reached."""
        value, size = h.A @ x, np.hypot.reduce(h.A, axis=1, initial=0.0)  # which cannot overflow
        reach = band * (1.0 + float(np.linalg.norm(x))) * size
        seen = size > ROUNDING * size.max(initial=0.0)
        equal = seen & (h.lower == h.upper)
        over, under = value - h.upper, h.lower - value
        pulled = seen & (equal | (over > reach) | (under > reach))
        on = seen & ~pulled & (np.maximum(over, under) >= -reach)
        return _Rows(seen, equal, pulled, on, (pulled | on) & (over >= under))


@final
class _Attempt:
    """One classification of the rows, from the answer that it implies to the proof."""

    def __init__(self, h: Hierarchy, rows: _Rows, near: Array | None, count: int,
                 unclear: float) -> None:
        """Take the first `count` levels, and of their x the nearest to `near` if it is given."""
        self.unclear = Decimal(unclear)
        self.h, self.near, self.count = h, near, count
        self.seen, self.equal, self.pulled, self.on, self.above = rows
        self.A: Exact = _exact(h.A)
        self.lower, self.upper = _exact(h.lower), _exact(h.upper)
        self.norm: Exact = np.array([_length(row) for row in self.A], dtype=object)
        self.side: Exact = np.where(self.above, self.upper, self.lower)
        self.level = np.repeat(np.arange(len(h.sizes)), h.sizes)
        self.posed = len(h.sizes) + 1
        self.turn = self.shift = 0.0

    def proof(self) -> Proof:
        """Return the proof; raises _NoProofError where a condition fails."""
        self._turn_rows()
        for _ in range(2 * self.count + 1):
            self.x = self._point()
            self.reach = 1 + _length(self.x)
            self.t: Exact = self.A @ self.x - self.side
            self._check_sides()
            if self._check_gradients():
                break
        else:
            raise _NoProofError
        complete, rounding = self.near is None, ZERO * self.reach
        x = np.array([float(value) if abs(value) > rounding else 0.0 for value in self.x])
        return Proof(x if complete else np.full(self.h.n, np.nan), self._least(),
                     self.count + complete, self.posed, self.shift, self.turn)

    def _turn_rows(self) -> None:
        """Make rows that agree with others to UNCLEAR exactly dependent on them."""
        span = _Span(self.h.n)
        for k in range(len(self.h.sizes)):
            own = self.level == k
            if (~self.seen[own] & (self.norm[own] > 0)).any():
                self._unclear_below(k)
            rows = np.flatnonzero((self.pulled | self.on) & own)
            for i, left in span.add(self.A[rows], self.norm[rows], self.unclear):
                if left is not None:
                    self.A[rows[i]] = self.A[rows[i]] - left
                    if k < self.count:
                        self.turn = self._used(_length(left) / self.norm[rows[i]], self.turn, k)

    def _used(self, by: Decimal, most: float, level: int) -> float:
        """Return the larger of a turn or a shift of a level and those before."""
        _demand(by <= self.unclear)
        if by > Decimal(ROUNDING):
            self._unclear_below(level)
        return max(most, float(by) if by > ZERO else 0.0)

    def _unclear_below(self, level: int) -> None:
        self.posed = min(self.posed, level + 1)

    def _point(self) -> Exact:
        """Return the x that meets the rows of each level best, those on a side first."""
        span, x = _Span(self.h.n), _exact(np.zeros(self.h.n))
        for k, kind in product(range(self.count), (self.on, self.pulled)):
            rows = kind & (self.level == k)
            x = x + span.least_squares(self.A[rows], self.norm[rows],
                                       self.side[rows] - self.A[rows] @ x)
        rest = _exact(self.h.reference if self.near is None else self.near) - x
        return np.asarray(x + rest - span.within(rest))

    def _check_sides(self) -> None:
        """Check that each row is where it was assumed to be."""
        value = self.A @ self.x
        for i in np.flatnonzero((self.seen & ~self.equal)[:self.h.offsets[self.count]]):
            level, beyond = int(self.level[i]), self.t[i] / (self.norm[i] * self.reach)
            if self.on[i]:
                self.shift = self._used(abs(beyond), self.shift, level)
            elif self.pulled[i]:
                beyond = beyond if self.above[i] else -beyond
                _demand(beyond > 0)
                if beyond < self.unclear:
                    self._unclear_below(level)
            else:
                _demand(self.lower[i] <= value[i] <= self.upper[i])

    def _check_gradients(self) -> bool:
        """Check that rows above balance each level, and the step to the reference.

        False if rows had to be turned for it, so that x must be found again.
        """
        fixed, n = _Span(self.h.n), self.h.n
        for k in range(self.count):
            own = np.flatnonzero(self.pulled & (self.level == k))
            above = self.on & (self.level < k)
            out = self._unbalanced(fixed, self.A[own], self.t[own], self.norm[own], above, k)
            if out is not None:
                self._turn_against(own, out, k)
                return False
            fixed.add(self.A[own], self.norm[own], ZERO)
        gap = self.x - _exact(self.h.reference)
        return self.near is not None or self._unbalanced(
            fixed, _exact(np.eye(n)), gap, _exact(np.ones(n)), self.on, self.count) is None

    def _unbalanced(self, fixed: _Span, A: Exact, t: Exact, norm: Exact, above: Mask, level: int
                    ) -> Exact | None:
        """Return what rows on a side cannot balance of A^T t with another t, by a small shift."""
        enough = ZERO * (abs(t) @ norm + 1) if len(A) else ZERO
        own = fixed.outside(A)
        sign = np.where(self.above[above], 1, -1)[:, None]
        outward = fixed.outside(self.A[above] * sign / self.norm[above][:, None])
        left = _pushed_back(outward, -(t @ own)) if len(A) else self.x * 0
        if _length(left) <= enough:
            return None
        span = _Span(self.h.n)
        span.add(own, norm, ZERO)
        C = own @ span.Q.T
        shift = C @ _solved(C.T @ C, span.Q @ left)
        out = left - span.within(left)
        if _length(out) > enough:
            return np.asarray(out)
        self.shift = self._used(max(abs(shift) / norm) / self.reach, self.shift, level)
        return None

    def _turn_against(self, own: NDArray[np.int64], out: Exact, level: int) -> None:
        """Turn rows of a level, with the same violations at x, so that A^T t loses `out`."""
        t = self.t[own]
        turned = t[:, None] * out[None, :] / (t @ t)
        angle = max(_length(row) / norm for row, norm in zip(turned, self.norm[own], strict=True))
        self.turn = self._used(angle, self.turn, level)
        self.A[own] = self.A[own] + turned
        self.side[own] = self.side[own] + turned @ self.x

    def _least(self) -> Array:
        """Return the norms of the levels' violations in the rows as given."""
        value = _exact(self.h.A) @ self.x
        inside = _exact(np.zeros(len(value)))
        off = np.maximum(np.maximum(value - self.upper, self.lower - value), inside)
        shift = max(2 * Decimal(self.shift), ZERO)
        share = np.array([shift if on else ZERO for on in self.on], dtype=object)
        off[off <= share * self.norm * self.reach] = Decimal(0)
        norms = [float(_length(off[self.level == k])) for k in range(self.count)]
        return np.array(norms + [np.nan] * (len(self.h.sizes) - self.count))


@final
class _Span:
    """An orthonormal basis that grows with rows."""

    def __init__(self, n: int) -> None:
        self.Q: Exact = np.empty((0, n), dtype=object)

    def within(self, v: Exact) -> Exact:
        """Return the part of v (n,) in the span."""
        return np.asarray((self.Q @ v) @ self.Q)

    def outside(self, rows: Exact) -> Exact:
        """Return the part of rows (m, n) outside the span."""
        return np.asarray(rows - (rows @ self.Q.T) @ self.Q)

    def add(self, rows: Exact, norm: Exact, zero: Decimal) -> list[tuple[int, Exact | None]]:
        """Add rows (m, n), the one with the largest remainder relative to its norm (m,) first.

        Returns the index of each row with its remainder if that counts as zero, else with None.
        """
        left, waiting, said = self.outside(rows), list(range(len(rows))), []
        while waiting:
            share = {i: _length(left[i]) / norm[i] for i in waiting}
            best = max(waiting, key=share.__getitem__)
            if share[best] <= zero or len(self.Q) == rows.shape[1]:
                break
            waiting.remove(best)
            said.append((best, None))
            q = self.outside((left[best] / _length(left[best]))[None])[0]
            q = q / _length(q)
            self.Q = np.vstack([self.Q, q[None]])
            for i in waiting:
                left[i] = left[i] - (left[i] @ q) * q
        return said + [(i, left[i]) for i in waiting]

    def least_squares(self, rows: Exact, norm: Exact, b: Exact) -> Exact:
        """Return the shortest d (n,) outside the span with least |rows d - b|, and add the rows."""
        first = len(self.Q)
        self.add(rows, norm, ZERO)
        new = self.Q[first:]
        C = rows @ new.T
        return np.asarray(_solved(C.T @ C, C.T @ b) @ new)


def _pushed_back(rows: Exact, target: Exact) -> Exact:
    """Return target - rows^T z for the z >= 0 that makes it shortest.

    Lawson and Hanson (1974), ch. 23.
    """
    size = [_length(row) for row in rows]
    usable = [i for i in range(len(rows)) if size[i] > ZERO]
    z, free, left = _exact(np.zeros(len(rows))), list[int](), target
    enough = ZERO * _length(target)
    for _ in range(3 * len(rows) + 1):
        slope = {i: (rows[i] @ left) / size[i] for i in usable if i not in free}
        if not slope or max(slope.values()) <= enough:
            break
        free.append(max(slope, key=slope.__getitem__))
        while True:
            chosen = rows[free]
            s = _solved(chosen @ chosen.T, chosen @ target)
            share = {i: z[i] / (z[i] - s[j]) for j, i in enumerate(free) if s[j] < 0}
            if not share:
                break
            least = min(share.values())
            z[free] = z[free] + least * (s - z[free])
            gone = [i for i in share if share[i] == least]
            z[gone] = Decimal(0)
            free = [i for i in free if i not in gone]
        z[free] = s
        left = target - s @ rows[free]
    return left


def _solved(M: Exact, b: Exact) -> Exact:
    """Return y with M y = b, for M symmetric and positive definite; Cholesky, L D L^T."""
    size, L, y = len(b), M.copy(), b.copy()
    for j in range(size):
        if L[j, j] <= 0:
            raise _NoProofError
        factors = L[j + 1:, j] / L[j, j]
        L[j + 1:, j + 1:] -= np.outer(factors, L[j, j + 1:])
        y[j + 1:] -= factors * y[j]
    for j in reversed(range(size)):
        y[j] = (y[j] - L[j, j + 1:] @ y[j + 1:]) / L[j, j]
    return y


def _demand(holds: bool) -> None:
    if not holds:
        raise _NoProofError


def _exact(values: Array) -> Any:
    """Return doubles as Decimals, without rounding."""
    flat = [Decimal(value) for value in values.ravel().tolist()]
    return np.array(flat, dtype=object).reshape(values.shape)


def _length(v: Exact) -> Decimal:
    return Decimal(sum((value * value for value in v), Decimal(0))).sqrt()
