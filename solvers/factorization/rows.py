"""The arrays of a `Factorization`: rows J, basis Q, coefficients C, and the staircase of C."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from solvers.kernels.factorization import (
    EXTRA_ROWS,
    factorization_work,
    project_rows,
    refactor,
    resolve,
    resolve_units,
)
from solvers.resolvers.tpm import Tpm
from solvers.status import Status

FEWEST = 8   # rows for which there is always room
_LEVELS = 16  # capacity of the first table
_ROUND = 4   # the width of a staircase is a multiple of this, to reallocate less often


class Held(NamedTuple):
    """A level that occupies rows `slot` .. `slot + rows - 1` of the arrays."""

    name: str
    slot: int
    rows: int


@final
class FactoredRows:
    """Rows in slots, factored as C Q^T, and the staircase of their levels.

    Attributes
    ----------
    J : (room, n) the rows as given; the first `used` are occupied.
    basis : (r, n) their directions.
    kept : number of levels, from the top, for which the staircase is up to date.
    """

    def __init__(self, n: int, room: int, settings: Tpm) -> None:
        widest = min(room, n)
        self._settings, self._r, self._width = settings, 0, 0
        self._numbers = np.array([settings.damping, settings.threshold, settings.rank_tolerance])
        self._Q = np.empty((widest + 1, n))  # its rows are the columns of the letter's Q
        self._C, self._squares = np.empty((room, _rounded_up(widest))), np.empty(room)
        self._pivots = np.empty(room, dtype=np.int64)
        self._room_of_table = np.empty((_LEVELS, 3), dtype=np.int64)  # slot, rows, rank so far
        self._table = self._room_of_table[:0]
        self._W, self._work = np.empty((0, 0)), np.empty(0)
        self.J, self.used, self.kept = np.empty((room, n)), 0, 0
        self.status = Status.SOLVED

    @property
    def basis(self) -> Array:
        """Q^T (r, n), a view."""
        return self._Q[:self._r]

    @property
    def coefficients(self) -> Array:
        """C (room, r), a view: the rows of J in the basis."""
        return self._C[:, :self._r]

    @property
    def ranks(self) -> NDArray[np.int64]:
        """Rank of each level with all above it: (L,), a view."""
        return self._table[:, 2]

    def append(self, blocks: Iterable[tuple[str, Array]]) -> list[Held]:
        """Put levels into the next slots, and add their new directions to the basis."""
        held, slot = [], self.used
        for name, block in blocks:
            held.append(Held(name, slot, len(block)))
            self.J[slot:slot + len(block)] = block
            slot += len(block)
        self._r = project_rows(self.J, self.used, slot, self._r, self._Q, self._C, self._squares)
        self.used = slot
        if _rounded_up(self._r) > self._width:
            self._widen(_rounded_up(self._r))
        return held

    def rows(self, level: Held) -> Array:
        """Return the rows of a level as given (m_k, n), a view."""
        return self.J[level.slot:level.slot + level.rows]

    def refactor(self, levels: Sequence[Held]) -> Status:
        """Add the levels below the kept ones to the staircase."""
        count = len(levels)
        if self.kept < count or self.status is Status.NUMERICAL_FAILURE:
            self._list(levels, self.kept)
            self.status = Status(refactor(
                self._C, self._squares, self._table, self.kept, self._W, self._pivots,
                self._settings.rank_tolerance, self._work))
            self.kept = 0 if self.status is Status.NUMERICAL_FAILURE else count
        elif len(self._table) > count:
            self._table = self._table[:count]
        return self.status

    def resolve(self, b: Array, x: Array) -> int:
        """Replace the reference in x (n,) by the answer for targets b (m,); return a code."""
        return int(resolve(b, x, self.basis, self._table, self._W, self._pivots,
                           self._numbers, self._work))

    def units(self, m: int) -> Array:
        """Return the answers to the m unit targets, in coordinates of the basis: (m, r)."""
        Z = np.empty((m, self._width))
        resolve_units(Z, self._table, self._W, self._pivots, self._numbers, self._work)
        return Z[:, :self._r]

    def _list(self, levels: Sequence[Held], kept: int) -> None:
        """Write the levels from `kept` on into the table."""
        if len(levels) > len(self._room_of_table):
            more = np.empty((2 * len(levels), 3), dtype=np.int64)
            more[:kept] = self._room_of_table[:kept]
            self._room_of_table = more
        self._table = table = self._room_of_table[:len(levels)]
        for k in range(kept, len(levels)):
            _, table[k, 0], table[k, 1] = levels[k]

    def _widen(self, width: int) -> None:
        """Make room for a wider basis; factored rows get zeros in the new columns."""
        old, before, room = self._W, self._width, len(self.J)
        self._W, self._width = np.zeros((room + width + EXTRA_ROWS, width)), width
        if before:
            self._W[:room + before, :before] = old[:room + before]
        self._work = np.empty(factorization_work(room, width))


def _rounded_up(width: int) -> int:
    return max(-(-width // _ROUND), 1) * _ROUND
