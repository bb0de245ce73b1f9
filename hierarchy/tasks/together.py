"""Several tasks as one level of a stack."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hierarchy.contacts import Contacts
from hierarchy.errors import HierarchyError, expect_each
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Task, Written, writer_in_stack


@dataclass(frozen=True)
class Together(Written):
    """The rows of several tasks as one level: m is the sum of theirs.

    What cannot all be met is missed by the smallest sum of squares over all rows, so the rows
    should share a unit, or be ones that can be met together. Raises HierarchyError for no tasks, or
    contact forces of different contacts.
    """

    tasks: Sequence[Task]
    name: str = "together"

    def __post_init__(self) -> None:
        super().__post_init__()
        expect_each(f"task {self.name!r}: tasks", self.tasks, Task, "see hierarchy.tasks")
        if not self.tasks:
            raise HierarchyError(f"task {self.name!r}: there are no tasks in it")
        for task in self.tasks:
            if task.of_forces and task.contacts is not self.contacts:
                raise HierarchyError(f"task {self.name!r}: its tasks have different contacts; give "
                                     "all of them the same object")

    def on(self, robot: Robot) -> Task:
        """Return the task with its tasks for a robot."""
        return replace(self, tasks=[task.on(robot) for task in self.tasks])

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether every task is."""
        return all(task.straight for task in self.tasks)

    @property
    def of_forces(self) -> bool:  # type: ignore[override]
        """Whether contact forces enter any row."""
        return any(task.of_forces for task in self.tasks)

    @property
    def contacts(self) -> Contacts | None:  # type: ignore[override]
        """Those of the tasks."""
        return next((task.contacts for task in self.tasks if task.of_forces), None)

    @property
    def dimension(self) -> int:
        """The rows of all tasks."""
        return sum(task.dimension for task in self.tasks)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Task and row of each row."""
        return tuple(f"{task.name} {row}" for task in self.tasks for row in task.row_names)

    def error(self, state: State) -> Array:
        """The errors of the tasks (m,)."""
        return np.concatenate([task.error(state) for task in self.tasks])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        writers = []
        for task in self.tasks:
            writers.append(writer_in_stack(task, state, level, A, lower, upper, row))
            row += task.dimension

        def write() -> None:
            for write_rows in writers:
                write_rows()

        return write
