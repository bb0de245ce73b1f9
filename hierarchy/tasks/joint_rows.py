"""What tasks with a row for every joint share."""

from __future__ import annotations

import numpy as np

from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Task


class JointRows(Task):
    """A task with one row per actuated joint of `robot`."""

    robot: Robot
    straight = True

    @property
    def dimension(self) -> int:
        """One row per actuated joint."""
        return self.robot.n - self.robot.actuated

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return tuple(self.robot.velocity_names[self.robot.actuated:])

    def jacobian(self, state: State) -> Array:
        """The identity (m, n), right of zeros for a floating base."""
        return np.eye(state.n)[self.robot.actuated:]

    def jacobian_derivative(self, state: State) -> Array:
        """Zero (m, n)."""
        return np.zeros((self.dimension, state.n))
