"""Frames along paths: position, pose and frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np

from hierarchy.problem import Array
from scenarios.config.sections import Rows3
from scenarios.config.tasks import AlongSection, Listed, PositionTask, of_pose, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("position")
class ListedPosition(Listed, PositionTask):
    """The origin of `frame` along a path, by default its initial position, in some `axes`."""

    kind: Literal["position"]
    frame: str  # type: ignore[misc]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"  # type: ignore[misc]


@register("pose")
class ListedPose(Listed, AlongSection):
    """Origin and axes of `frame` (6 rows); `rotation` (rows) defaults to the initial one."""

    kind: Literal["pose"]
    frame: str
    rotation: Rows3 | None = None

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Pose

        frame = at.frame(self.frame)
        path = self.along(at.start.position(frame))
        rotation = at.start.rotation(frame) if self.rotation is None else self.rotation
        return Pose(frame, path, rotation, *self.gains, name=self.title)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the error of the position and of the rotation."""
        return of_pose(error)

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point."""
        return np.asarray(position + error[..., :3])


@register("frame")
class ListedFrame(Listed, AlongSection):
    """As `pose`, with the error log(T^-1 T_d) of SE(3) in the axes of `frame` (6 rows)."""

    kind: Literal["frame"]
    frame: str
    rotation: Rows3 | None = None

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import FrameLog

        frame = at.frame(self.frame)
        path = self.along(at.start.position(frame))
        rotation = at.start.rotation(frame) if self.rotation is None else self.rotation
        return FrameLog(frame, path, rotation, *self.gains, name=self.title)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the error of the position and of the rotation."""
        return of_pose(error)
