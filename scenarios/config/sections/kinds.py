"""The kinds of `[[tasks]]`, which nothing else lists: the keys of each, and the task they make.

Makers import what they make when they are called, so that reading a file loads no robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from hierarchy.plugins import register
from hierarchy.problem import Array
from scenarios.config import sections as keys
from scenarios.config.sections import tasks as base
from scenarios.config.sections.avoidance import BarrierSection

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.sections.references import References


@register("tasks", "contact-force", shipped=True)
class ListedForce(base.Listed):
    """A contact's force or wrench at a value, at level "torque"."""

    of_forces: ClassVar[bool] = True
    made_by: ClassVar[str] = "hierarchy.tasks:ContactForce"
    contact: str  #: Name of the contact.
    target: tuple[keys.Finite, ...]  #: Normal force, force or wrench [N, N m]: 1, 3 or 6 numbers.

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of its error, none of a wrench."""
        return "N" if len(self.target) < 6 else ""


@register("tasks", "least-force", shipped=True)
class ListedLeastForce(base.Listed):
    """The smallest contact forces, as last level, at level "torque"."""

    unit: ClassVar[str] = "N"
    of_forces: ClassVar[bool] = True
    made_by: ClassVar[str] = "hierarchy.tasks:LeastForce"


@register("tasks", "position", shipped=True)
class ListedPosition(base.Listed, base.PositionTask):
    """The origin of a frame along a path."""

    frame: str  # type: ignore[misc]  #: Frame of the robot.
    axes: base.Axes = "xyz"  # type: ignore[misc]  #: Axes of the world that count.


class _Turned(base.Listed):
    """The axes of a frame."""

    frame: str  #: Frame of the robot.
    rotation: keys.Rows3 | None = None
    """Rows of the wanted matrix from frame to world, by default the initial one."""

    def asked(self, at: References) -> dict[str, Any]:
        """Return the rotation, by default the initial one."""
        return {"rotation": np.asarray(at.start.rotation(at.frame(self.frame))
                                       if self.rotation is None else self.rotation)}


@register("tasks", "orientation", shipped=True)
class ListedOrientation(_Turned, base.TaskSection):
    """The axes of a frame, wherever it is (3 rows)."""

    made_by: ClassVar[str] = "hierarchy.tasks:Orientation"
    shown: ClassVar[dict[str, slice]] = {"deg": slice(None)}


class _AlongPose(_Turned, base.AlongSection):
    """The position and the rotation of a frame (6 rows)."""

    shown: ClassVar[dict[str, slice]] = base.POSE

    def asked(self, at: References) -> dict[str, Any]:
        """Return the path of the frame, and its rotation."""
        return super().asked(at) | {"path": self.along(at.start.position(at.frame(self.frame)))}


@register("tasks", "pose", shipped=True)
class ListedPose(_AlongPose):
    """Origin and axes of a frame (6 rows)."""

    made_by: ClassVar[str] = "hierarchy.tasks:Pose"


@register("tasks", "frame", shipped=True)
class ListedFrame(_AlongPose):
    """As `pose`, with the error log(T^-1 T_d) of SE(3) in the axes of `frame` (6 rows)."""

    made_by: ClassVar[str] = "hierarchy.tasks:FrameLog"

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return None: its error is in axes that turn."""
        return None


@register("tasks", "pointing", shipped=True)
class ListedPointing(base.PointingTask, base.Listed):
    """The z axis of a frame on a cone, or within it."""

    frame: str  # type: ignore[misc]  #: Frame of the robot.


