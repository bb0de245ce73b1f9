"""What tasks with a row for every joint share."""

from __future__ import annotations

from hierarchy.robot import Robot
from hierarchy.task import Written


class JointRows(Written):
    """A task with one row per actuated joint of `robot`, or per velocity from `first` on."""

    robot: Robot
    straight = True

    @property
    def first(self) -> int:
        """The velocity of the first row: the first that is actuated."""
        return self.robot.actuated

    @property
    def dimension(self) -> int:
        """One row per velocity from `first` on."""
        return self.robot.n - self.first

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return tuple(self.robot.velocity_names[self.first:])
