"""A position task in some directions only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.errors import HierarchyError, expect
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Written
from hierarchy.tasks.position import Position


@dataclass(frozen=True)
class Along(Written):
    """The rows of a position task along `directions` (m, 3) of the world, m = 1, 2 or 3 [m].

    A hand that slides on a table is moved along two of them and pushes along the third. The gains
    are those of `task`. Raises HierarchyError unless the directions are of length one and
    orthogonal.
    """

    task: Position
    directions: Sequence[Sequence[float]]
    name: str = "along"

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"task {self.name!r}: task", self.task, Position, "give a position task")
        try:
            D = np.array(self.directions, dtype=float)
        except (TypeError, ValueError):
            D = np.empty(0)
        if D.ndim != 2 or D.shape[1:] != (3,) or not np.allclose(D @ D.T, np.eye(len(D))):
            raise HierarchyError(f"task {self.name!r}: directions {self.directions!r} are not of "
                                 "length one and orthogonal, (m, 3)")

    @property
    def dimension(self) -> int:
        """One row per direction."""
        return len(self.directions)

    def error(self, state: State) -> Array:
        """Distance to the path along the directions (m,) [m]."""
        return np.asarray(self.directions) @ self.task.error(state)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        rows, b, above = np.zeros((3, A.shape[1])), np.zeros(3), np.zeros(3)
        write_rows = self.task.writer(state, level, rows, b, above, 0)
        own, D = slice(row, row + self.dimension), np.array(self.directions, dtype=float)

        def write() -> None:
            write_rows()
            A[own] = D @ rows
            lower[own] = upper[own] = D @ b

        return write
