"""A factored stack whose priorities change at a cost independent of the number of joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, UnknownNameError, expect
from hierarchy.gate import check_rows, level_names, readable, shaped
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.factorization import (
    EXTRA_ROWS,
    factorization_work,
    project_rows,
    refactor,
    resolve,
    resolve_units,
)
from solvers.resolver import Resolution
from solvers.resolvers.tpm import Tpm
from solvers.status import Status

_FEWEST = 8  # rows for which there is always room
_ROUND = 4   # the width of a staircase is a multiple of this, to reallocate less often

Level = int | str
Targets = Array | Mapping[str, ArrayLike] | Sequence[ArrayLike]


class _Held(NamedTuple):
    """A level that occupies rows `slot` .. `slot + rows - 1` of the arrays."""

    name: str
    slot: int
    rows: int


@final
class Factorization:
    """Levels of equalities J x = b, factored as J = C Q^T while their priorities change.

    Swap, reorder and delete work on C (m, r) alone, from the first changed level on, so their cost
    does not depend on n; insert projects its rows on the basis Q (n, r). The next solve does the
    work, so several edits cost one. It gives the x of `tpm` with the same settings, and leaves
    nearly parallel rows and rows far lighter than others to it. Costs and the treatment of deleted
    rows: docs/factorization.md.

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
        elif not isinstance(n, Integral) or n < 1:
            raise HierarchyError(f"n = {n!r}, expected a whole number >= 1")
        self._n = int(n)
        self._factor_afresh([(name, self._checked(name, A))
                             for name, A in zip(names, levels, strict=True)])

    def _factor_afresh(self, blocks: list[tuple[str, Array]], more: int = 0) -> None:
        """Factor levels given by name and rows, with room for twice these and `more` rows."""
        self._m = sum(len(block) for _, block in blocks)
        room = max(2 * (self._m + more), _FEWEST)
        widest = min(room, self._n)
        self._J, self._used, self._r, self._width = np.empty((room, self._n)), 0, 0, 0
        self._Q = np.empty((widest + 1, self._n))  # its rows are the columns of the letter's Q
        self._C, self._squares = np.empty((room, _rounded_up(widest))), np.empty(room)
        self._pivots = np.empty(room, dtype=np.int64)
        self._table = np.empty((0, 3), dtype=np.int64)  # of the levels above `kept`
        self._W, self._work, self._kept = np.empty((0, 0)), np.empty(0), 0
        self._status = Status.SOLVED
        self._levels = self._append(blocks)

    @classmethod
    def of(cls, h: Hierarchy, settings: Tpm | None = None) -> Factorization:
        """Factor the rows of a hierarchy; pass its targets and reference to `solve`."""
        return cls([A for A, _, _ in h.levels()], h.names, h.n, settings)

    # -- properties -------------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the levels, most important first."""
        return tuple(level.name for level in self._levels)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Rows of each level."""
        return tuple(level.rows for level in self._levels)

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return self._n

    @property
    def m(self) -> int:
        """Number of rows of all levels."""
        return self._m

    @property
    def rows(self) -> Array:
        """J (m, n) as given, in order of priority: a copy."""
        return self._J[self._slots()]

    @property
    def basis(self) -> Array:
        """Q (n, r): a copy. It may still span rows of deleted levels."""
        return self._basis.T.copy()

    @property
    def coefficients(self) -> Array:
        """C (m, r) with J = C Q^T, in order of priority: a copy."""
        return self._C[self._slots(), :self._r]

    @property
    def ranks(self) -> tuple[int, ...]:
        """Rank that each level adds to the levels above it."""
        self.update()
        return tuple(np.diff(self._table[:, 2], prepend=0).tolist())

    @property
    def F(self) -> Array:  # noqa: N802
        """The Task Priority Matrix (m, m) in the current order: F = C Z^T, from C alone.

        Row i of Z (m, r) is the answer to unit target i, in coordinates of Q. Raises HierarchyError
        if the squares of the rows overflow.
        """
        return np.asarray(self.coefficients @ self._units().T)

    @property
    def G(self) -> Array:  # noqa: N802
        """The map (n, m) = J^# F from targets to x, for a reference of zero: G = Q Z^T, see `F`."""
        return np.asarray((self._units() @ self._basis).T)

    # -- edits ------------------------------------------------------------------------------------

    def swap(self, i: Level, j: Level) -> None:
        """Swap two levels, given by name or by index from 0."""
        i, j = self._place(i), self._place(j)
        levels = self._levels
        levels[i], levels[j] = levels[j], levels[i]
        if i != j:
            self._changed(min(i, j))

    def reorder(self, order: Sequence[Level]) -> None:
        """Put all levels in a new order, given by name or by current index from 0.

        Raises HierarchyError unless each level occurs once.
        """
        places = [self._place(level) for level in order]
        if sorted(places) != list(range(len(self._levels))):
            raise HierarchyError(f"reorder needs each of {list(self.names)} once, got "
                                 f"{list(order)}")
        self._levels = [self._levels[place] for place in places]
        self._changed(next((k for k, place in enumerate(places) if k != place), len(places)))

    def delete(self, level: Level) -> None:
        """Delete a level, given by name or by index from 0."""
        place = self._place(level)
        self._m -= self._levels.pop(place).rows
        self._changed(place)

    def insert(self, level: str, A: ArrayLike, at: int | None = None) -> None:
        """Insert a level with rows A (m_k, n) at an index, 0 the most important; None for last.

        Raises HierarchyError for a name already in use, an index outside 0 .. L, a wrong shape or
        an entry that is not finite; the factorization is then unchanged.
        """
        place = len(self._levels) if at is None else at
        if any(held.name == level for held in self._levels):
            raise HierarchyError(f"{level}: a level of this name exists")
        if not isinstance(place, Integral) or not 0 <= place <= len(self._levels):
            raise HierarchyError(f"{level}: index {at} is outside 0 .. {len(self._levels)}")
        block = self._checked(level, A)
        used = self._used + len(block)
        if used > len(self._J) or used > 2 * (self._m + len(block)) + _FEWEST:
            self._factor_afresh([(held.name, self._J[held.slot:held.slot + held.rows])
                                 for held in self._levels], len(block))
        self._levels[place:place] = self._append([(level, block)])
        self._m += len(block)
        self._changed(place)

    def update(self) -> Status:
        """Refactor C from the first changed level on, now rather than at the next solve."""
        count, kept = len(self._levels), self._kept
        if kept < count or self._status is Status.NUMERICAL_FAILURE:
            table = self._table  # slot, rows, rank so far
            if len(table) != count:
                table = np.vstack([table[:kept], np.empty((count - kept, 3), dtype=np.int64)])
            for k in range(kept, count):
                _, table[k, 0], table[k, 1] = self._levels[k]
            self._table = table
            self._status = Status(refactor(
                self._C, self._squares, table, kept, self._W, self._pivots,
                self._settings.rank_tolerance, self._work))
            self._kept = 0 if self._status is Status.NUMERICAL_FAILURE else count
        self._table = self._table[:count]
        return self._status

    # -- answers ----------------------------------------------------------------------------------

    def solve(self, targets: Targets, reference: ArrayLike | None = None) -> Resolution:
        """Return the x of `tpm` for these targets in the current order.

        If squares of the numbers overflow, x is zero with Status.NUMERICAL_FAILURE.

        Parameters
        ----------
        targets : b (m,) in the current order; or b_k (m_k,) of each level by name, or in order.
        reference : (n,) or None for zero, the q0 of (14).

        Raises
        ------
        HierarchyError : a wrong shape or an entry that is not finite; names level, row and value.
        """
        b, x = self._packed(targets), self._reference(reference)
        status = self.update()
        if status is Status.NUMERICAL_FAILURE:
            return Resolution(np.zeros(self._n), status)
        code = int(resolve(b, x, self._basis, self._table, self._W, self._pivots,
                           self._settings._settings, self._work))
        if code < 0:
            self._refuse(b, x, -code - 1)
        if status is Status.INACCURATE and self._settings.damping == 0.0:
            return self._settings.solve(self.hierarchy(b, reference))  # by the exact engine
        return Resolution(x, Status(code))

    def hierarchy(self, targets: Targets, reference: ArrayLike | None = None) -> Hierarchy:
        """Return the problem in the current order, for `certify` or another resolver."""
        b = self._packed(targets)
        return Hierarchy(self.rows, b, b.copy(), self.sizes, self._reference(reference), self.names)

    # -- internals --------------------------------------------------------------------------------

    def _place(self, level: Level) -> int:
        if isinstance(level, str):
            for k, held in enumerate(self._levels):
                if held.name == level:
                    return k
            raise UnknownNameError("level", level, self.names)
        if not isinstance(level, Integral) or not 0 <= level < len(self._levels):
            raise HierarchyError(f"index {level} is outside 0 .. {len(self._levels) - 1}")
        return level

    def _changed(self, place: int) -> None:
        self._kept = min(self._kept, place)

    def _slots(self) -> list[int]:
        return [i for _, slot, rows in self._levels for i in range(slot, slot + rows)]

    def _append(self, blocks: list[tuple[str, Array]]) -> list[_Held]:
        """Put levels into the next slots, and add their new directions to the basis."""
        held, slot = [], self._used
        for name, block in blocks:
            held.append(_Held(name, slot, len(block)))
            self._J[slot:slot + len(block)] = block
            slot += len(block)
        self._r = project_rows(self._J, self._used, slot, self._r, self._Q, self._C, self._squares)
        self._used = slot
        if _rounded_up(self._r) > self._width:
            self._widen(_rounded_up(self._r))
        return held

    def _widen(self, width: int) -> None:
        """Make room for a wider basis; factored rows get zeros in the new columns."""
        old, before, room = self._W, self._width, len(self._J)
        self._W, self._width = np.zeros((room + width + EXTRA_ROWS, width)), width
        if before:
            self._W[:room + before, :before] = old[:room + before]
        self._work = np.empty(factorization_work(room, width))

    @property
    def _basis(self) -> Array:
        """Q^T (r, n), a view."""
        return self._Q[:self._r]

    def _units(self) -> Array:
        """Return the answers to the m unit targets, in coordinates of the basis: (m, r)."""
        if self.update() is Status.NUMERICAL_FAILURE:
            raise HierarchyError(f"no task priority matrix: {self._status}")
        Z = np.empty((self._m, self._width))
        resolve_units(Z, self._table, self._W, self._pivots, self._settings._settings, self._work)
        return Z[:, :self._r]

    def _checked(self, name: str, A: ArrayLike) -> Array:
        block = readable(f"{name}: A", A)
        if block.ndim != 2 or block.shape[1] != self._n or self._n < 1:
            raise HierarchyError(f"{name}: A has shape {block.shape}, expected (rows, "
                                 f"{self._n if self._n > 0 else 'n'})")
        if not np.isfinite(block).all():
            check_rows(name, block, np.zeros(len(block)), np.zeros(len(block)))
        return block

    def _reference(self, reference: ArrayLike | None) -> Array:
        if reference is None:
            return np.zeros(self._n)
        return shaped("reference", reference, (self._n,)).copy()

    def _packed(self, targets: Targets) -> Array:
        """Return b (m,) in the current order."""
        if isinstance(targets, np.ndarray) and targets.ndim < 2:
            if targets.shape != (self._m,):
                raise HierarchyError(f"targets have shape {targets.shape}, expected ({self._m},)")
            return readable("targets", targets)
        if isinstance(targets, Mapping):
            targets = self._in_order(targets)
        elif isinstance(targets, np.ndarray):
            targets = [*targets]
        expect("targets", targets, Sequence, "give b (m,), or b_k (m_k,) of each level")
        if len(targets) != len(self._levels):
            raise HierarchyError(f"{len(targets)} targets for {len(self._levels)} levels")
        return np.concatenate([np.empty(0), *(
            shaped(f"{level.name}: b", b, (level.rows,))
            for level, b in zip(self._levels, targets, strict=True))])

    def _in_order(self, targets: Mapping[str, ArrayLike]) -> list[ArrayLike]:
        for name in targets:
            self._place(name)
        for name in self.names:
            if name not in targets:
                raise HierarchyError(f"{name}: no target given")
        return [targets[name] for name in self.names]

    def _refuse(self, b: Array, x: Array, i: int) -> None:
        """Raise a HierarchyError that names the invalid target or entry of the reference."""
        if i >= len(b):
            raise HierarchyError(f"reference, entry {i - len(b)}: {x[i - len(b)]} is not finite")
        row = i
        for level in self._levels:
            if row < level.rows:
                raise HierarchyError(f"{level.name}, row {row}: target is {b[i]}")
            row -= level.rows


def _rounded_up(width: int) -> int:
    return max(-(-width // _ROUND), 1) * _ROUND
