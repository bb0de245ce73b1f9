"""The keys of [robot] and [start]."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from hierarchy.robots.table import Base
from scenarios.config.sections import Distance, Finite, Flag, JointValue, Point, Section


class ControlPointSection(Section):
    """A point on the body of `joint`, at `offset` [m] in the joint's frame."""

    joint: str
    offset: Point


class RobotPointSection(Section):
    """A point on the body of `joint`, or fixed to `frame`, at `offset` [m] in that frame."""

    joint: str | None = None
    frame: str | None = None
    offset: Point = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.joint is None) == (self.frame is None):
            raise ValueError("give either a joint or a frame")
        return self


class CapsuleSection(Section):
    """All points within `radius` [m] of the segment `start` to `end` [m], in the frame of `joint`.

    Without a joint it is fixed to the base.
    """

    joint: str | None = None
    start: Point
    end: Point
    radius: Distance


class RobotSection(Section):
    """Which robot: a name of `hierarchy list`, a URDF or MJCF file, or "package:name".

    Packages are example_robot_data and robot_descriptions (extra `robots`). `base` defaults to that
    of the model. `end_effector`, `control_points` and `capsules` default to the robot's table, or
    for a file to the proposals of `hierarchy check FILE`. `locked` joints of a file are fixed at a
    value [rad or m], as in [start], and removed. `root` is the body, or bodies, of an MJCF at which
    the robot begins, by default each that has joints, except those that only float.
    """

    model: str
    base: Base | None = None
    end_effector: str | None = None
    control_points: tuple[RobotPointSection, ...] | None = None
    capsules: tuple[CapsuleSection, ...] | None = None
    locked: dict[str, JointValue] = Field(default_factory=dict)
    root: str | tuple[str, ...] = ()


class StartSection(Section):
    """The start: positions `q` [rad or m] and velocities `v` [rad/s or m/s].

    `q` has the values of all joints but a floating base, or all coordinates, and defaults to that
    of the `keyframe` of an MJCF, or to the robot's own posture; `joints` override it by name. A
    value is a number, the angle of a continuous joint too, [x, y, angle] of a planar one, a
    rotation vector or quaternion [x, y, z, w] of a ball, location and either of a free one. Joints
    that follow others, and those of closed chains, are moved to where the named ones let them be.
    With `end_effector` [m] the start is the posture, reached from q, that puts the end effector
    there. With `on_floor` a floating base is raised or lowered so that the lowest contact touches
    the floor. A joint beyond its limits is an error unless `allow_outside_limits`.
    """

    q: tuple[Finite, ...] | None = None
    keyframe: str | None = None
    joints: dict[str, JointValue] = Field(default_factory=dict)
    v: tuple[Finite, ...] | None = None
    end_effector: Point | None = None
    on_floor: Flag = False
    allow_outside_limits: Flag = False

    @model_validator(mode="after")
    def _is_one_posture(self) -> Self:
        if self.q is not None and self.keyframe is not None:
            raise ValueError("give either q or a keyframe")
        return self
