"""The keys of [robot], [start], [[contacts]] and [forces]: what there is, and what it touches."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from hierarchy.robots.table import Base
from scenarios.config import sections as keys


class PointSection(keys.Section):
    """A point of a joint's body or of a frame."""

    joint: str | None = None  #: Joint that moves the body.
    frame: str | None = None  #: Frame, in place of a joint.
    offset: keys.Point = (0.0, 0.0, 0.0)  #: Where the point is in that frame.

    def _wrong(self) -> Iterator[str]:
        if (self.joint is None) == (self.frame is None):
            yield "give either a joint or a frame"


class CapsuleSection(keys.Section):
    """All points within a radius of a segment."""

    joint: str | None = None  #: Joint whose frame it is in, by default the base.
    start: keys.Point  #: First end of the segment.
    end: keys.Point  #: Last end of the segment.
    radius: keys.Distance  #: The radius.


class RobotSection(keys.Section):
    """The robot; by default as its table says, or for a file as `hierarchy check FILE` proposes."""

    model: str
    """A name of `hierarchy list`, a URDF or MJCF file, or "package:name" (extra `descriptions`)."""
    base: Base | None = None  #: Whether it is "fixed" or "floating"; by default that of the model.
    end_effector: str | None = None  #: Frame of [position] and [pointing].
    control_points: tuple[PointSection, ...] | None = None
    """Points that keep their distance, besides the end effector."""
    capsules: tuple[CapsuleSection, ...] | None = None
    """Shapes of the links, for self-collision and the camera."""
    locked: dict[str, keys.JointValue] = Field(default_factory=dict)
    """Joints of a file to fix at a value, as in [start]."""
    root: str | tuple[str, ...] = ()
    """Bodies of an MJCF at which the robot begins; by default those with joints that do not only
    float."""


class StartSection(keys.Section):
    """Where a run starts.

    A planar joint takes [x, y, angle], a ball a rotation vector or quaternion [x, y, z, w], a free
    joint location and either. Coupled joints and closed chains are moved to fit.
    """

    q: tuple[keys.JointPosition, ...] | None = None
    """Positions of all joints but a floating base, or all coordinates; by default the `keyframe`,
    or the robot's rest posture."""
    keyframe: str | None = None  #: Keyframe of an MJCF, in place of `q`.
    joints: dict[str, keys.JointValue] = Field(default_factory=dict)
    """Positions by name, which override `q`."""
    v: tuple[keys.JointVelocity, ...] | None = None  #: Velocities of all joints, by default zero.
    end_effector: keys.Point | None = None  #: Where the end effector starts; `q` is moved.
    on_floor: keys.Flag = False
    """Whether the base moves vertically until the lowest contact touches the floor."""
    allow_outside_limits: keys.Flag = False  #: Whether joints may start beyond limits.

    def _wrong(self) -> Iterator[str]:
        if self.q is not None and self.keyframe is not None:
            yield "give either q or a keyframe"


class ContactSection(keys.Section):
    """A point or sole on a rigid surface, at level "torque"."""

    frame: str  #: Frame of the robot.
    name: keys.TaskName | None = None  #: Its name, by default the frame's.
    x: tuple[keys.Coordinate, keys.Coordinate] | None = None
    """Sides of a sole along its x axis, from `offset`; none for a point."""
    y: tuple[keys.Coordinate, keys.Coordinate] | None = None  #: The same along its y axis.
    offset: keys.Point = (0.0, 0.0, 0.0)  #: The point, or the sole's middle, in the frame.
    friction: keys.Positive = 0.7  #: Coefficient of friction that the controller assumes.
    normal: keys.Vector3 = (0.0, 0.0, 1.0)  #: Normal of the surface in the world.
    up: keys.Vector3 = (0.0, 0.0, 1.0)
    """Normal of the sole in the frame; its x axis is the frame's, projected, or the frame's y axis
    if x is the normal."""
    open: tuple[tuple[keys.Time, keys.Time], ...] = ()  #: Intervals in which it is lifted.
    ramp: keys.Time = 0.1
    """Time in which the load falls before and rises after them, to at most the robot's weight."""
    slides: keys.Flag = False  #: Whether a point may move along its surface.

    def _wrong(self) -> Iterator[str]:
        if (self.x is None) != (self.y is None):
            yield "a sole has x and y, a point neither"
        if self.x is not None and self.slides:
            yield "only a point slides"
        if self.x is None and self.up != type(self).model_fields["up"].default:
            yield "only a sole has up"


class ForcesSection(keys.Section):
    """Bounds of contact forces, in one level with the torque limits, as `limits.place` says."""

    faces: Literal[4, 8] = 4  #: Faces of the friction pyramid of each point.
    least: keys.Force = 0.0  #: Smallest normal force of each point.
    largest: Annotated[keys.Positive, keys.Unit("N")] | None = None
    """Largest normal force of each point, by default infinite."""
    edge: Annotated[float, Field(strict=True, gt=0.0), keys.Unit("m")] | None = None
    """How far inside a sole its centre of pressure stays."""
    damping: keys.Gain = 20.0  #: Gain that damps the velocity of contacts.