@register("tasks", "look-at", shipped=True)
class ListedLookAt(base.Listed, base.TaskSection):
    """The z axis of a frame toward a point (2 rows)."""

    made_by: ClassVar[str] = "hierarchy.tasks:LookAt"
    unit: ClassVar[str] = ""
    frame: str  #: Frame of the robot.
    target: Annotated[keys.Vector3, keys.Unit("m", doubted=False)]
    """The point, a far one for a direction."""
    stiffness: keys.Stiffness = 20.0
    damping: keys.Gain = 10.0
    gain: keys.Gain = 5.0

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the angle [deg] from the direction to the point."""
        yield "deg", np.degrees(2 * np.arctan(np.linalg.norm(error, axis=1) / 2))


@register("tasks", "relative", shipped=True)
class ListedRelative(base.Listed, base.TaskSection):
    """The pose of a frame in another one (6 rows, or 3)."""

    made_by: ClassVar[str] = "hierarchy.tasks:RelativePose"
    shown: ClassVar[dict[str, slice]] = base.POSE
    frame: str  #: Frame of the robot.
    to: str  #: The other frame.
    position: keys.Point | None = None
    """Origin of `frame` in the axes of `to`, by default the initial one."""
    rotation: keys.Rows3 | None = None
    """Rows of the matrix from `frame` to `to`, by default the initial one."""
    orientation: keys.Flag = True  #: Whether the orientation counts too.

    def _wrong(self) -> Iterator[str]:
        if self.rotation is not None and not self.orientation:
            yield "rotation goes with orientation = true"

    def asked(self, at: References) -> dict[str, Any]:
        """Return position and rotation, by default the initial ones."""
        start, frame, to = at.start, at.frame(self.frame), at.frame(self.to, "to")
        axes = start.rotation(to).T
        position = (axes @ (start.position(frame) - start.position(to)) if self.position is None
                    else self.position)
        rotation = axes @ start.rotation(frame) if self.rotation is None else self.rotation
        return {"position": position, "rotation": rotation if self.orientation else None}


@register("tasks", "manipulability", shipped=True)
class ListedManipulability(base.Listed, base.TaskSection):
    """The manipulability of a frame (1 row)."""

    made_by: ClassVar[str] = "hierarchy.tasks:Manipulability"
    unit: ClassVar[str] = ""
    frame: str  #: Frame of the robot.
    least: keys.NotNegative  #: The value, in the unit of det(J J^T)^(1/2).
    part: Literal["position", "pose"] = "position"
    """"position": of the linear rows of its Jacobian. "pose": of all six."""
    rows: base.Rows = "inequality"  #: "inequality": at `least` or above. "equality": at `least`.
    stiffness: keys.Stiffness = 20.0
    damping: keys.Gain = 10.0
    gain: keys.Gain = 5.0

    def make(self, at: References, **more: Any) -> Task:
        """Return the task."""
        task = super().make(at, **more)
        task.jacobian(at.start)  # refuses a robot that it is not for
        return task


@register("tasks", "posture", shipped=True)
class ListedPosture(base.Listed, base.PostureTask):
    """All joints to a posture."""


@register("tasks", "coupling", shipped=True)
class ListedCoupling(base.Listed, base.TaskSection):
    """A weighted sum of joint positions (1 row)."""

    unit: ClassVar[str] = base.JOINT
    made_by: ClassVar[str] = "hierarchy.tasks:JointCoupling"
    joints: Annotated[dict[str, keys.Finite], Field(min_length=1)]  #: Factors of joints, by name.
    value: keys.JointPosition = 0.0  #: The value of the sum.
    stiffness: keys.Stiffness = 100.0

    def unit_among(self, joints: Mapping[str, str]) -> str:
        """Return the unit of the joints of the sum, "" where they have two."""
        return keys.shared(joints[name] for name in self.joints)


@register("tasks", "com", shipped=True)
class ListedCentreOfMass(base.Listed, base.AlongSection):
    """The centre of mass along a path."""

    made_by: ClassVar[str] = "hierarchy.tasks:CentreOfMass"
    axes: base.Axes = "xyz"  #: Axes of the world that count.

    def asked(self, at: References) -> dict[str, Any]:
        """Return the path and the numbers of the axes."""
        return {"path": self.along(at.start.centre_of_mass()), "axes": self.numbers}


@register("tasks", "momentum", shipped=True)
class ListedMomentum(base.Listed):
    """The momentum of the whole robot to zero."""

    made_by: ClassVar[str] = "hierarchy.tasks:Momentum"
    part: Literal["linear", "angular"] = "angular"  #: Which of the two.
    damping: keys.Gain = 10.0  #: Gain of the momentum.

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of its error."""
        return "N s" if self.part == "linear" else "N m s"


@register("tasks", "self-collision", shipped=True)
class ListedSelfCollision(base.Listed, BarrierSection):
    """Links kept apart, except neighbours."""

    made_by: ClassVar[str] = "hierarchy.tasks:SelfSeparation"
    rows: ClassVar[base.Rows] = "inequality"

    def asked(self, at: References) -> dict[str, Any]:
        """Return the capsules, those of them to keep apart, and how."""
        return {"capsules": at.robot.capsules, "barrier": self.barrier(self.distance),
                "pairs": at.pairs(self.distance)}


@register("tasks", "collision", shipped=True)
class ListedCollision(base.Listed):
    """Where the rows of [avoidance] `separation` stand; by default above all tasks."""

    rows: ClassVar[base.Rows] = "inequality"

    def _wrong(self) -> Iterator[str]:
        if self.name is not None:
            yield f'name = {self.name!r}: the level of the rows is named "separation"'
