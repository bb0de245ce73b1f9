"""A factored stack whose priorities change at a cost independent of the number of joints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from numbers import Integral
from typing import NamedTuple, final

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, check_name, expect, refuse
from hierarchy.gate import Sizes, array_of, check_finite, check_rows, level_names, readable, shaped
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.staircase import solve_by_staircase
from solvers.kernels.tolerances import CANCELLED
from solvers.resolver import Resolution, place_of
from solvers.resolvers.tpm import Tpm, task_priority_matrix
from solvers.status import INACCURATE, SOLVED, Status
from solvers.workspace import entry, run

_FEWEST = 8       # directions of the basis for which there is always room
_PASSES = 3       # of the projection on the basis; two are enough unless the row is rounding
_OUTSIDE = 1e-14  # share of a row outside the basis: less is no direction

Level = int | str
Targets = Array | Mapping[str, ArrayLike] | Sequence[ArrayLike]


class _Held(NamedTuple):
    """A level: its rows A (m_k, n), and C (m_k, r) for the r directions known when it came."""

    name: str
    A: Array
    C: Array


@final
class Factorization:
    """Levels of equalities J x = b, factored as J = C Q^T while their priorities change.

    Swap, reorder and delete change the order of C (m, r) alone, and a solve takes C and one product
    with the basis Q (n, r); insert projects its rows on Q. The answer is the x of `tpm` with the
    same settings, and nearly parallel rows and rows far lighter than others are left to it. Costs
    and the treatment of deleted rows: docs/factorization.md.

    levels : A_k (m_k, n) of each level, most important first.
    names : one name per level; None for "level 1", "level 2", ...
    n : number of unknowns; None takes it from the first level.
    settings : a `tpm` in its staircase form; None for its defaults.

    Raises HierarchyError, naming level, row and value, for a wrong shape, an entry that is not
    finite, a repeated name, an unknown n, or the published form.
    """

    def __init__(self, levels: Sequence[ArrayLike], names: Sequence[str] | None = None,
                 n: int | None = None, settings: Tpm | None = None) -> None:
        self._settings = Tpm() if settings is None else settings
        expect("settings", self._settings, Tpm, "give make('tpm')")
        if self._settings.form != "staircase":
            raise HierarchyError("a factorization needs the staircase form of tpm, got form = "
                                 f"{self._settings.form!r}")
        expect("levels", levels, Sequence, "give a list of matrices (m_k, n)")
        names = level_names(names, len(levels))
        if n is None and not levels:
            raise HierarchyError("no levels and no n: the number of unknowns is not known")
        if n is None:
            A = readable(f"{names[0]}: A", levels[0])
            n = A.shape[1] if A.ndim == 2 else 0
        elif isinstance(n, bool) or not isinstance(n, Integral) or n < 1:
            raise HierarchyError(f"n = {n!r}, expected a whole number >= 1")
        self._n = int(n)
        self._factor_afresh([(name, self._checked(name, A))
                             for name, A in zip(names, levels, strict=True)])

    def _factor_afresh(self, blocks: list[tuple[str, Array]]) -> None:
        """Factor levels given by name and rows."""
        self._Q = np.empty((0, self._n))  # its rows are the columns of the letter's Q
        self._levels = [_Held(name, A.copy(), self._projected(A)) for name, A in blocks]
        self._known: tuple[Array, Sizes] | None = None  # see `_ordered`

    @classmethod
    def of(cls, h: Hierarchy, settings: Tpm | None = None) -> Factorization:
        """Factor the rows of a hierarchy; pass its targets and reference to `solve`.

        Raises HierarchyError: it has a metric, or levels that give.
        """
        expect("Factorization.of: h", h, Hierarchy, "make one with Hierarchy.from_levels")
        h.refuse_extras("the hierarchy", "a factorization")
        return cls([A for A, _, _ in h.levels()], h.names, h.n, settings)

    # -- properties -------------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the levels, most important first."""
        return tuple(level.name for level in self._levels)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Rows of each level."""
        return tuple(len(level.A) for level in self._levels)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self._n

    @property
    def m(self) -> int:
        """Number of rows of all levels."""
        return sum(self.sizes)

    @property
    def rows(self) -> Array:
        """J (m, n) as given, in order of priority: a copy."""
        return np.concatenate([np.empty((0, self._n)), *(level.A for level in self._levels)])

    @property
    def basis(self) -> Array:
        """Q (n, r): a copy. It may still span rows of deleted levels."""
        return self._Q.T.copy()

    @property
    def coefficients(self) -> Array:
        """C (m, r) with J = C Q^T, in order of priority: a copy."""
        return self._ordered[0].copy()

    @property
    def ranks(self) -> tuple[int, ...]:
        """Rank that each level adds to the levels above it."""
        basis, ranks = np.empty((0, self._n)), list[int]()
        least = max(self._settings.rank_tolerance, CANCELLED)
        for level in self._levels:
            left = level.A / _unit(level.A)
            above, zero = len(basis), least * norm(left, axis=1)
            for _ in range(2):
                left -= (left @ basis.T) @ basis
            while len(basis) < min(above + len(left), self._n) and (
                    size := norm(left, axis=1) * (norm(left, axis=1) > zero)).any():
                q = left[size.argmax()] / size.max()
                left -= np.outer(left @ q, q)
                basis = np.vstack([basis, q])
            ranks.append(len(basis) - above)
        return tuple(ranks)

    @property
    def F(self) -> Array:  # noqa: N802
        """The Task Priority Matrix (m, m) in the current order, from C alone.

        Raises HierarchyError if the squares of the rows overflow.
        """
        return self._matrices()[0]

    @property
    def G(self) -> Array:  # noqa: N802
        """The map (n, m) = J^# F from targets to x, for a reference of zero."""
        return self._matrices()[1]

    # -- edits ------------------------------------------------------------------------------------

    def swap(self, i: Level, j: Level) -> None:
        """Swap two levels, given by name or by index from 0."""
        i, j, levels = self._place(i), self._place(j), [*self._levels]
        levels[i], levels[j] = levels[j], levels[i]
        self._levels, self._known = levels, None

    def reorder(self, order: Sequence[Level]) -> None:
        """Put all levels in a new order, given by name or by current index from 0.

        Raises HierarchyError unless each level occurs once.
        """
        expect("reorder: order", order, Iterable, "give a list of names or indices")
        places = [self._place(level) for level in order]
        if sorted(places) != list(range(len(self._levels))):
            raise HierarchyError(f"reorder needs each of {list(self.names)} once, got "
                                 f"{list(order)}")
        self._levels, self._known = [self._levels[place] for place in places], None

    def delete(self, level: Level) -> None:
        """Delete a level, given by name or by index from 0."""
        place = self._place(level)
        self._levels, self._known = self._levels[:place] + self._levels[place + 1:], None

    def insert(self, level: str, A: ArrayLike, at: int | None = None) -> None:
        """Insert a level with rows A (m_k, n) at an index, 0 the most important; None for last.

        Raises HierarchyError for a name already in use, an index outside 0 .. L, a wrong shape or
        an entry that is not finite; the factorization is then unchanged.
        """
        place = len(self._levels) if at is None else at
        level_names([*self.names, level], len(self._levels) + 1)
        if not isinstance(place, Integral) or not 0 <= place <= len(self._levels):
            raise HierarchyError(f"{level}: index {at!r} is outside 0 .. {len(self._levels)}")
        block = self._checked(level, A)
        if len(self._Q) > 2 * self.m + _FEWEST:  # most of it of deleted levels
            self._factor_afresh([(held.name, held.A) for held in self._levels])
        new = _Held(level, block.copy(), self._projected(block))
        self._levels = [*self._levels[:place], new, *self._levels[place:]]
        self._known = None

    # -- answers ----------------------------------------------------------------------------------

    def solve(self, targets: Targets, reference: ArrayLike | None = None) -> Resolution:
        """Return the x of `tpm` for these targets in the current order.

        If squares of the numbers overflow, x is zero with Status.NUMERICAL_FAILURE.

        targets : b (m,) in the current order; or b_k (m_k,) of each level by name, or in order.
        reference : (n,) or None for zero, the q0 of (14).

        Raises HierarchyError: a wrong shape or an entry that is not finite; names level, row and
        value.
        """
        (C, sizes), b = self._ordered, self._packed(targets)
        q0 = np.zeros(self._n) if reference is None else shaped("reference", reference, (self._n,))
        check_finite("reference", q0)
        y0 = self._Q @ q0
        y = y0.copy()
        code = run(entry(solve_by_staircase), C, b, b, sizes, y, self._settings._settings)
        if code == INACCURATE:
            return self._settings.solve(self.hierarchy(b, reference))  # by the exact engine
        x = q0 + (y - y0) @ self._Q  # (14)
        if code == SOLVED and np.isfinite(x).all():
            return Resolution(x)
        for i in np.flatnonzero(~np.isfinite(b))[:1]:
            h = Hierarchy.trusted(self.rows, b, b, self.sizes, names=self.names)
            raise HierarchyError(f"{place_of(h, i)}: target is {b[i]}")
        return Resolution(np.zeros(self._n), Status.NUMERICAL_FAILURE)

    def hierarchy(self, targets: Targets, reference: ArrayLike | None = None) -> Hierarchy:
        """Return the problem in the current order, for `certify` or another resolver."""
        b, q0 = self._packed(targets), None if reference is None else array_of("reference",
                                                                               reference)
        return Hierarchy(self.rows, b, b.copy(), self.sizes, q0, self.names)

    # -- internals --------------------------------------------------------------------------------

    def _place(self, level: Level) -> int:
        if isinstance(level, str):
            check_name("level", level, self.names)
            return self.names.index(level)
        if not isinstance(level, Integral) or not 0 <= level < len(self._levels):
            raise HierarchyError(f"index {level!r} is outside 0 .. {len(self._levels) - 1}")
        return level

    def _projected(self, A: Array) -> Array:
        """Return C (m_k, r) with A = C Q^T, after adding the new directions of A to the basis."""
        C = np.zeros((len(A), len(self._Q) + len(A)))
        for row, c in zip(A, C, strict=True):
            unit = _unit(row)
            w, r = row / unit, len(self._Q)
            size = norm(w)
            for _ in range(_PASSES):
                along = self._Q @ w
                c[:r] += along
                w -= along @ self._Q
            left = norm(w)
            if left > _OUTSIDE * size and r < self._n:
                c[r], self._Q = left, np.vstack([self._Q, w / left])
            c *= unit
        return C[:, :len(self._Q)]

    @property
    def _ordered(self) -> tuple[Array, Sizes]:
        """C and the sizes of the levels, in order of priority."""
        if self._known is None:
            sizes = np.array(self.sizes, dtype=np.int64)
            C, last = np.zeros((sizes.sum(), len(self._Q))), 0
            for _, _, own in self._levels:
                first, last = last, last + len(own)
                C[first:last, :own.shape[1]] = own
            self._known = C, sizes
        return self._known

    def _matrices(self) -> tuple[Array, Array]:
        """Return F and G."""
        (C, sizes), b = self._ordered, np.zeros(self.m)
        if not C.shape[1]:
            return np.zeros((self.m, self.m)), np.zeros((self._n, self.m))
        h = Hierarchy.trusted(C, b, b, sizes, np.zeros(C.shape[1]), self.names)
        found = task_priority_matrix(h, **asdict(self._settings))
        return found.F, np.asarray(self._Q.T @ found.G)

    def _checked(self, name: str, A: ArrayLike) -> Array:
        block = readable(f"{name}: A", A)
        if block.ndim != 2 or block.shape[1] != self._n or not self._n:
            raise HierarchyError(f"{name}: A has shape {block.shape}, expected "
                                 f"(rows, {self._n or 'n'})")
        check_rows(name, block, np.zeros(len(block)), np.zeros(len(block)))
        return block

    def _packed(self, targets: Targets) -> Array:
        """Return b (m,) in the current order."""
        if isinstance(targets, np.ndarray):
            m = len(self._ordered[0])
            if targets.shape != (m,):
                raise HierarchyError(f"targets have shape {targets.shape}, expected ({m},)")
            return readable("targets", targets)
        if isinstance(targets, Mapping):
            for name in targets:
                self._place(name)
            for name in self.names:
                refuse(name not in targets, f"{name}: no target given")
            targets = [targets[name] for name in self.names]
        expect("targets", targets, Sequence, "give b (m,), or b_k (m_k,) of each level")
        if len(targets) != len(self._levels):
            raise HierarchyError(f"{len(targets)} targets for {len(self._levels)} levels")
        return np.concatenate([np.empty(0), *(
            shaped(f"{level.name}: b", b, (len(level.A),))
            for level, b in zip(self._levels, targets, strict=True))])


def _unit(A: Array) -> float:
    """Return a power of two near the largest entry, in whose unit squares are numbers."""
    return math.ldexp(1.0, min(math.frexp(np.abs(A).max(initial=0.0))[1], 1023))
