"""The keys of [robot] and [start]."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from hierarchy.robots.table import Base
from scenarios.config.sections import (
    Distance,
    Flag,
    JointPosition,
    JointValue,
    JointVelocity,
    Point,
    Section,
)


class ControlPointSection(Section):
    """A point on the body of a joint."""

    joint: str
    """Joint that moves the body."""
    offset: Point
    """Where the point is in the joint's frame."""


class RobotPointSection(Section):
    """A point on the body of a joint, or fixed to a frame."""

    joint: str | None = None
    """Joint that moves the body."""
    frame: str | None = None
    """Frame, in place of a joint."""
    offset: Point = (0.0, 0.0, 0.0)
    """Where the point is in that frame."""

    def _wrong(self) -> Iterator[str]:
        if (self.joint is None) == (self.frame is None):
            yield "give either a joint or a frame"


class CapsuleSection(Section):
    """All points within a radius of a segment."""

    joint: str | None = None
    """Joint whose frame the capsule is in; without it it is fixed to the base."""
    start: Point
    """First end of the segment."""
    end: Point
    """Last end of the segment."""
    radius: Distance
    """The radius."""


class RobotSection(Section):
    """Which robot, and what of it the scenario uses.

    What a section omits is that of the robot's table, or for a file what `hierarchy check FILE`
    proposes.
    """

    model: str
    """A name of `hierarchy list`, a URDF or MJCF file, or "package:name" of example_robot_data or
    robot_descriptions (extra `descriptions`)."""
    base: Base | None = None
    """Whether the base is "fixed" or "floating"; by default that of the model."""
    end_effector: str | None = None
    """Frame of [position] and [pointing]."""
    control_points: tuple[RobotPointSection, ...] | None = None
    """Points whose distances to obstacles count, apart from the end effector."""
    capsules: tuple[CapsuleSection, ...] | None = None
    """Shapes of the links, for self-collision and for removing the robot from images."""
    locked: dict[str, JointValue] = Field(default_factory=dict)
    """Joints of a file that are fixed at a value, as in [start], and removed."""
    root: str | tuple[str, ...] = ()
    """Body, or bodies, of an MJCF at which the robot begins; by default each that has joints,
    except those that only float."""


class StartSection(Section):
    """Where a run starts.

    A value of a joint is a number, the angle of a continuous joint too, [x, y, angle] of a planar
    one, a rotation vector or quaternion [x, y, z, w] of a ball, location and either of a free one.
    Joints that follow others, and those of closed chains, are moved to where the named ones let
    them be.
    """

    q: tuple[JointPosition, ...] | None = None
    """Positions of all joints but a floating base, or all coordinates; by default those
    of the `keyframe`, or the robot's own posture."""
    keyframe: str | None = None
    """Keyframe of an MJCF, in place of `q`."""
    joints: dict[str, JointValue] = Field(default_factory=dict)
    """Positions of joints by name, which override `q`."""
    v: tuple[JointVelocity, ...] | None = None
    """Velocities of all joints; by default zero."""
    end_effector: Point | None = None
    """The start is the posture, reached from `q`, that puts the end effector there."""
    on_floor: Flag = False
    """Whether a floating base is raised or lowered so that the lowest contact touches the floor."""
    allow_outside_limits: Flag = False
    """Whether joints may start beyond their limits, which is an error otherwise."""

    def _wrong(self) -> Iterator[str]:
        if self.q is not None and self.keyframe is not None:
            yield "give either q or a keyframe"
