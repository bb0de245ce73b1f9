"""Joint torque limits as rows over the joint accelerations."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.jit import compiled
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Task, check_parts


@dataclass(frozen=True)
class TorqueLimits(Task):
    """Keep every joint torque within its limits: -limit <= M(q) a + h(q, v) <= limit.

    n rows, at acceleration level only. The limit is `fraction`, more than 0 and at most 1, of the
    robot's `effort_limit` [N m or N]; rows of joints without one have infinite bounds. The torques
    are those of the robot's model: rigid bodies, no friction, no payload.
    """

    robot: Robot
    fraction: float = 1.0
    name: str = "torque limits"
    limit: Array = field(init=False, repr=False, compare=False)  # (n,) [N m or N]
    kind = "inequality"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self)
        if not 0.0 < self.fraction <= 1.0:
            raise HierarchyError(f"task {self.name!r}: fraction {self.fraction} is not more than 0 "
                                 "and at most 1")
        if self.robot.base == "floating":
            raise HierarchyError(f"task {self.name!r}: robot {self.robot.name!r} has a floating "
                                 "base; its torques depend on contact forces, which are not known")
        object.__setattr__(self, "limit", self.fraction * self.robot.effort_limit)

    @property
    def dimension(self) -> int:
        """One row per joint."""
        return self.robot.n

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return tuple(self.robot.velocity_names)

    def error(self, state: State) -> Array:
        """Distance of the torque at constant velocity from the limits (n,) [N m or N]."""
        h = state.bias_effort()
        return np.asarray(np.clip(h, -self.limit, self.limit) - h)

    def jacobian(self, state: State) -> Array:
        """Mass matrix M(q) (n, n) [kg m^2]."""
        return state.mass_matrix()

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (n, n) [kg m^2/s]; no row uses it."""
        return state.mass_matrix_derivative()

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; HierarchyError at velocity level."""
        if level != "acceleration":
            raise HierarchyError(f"task {self.name!r}: torque limits need the acceleration level, "
                                 f"not {level!r}")
        return lambda: _write(state.mass_matrix(), state.bias_effort(), self.limit, A, lower, upper,
                              row)


@compiled
def _write(M, h, limit, A, lower, upper, row):
    for i in range(len(h)):
        for j in range(len(h)):
            A[row + i, j] = M[i, j]
        lower[row + i] = -limit[i] - h[i]
        upper[row + i] = limit[i] - h[i]
