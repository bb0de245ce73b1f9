"""Frames along paths: position, pose and frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np

from hierarchy.problem import Array
from scenarios.config.sections import Rows3
from scenarios.config.tasks import AlongSection, Listed, PositionTask, of_pose, register

if TYPE_CHECKING:
    from hierarchy import Frame, Task
    from hierarchy.paths import Path
    from scenarios.config.references import References




@register("position")
class ListedPosition(Listed, PositionTask):
    """The origin of `frame` along a path, by default its initial position, in some `axes`."""

    kind: Literal["position"]
    frame: str  # type: ignore[misc]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"  # type: ignore[misc]


class _AlongPose(Listed, AlongSection):
    """What asks for the position and the rotation of a frame (6 rows)."""

    frame: str
    rotation: Rows3 | None = None

    def asked(self, at: References) -> tuple[Frame, Path, Array]:
        """Return the frame, its path, and its rotation, by default the initial one."""
        frame = at.frame(self.frame)
        rotation = at.start.rotation(frame) if self.rotation is None else self.rotation
        return frame, self.along(at.start.position(frame)), np.asarray(rotation)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the error of the position and of the rotation."""
        return of_pose(error)


@register("pose")
class ListedPose(_AlongPose):
    """Origin and axes of `frame` (6 rows); `rotation` (rows) defaults to the initial one."""

    kind: Literal["pose"]

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Pose

        return Pose(*self.asked(at), *self.gains, name=self.title)

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point."""
        return np.asarray(position + error[..., :3])


@register("frame")
class ListedFrame(_AlongPose):
    """As `pose`, with the error log(T^-1 T_d) of SE(3) in the axes of `frame` (6 rows)."""

    kind: Literal["frame"]

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import FrameLog

        return FrameLog(*self.asked(at), *self.gains, name=self.title)
