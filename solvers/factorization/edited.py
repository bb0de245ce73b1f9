"""A factored stack whose priorities change at a cost that does not grow with the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.problem import Array, Hierarchy, check_rows
from solvers.factorization.rows import FEWEST, FactoredRows, Held
from solvers.resolver import Resolution
from solvers.resolvers.tpm import Tpm
from solvers.status import Status

Level = int | str
Targets = Array | Mapping[str, ArrayLike] | Sequence[ArrayLike]


@final
class Factorization:
    """Levels of equalities J x = b, kept as J = C Q^T while their priorities change.

    Q (n, r) is an orthonormal basis of the space of all rows, C (m, r) their coefficients. A swap,
    a reorder and a delete work on C alone, from the first level that changes on: their cost does
    not depend on n. An insert projects its own rows on Q, O(n r) each. A solve is that of `tpm`,
    O(m r), and one product with Q, O(n r); rank decisions and damping are those of its `settings`.
    Work waits for the next solve, so several edits cost one.

    What is deleted stays in the basis, which then is wider than the rows need. An insert that
    leaves more than 2 m + 8 rows in it, or finds no room, factors all rows afresh, O(m n r).

    Parameters
    ----------
    levels : A_k (m_k, n) of each level, most important first.
    names : a name a level; None for "level 1", "level 2", ...
    n : number of unknowns; None takes it from the first level.
    settings : of `tpm` in its staircase form; None for its defaults.

    Raises
    ------
    HierarchyError : a wrong shape, an entry that is not finite, a name that is there twice, no n,
        or the published form; names level, row and value.

    Source: the letter, (7)-(11), and its text on swap, insertion and deletion, corrected for ranks.
    """

    def __init__(self, levels: Sequence[ArrayLike], names: Sequence[str] | None = None,
                 n: int | None = None, settings: Tpm | None = None) -> None:
        self._settings = Tpm() if settings is None else settings
        if self._settings.form != "staircase":
            raise HierarchyError("a factorization is of the staircase form of tpm, got form = "
                                 f"{self._settings.form!r}")
        names = [f"level {k + 1}" for k in range(len(levels))] if names is None else list(names)
        if len(names) != len(levels):
            raise HierarchyError(f"{len(names)} names for {len(levels)} levels")
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise HierarchyError(f"{twice[0]}: two levels of this name")
        if n is None and not levels:
            raise HierarchyError("no levels and no n: the number of unknowns is not known")
        self._n = int(np.shape(levels[0])[-1] if np.ndim(levels[0]) == 2 else 0) if n is None else n
        self._levels: list[Held] = []
        blocks = [self._checked(*level) for level in zip(names, levels, strict=True)]
        self._factor_afresh(list(zip(names, blocks, strict=True)))

    @classmethod
    def of(cls, h: Hierarchy, settings: Tpm | None = None) -> Factorization:
        """Factor the rows of a hierarchy; its targets and reference are left to `solve`."""
        return cls([A for A, _, _ in h.levels()], h.names, h.n, settings)

    # -- what is there ----------------------------------------------------------------------------

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
        return self._data.J[self._slots()]

    @property
    def basis(self) -> Array:
        """Q (n, r): a copy. Deleted levels may still have a part in it."""
        return self._data.basis.T.copy()

    @property
    def coefficients(self) -> Array:
        """C (m, r) with J = C Q^T, in order of priority: a copy."""
        return self._data.coefficients[self._slots()]

    @property
    def ranks(self) -> tuple[int, ...]:
        """What each level adds to the rank of those above it."""
        self.update()
        return tuple(np.diff(self._data.ranks, prepend=0).tolist())

    @property
    def F(self) -> Array:  # noqa: N802
        """The Task Priority Matrix (m, m) in the present order: F = C Z^T, from C alone.

        Z (m, r) has the answers to targets that are 1, one at a time, in coordinates of Q.
        Raises HierarchyError where the rows are so large that their squares overflow.
        """
        return np.asarray(self.coefficients @ self._units().T)

    @property
    def G(self) -> Array:  # noqa: N802
        """The map (n, m) = J^# F from targets to x, for a reference of zero: G = Q Z^T, see `F`."""
        return np.asarray((self._units() @ self._data.basis).T)

    # -- edits ------------------------------------------------------------------------------------

    def swap(self, i: Level, j: Level) -> None:
        """Exchange the places of two levels, given by name or by place from 0."""
        i, j = self._place(i), self._place(j)
        levels = self._levels
        levels[i], levels[j] = levels[j], levels[i]
        if i != j:
            self._changed(min(i, j))

    def reorder(self, order: Sequence[Level]) -> None:
        """Put all levels in a new order, named or by their places until now, from 0.

        Raises HierarchyError unless each is there once.
        """
        places = [self._place(level) for level in order]
        if sorted(places) != list(range(len(self._levels))):
            raise HierarchyError(f"reorder needs each of {list(self.names)} once, got "
                                 f"{list(order)}")
        self._levels = [self._levels[place] for place in places]
        self._changed(next((k for k, place in enumerate(places) if k != place), len(places)))

    def delete(self, level: Level) -> None:
        """Take a level out, by name or by place from 0."""
        place = self._place(level)
        self._m -= self._levels.pop(place).rows
        self._changed(place)

    def insert(self, level: str, A: ArrayLike, at: int | None = None) -> None:
        """Put a level with rows A (m_k, n) at a place, 0 being the most important; None for last.

        Raises HierarchyError: a name that is there already, a place outside 0 .. L, a wrong shape,
        an entry that is not finite; the factorization is then as before.
        """
        place = len(self._levels) if at is None else at
        if any(held.name == level for held in self._levels):
            raise HierarchyError(f"{level}: there is a level of this name")
        if not 0 <= place <= len(self._levels):
            raise HierarchyError(f"{level}: place {at} is outside 0 .. {len(self._levels)}")
        block = self._checked(level, A)
        used = self._data.used + len(block)
        if used > len(self._data.J) or used > 2 * (self._m + len(block)) + FEWEST:
            self._factor_afresh([(held.name, self._data.rows(held)) for held in self._levels],
                                len(block))
        self._levels[place:place] = self._data.append([(level, block)])
        self._m += len(block)
        self._changed(place)

    def update(self) -> Status:
        """Do now what the next solve would do first: refactor C from the first changed level on."""
        return self._data.refactor(self._levels)

    # -- answers ----------------------------------------------------------------------------------

    def solve(self, targets: Targets, reference: ArrayLike | None = None) -> Resolution:
        """Return the x of `tpm` for these targets in the present order.

        Parameters
        ----------
        targets : b (m,) in the present order; or b_k (m_k,) of each level by name, or in order.
        reference : (n,) or None for zero, the q0 of (14).

        Status.NUMERICAL_FAILURE: numbers so large that their squares overflow; x is zero.

        Raises
        ------
        HierarchyError : a wrong shape or an entry that is not finite; names level, row and value.
        """
        b, x = self._packed(targets), self._reference(reference)
        if self.update() is not Status.SOLVED:
            return Resolution(np.zeros(self._n), self._data.status)
        code = self._data.resolve(b, x)
        if code < 0:
            self._refuse(b, x, -code - 1)
        return Resolution(x, Status(code))

    def hierarchy(self, targets: Targets, reference: ArrayLike | None = None) -> Hierarchy:
        """Return the same problem in the present order, for `certify` or another resolver."""
        b = self._packed(targets)
        return Hierarchy(self.rows, b, b.copy(), np.array(self.sizes, dtype=np.int64),
                         self._reference(reference), self.names)

    # -- inside -----------------------------------------------------------------------------------

    def _place(self, level: Level) -> int:
        if isinstance(level, str):
            for k, held in enumerate(self._levels):
                if held.name == level:
                    return k
            raise UnknownNameError("level", level, self.names)
        if not 0 <= level < len(self._levels):
            raise HierarchyError(f"place {level} is outside 0 .. {len(self._levels) - 1}")
        return level

    def _changed(self, place: int) -> None:
        self._data.kept = min(self._data.kept, place)

    def _slots(self) -> list[int]:
        return [i for _, slot, rows in self._levels for i in range(slot, slot + rows)]

    def _factor_afresh(self, blocks: list[tuple[str, Array]], more: int = 0) -> None:
        """Factor levels given by name and rows, with room for as many rows again and `more`."""
        self._m = sum(len(block) for _, block in blocks)
        self._data = FactoredRows(self._n, max(2 * (self._m + more), FEWEST), self._settings)
        self._levels = self._data.append(blocks)

    def _units(self) -> Array:
        if self.update() is not Status.SOLVED:
            raise HierarchyError(f"no task priority matrix: {self._data.status}")
        return self._data.units(self._m)

    def _checked(self, name: str, A: ArrayLike) -> Array:
        block = _array(f"{name}: A", A)
        if block.ndim != 2 or block.shape[1] != self._n or self._n < 1:
            raise HierarchyError(f"{name}: A has shape {block.shape}, expected (rows, "
                                 f"{self._n if self._n > 0 else 'n'})")
        if not np.isfinite(block).all():
            check_rows(name, block, np.zeros(len(block)), np.zeros(len(block)))
        return block

    def _reference(self, reference: ArrayLike | None) -> Array:
        x = np.zeros(self._n) if reference is None else _array("reference", reference).copy()
        if x.shape != (self._n,):
            raise HierarchyError(f"reference has shape {x.shape}, expected ({self._n},)")
        return x

    def _packed(self, targets: Targets) -> Array:
        """b (m,) in the present order."""
        if isinstance(targets, np.ndarray) and targets.ndim == 1:
            if targets.shape != (self._m,):
                raise HierarchyError(f"targets have shape {targets.shape}, expected ({self._m},)")
            return np.ascontiguousarray(targets, dtype=np.float64)
        if isinstance(targets, Mapping):
            targets = self._in_order(targets)
        if len(targets) != len(self._levels):
            raise HierarchyError(f"{len(targets)} targets for {len(self._levels)} levels")
        parts = [_array(f"{level.name}: b", b)
                 for level, b in zip(self._levels, targets, strict=True)]
        for level, b in zip(self._levels, parts, strict=True):
            if b.shape != (level.rows,):
                raise HierarchyError(f"{level.name}: b has shape {b.shape}, expected "
                                     f"({level.rows},)")
        return np.concatenate([np.empty(0), *parts])

    def _in_order(self, targets: Mapping[str, ArrayLike]) -> list[ArrayLike]:
        for name in targets:
            self._place(name)
        for name in self.names:
            if name not in targets:
                raise HierarchyError(f"{name}: no target is given")
        return [targets[name] for name in self.names]

    def _refuse(self, b: Array, x: Array, i: int) -> None:
        """Name the target, or behind all targets the entry of the reference, that is bad."""
        if i >= len(b):
            raise HierarchyError(f"reference, entry {i - len(b)}: {x[i - len(b)]} is not finite")
        row = i
        for level in self._levels:
            if row < level.rows:
                raise HierarchyError(f"{level.name}, row {row}: target is {b[i]}")
            row -= level.rows


def _array(what: str, value: ArrayLike) -> Array:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise HierarchyError(f"{what} is not an array of numbers") from error
