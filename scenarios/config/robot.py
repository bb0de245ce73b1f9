"""The keys of [robot], [start], [[contacts]] and [forces]: what there is, and what it touches."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from hierarchy.robots.table import Base
from scenarios.config.sections import (
    Distance,
    Finite,
    Flag,
    Force,
    Gain,
    JointPosition,
    JointValue,
    JointVelocity,
    Point,
    Positive,
    Section,
    TaskName,
    Time,
    Unit,
    Vector3,
)

Place = Annotated[Finite, Unit("m")]


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


class ContactSection(Section):
    """Points of a frame that push on a rigid surface, see hierarchy.contacts.Contact."""

    frame: str
    """Frame of the robot."""
    name: TaskName | None = None
    """Its name in messages, tables and figures; by default the frame's."""
    x: tuple[Place, Place] | None = None
    """Sides of a sole along its x axis, from `offset` on; without `x` and `y` the contact is that
    point."""
    y: tuple[Place, Place] | None = None
    """The same along its y axis."""
    offset: Point = (0.0, 0.0, 0.0)
    """The point, or the middle of the sole, in the frame."""
    friction: Positive = 0.7
    """Coefficient of friction that the controller believes."""
    normal: Vector3 = (0.0, 0.0, 1.0)
    """Direction in the world in which the surface pushes."""
    up: Vector3 = (0.0, 0.0, 1.0)
    """Direction in the frame across the sole: x is the frame's x axis as seen along it, or the
    frame's y axis if it is along x."""
    open: tuple[tuple[Time, Time], ...] = ()
    """Intervals in which the contact is lifted."""
    ramp: Time = 0.1
    """Time in which the load falls before such an interval, and rises after it to at most the
    robot's weight."""
    slides: Flag = False
    """Whether a point may move along its surface."""

    def _wrong(self) -> Iterator[str]:
        if (self.x is None) != (self.y is None):
            yield "a sole has x and y, a point neither"
        if self.x is not None and self.slides:
            yield "only a point slides"


class ForcesSection(Section):
    """The contact forces that the stack allows, as one level with the torque limits.

    Like the rows of [limits], these are in the stack if `limits.place` says so.
    """

    faces: Literal[4, 8] = 4
    """Faces of the friction pyramid of each point."""
    least: Force = 0.0
    """Smallest normal force of each point."""
    largest: Annotated[Positive, Unit("N")] | None = None
    """Largest normal force of each point; without it there is no upper bound."""
    edge: Annotated[float, Field(strict=True, gt=0.0), Unit("m")] | None = None
    """How far inside a sole its centre of pressure stays; without it just inside."""
    damping: Gain = 20.0
    """Gain that damps the velocity of contacts."""
