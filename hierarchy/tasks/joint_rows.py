"""What tasks with a row for every joint share."""

from __future__ import annotations

from hierarchy.robot import Robot
from hierarchy.task import Task


class JointRows(Task):
    """A task with one row per actuated joint of `robot`."""

    robot: Robot

    @property
    def dimension(self) -> int:
        """One row per actuated joint."""
        return self.robot.n - self.robot.actuated

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return tuple(self.robot.velocity_names[self.robot.actuated:])
