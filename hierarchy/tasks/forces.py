"""What tasks over accelerations and contact forces have in common."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from hierarchy.contacts import Contacts
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Written


class ForceTask(Written):
    """m rows over x = (a, f), the unknowns of `contacts`, at level "torque". Abstract.

    Such rows have no task variable and no gains: they say what x must satisfy. A new one needs
    `dimension` and `writer`, see `Task.writer`; A then has n + 3 p columns.
    """

    of_forces: ClassVar[bool] = True
    scale = 3.0  # N
    contacts: Contacts

    def error(self, state: State) -> Array:
        """The residual at x = 0 (m,), in the unit of the rows."""
        _, lower, upper = self.rows(state)
        return np.asarray(np.clip(0.0, lower, upper))


class FixedRows(ForceTask):
    """Rows over forces that do not change with the state. Abstract: needs `forces` and `sides`."""

    @property
    @abstractmethod
    def forces(self) -> Array:
        """The rows over the forces (m, 3 p)."""

    @property
    @abstractmethod
    def sides(self) -> tuple[Array, Array]:
        """Their lower and upper sides (m,), (m,)."""

    @property
    def dimension(self) -> int:
        """One row for each of `forces`."""
        return len(self.forces)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        rows = np.hstack([np.zeros((self.dimension, state.n)), self.forces])
        return bind(_copy, rows, *self.sides, A, lower, upper, row)


def required(contacts: Contacts, task: str) -> Contacts:
    """Return contacts that are at least one; HierarchyError, naming the task, if there is none."""
    if not contacts.contacts:
        raise HierarchyError(f"task {task!r}: there are no contacts")
    return contacts


@compiled
def _copy(rows, low, up, A, lower, upper, row):
    for i in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            A[row + i, c] = rows[i, c]
        lower[row + i], upper[row + i] = low[i], up[i]
