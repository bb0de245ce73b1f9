"""The rows of a set-based task: its rate lies in the tangent cone of its set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.state import State
from hierarchy.task import Kind, Level, Task, Written


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
    name: str = field(init=False, repr=False, compare=False)
    kind: Kind = field(init=False, repr=False, compare=False, default="inequality")

    def __post_init__(self) -> None:
        if self.task.kind != "inequality":
            raise HierarchyError(f"task {self.task.name!r}: a set-based task has inequalities, got "
                                 f"kind = {self.task.kind!r}")
        set_frozen(self, name=self.task.name)

    @property
    def dimension(self) -> int:
        """One row per row of `task`."""
        return self.task.dimension

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

    def reference_velocity(self, state: State) -> Array:
        """The least rate (m,): that of the bound, -inf inside."""
        return np.where(self.error(state) >= 0.0, self.desired_velocity(state), -np.inf)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        if level != "velocity":
            raise HierarchyError(f"task {self.name!r}: set-based tasks are defined at velocity "
                                 f"level, got level = {level!r}")
        write_rows = self.task.writer(state, level, A, lower, upper, row)
        rows = slice(row, row + self.dimension)

        def write() -> None:
            write_rows()
            lower[rows], upper[rows] = self.reference_velocity(state), np.inf

        return write
