"""Tasks that are made of others: several as one level, and the rows of a set-based one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hierarchy.contacts import Contacts
from hierarchy.errors import expect, expect_each
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, Written, in_turn, writer_in_stack


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
        self.refuse(not self.tasks, "there are no tasks in it")
        for task in self.tasks:
            self.refuse(task.of_forces and task.contacts is not self.contacts,
                        "its tasks have different contacts; give all of them the same object")

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
    def row_names(self) -> tuple[str, ...]:
        """Task and row of each row."""
        return tuple(f"{task.name} {row}" for task in self.tasks for row in task.row_names)

    def error_reader(self, state: State) -> Callable[[], Array]:
        """See `Task.error_reader`: the errors of the tasks (m,)."""
        readers = [task.error_reader(state) for task in self.tasks]
        return lambda: np.hstack([read() for read in readers])  # of one row maybe a number

    def desired_velocity(self, state: State) -> Array:
        """Those of the tasks (m,), which `solve_ik` with `until` leaves out of the rows."""
        return np.hstack([task.desired_velocity(state) for task in self.tasks])

    def desired_acceleration(self, state: State) -> Array:
        """Those of the tasks (m,)."""
        return np.hstack([task.desired_acceleration(state) for task in self.tasks])

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        parts = rows.split([task.dimension for task in self.tasks])
        return in_turn(*(writer_in_stack(task, state, level, part)
                         for task, part in zip(self.tasks, parts, strict=True)))


@dataclass(frozen=True)
class TangentCone(Written):
    """Keep an inequality task in its set by its rate alone, at velocity level.

    A row of `task` whose error is negative, strictly inside, has no bounds; one on the bound or
    beyond it asks that the task does not get worse, J v >= dp_d/dt. These are the extended tangent
    cones that `in_T_RC` of the source tests, as rows; `solvers.resolvers.set_based` resolves them
    as the source does. `task` has rows with a lower bound only, and an error that is positive where
    it is violated, as `Pointing`, `Separation` and `SelfSeparation` have.

    Raises HierarchyError if `task` is an equality, and from its writer at acceleration level: there
    a task reaches its bound with a rate that no acceleration can take away at once.

    Source: Moe, Antonelli, Teel, Pettersen, Schrimpf, "Set-Based Tasks within the
    Singularity-Robust Multiple Task-Priority Inverse Kinematics Framework", Frontiers in Robotics
    and AI 3:16 (2016).
    """

    task: Task
    kind = "inequality"

    def __post_init__(self) -> None:
        expect("set-based task", self.task, Task, "see hierarchy.tasks")
        self.task.refuse(self.task.kind != "inequality", "a set-based task has inequalities, got "
                         f"kind = {self.task.kind!r}")
        set_frozen(self, name=self.task.name)

    @property
    def row_names(self) -> tuple[str, ...]:
        """The names of the rows of `task`."""
        return self.task.row_names

    def error(self, state: State) -> Array:
        """The error of `task` (m,)."""
        return self.task.error(state)

    def desired_velocity(self, state: State) -> Array:
        """The rate (m,) at which the bound of `task` moves."""
        return self.task.desired_velocity(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        self.refuse(level != "velocity", "set-based tasks are defined at velocity level, got "
                    f"level = {level!r}")

        def bound() -> None:
            inside = self.error(state) < 0.0
            rows.lower[:] = np.where(inside, -np.inf, self.desired_velocity(state))
            rows.upper[:] = np.inf

        return in_turn(self.task.writer(state, level, rows), bound)
