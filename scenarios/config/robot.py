"""The keys of [robot] and [start]."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from hierarchy.robots.table import Base
from scenarios.config.sections import Finite, NotNegative, Section, Vector3


class ControlPointSection(Section):
    """A point on the body that `joint` moves, `offset` [m] in that joint's frame."""

    joint: str
    offset: Vector3


class RobotPointSection(Section):
    """A point on the body of `joint`, or fixed to `frame`, `offset` [m] in axes of that."""

    joint: str | None = None
    frame: str | None = None
    offset: Vector3 = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.joint is None) == (self.frame is None):
            raise ValueError("give either a joint or a frame")
        return self


class CapsuleSection(Section):
    """All within `radius` [m] of the segment `start` to `end` [m], in the frame of `joint`.

    Without a joint it is fixed to the base.
    """

    joint: str | None = None
    start: Vector3
    end: Vector3
    radius: NotNegative


class RobotSection(Section):
    """Which robot: a name of `hierarchy list`, a URDF or MJCF file, or "package:name".

    Packages are example_robot_data and robot_descriptions (extra `robots`). `base` None is that of
    the model. What `end_effector`, `control_points` and `capsules` do not say is as the robot's
    table says, or for a file as `hierarchy check FILE` proposes. `locked` joints of a file are held
    at an angle [rad] or a way [m] and are no joints any more.
    """

    model: str
    base: Base | None = None
    end_effector: str | None = None
    control_points: tuple[RobotPointSection, ...] | None = None
    capsules: tuple[CapsuleSection, ...] | None = None
    locked: dict[str, Finite] = Field(default_factory=dict)


class StartSection(Section):
    """Positions `q` [rad or m] and velocities `v`; `end_effector` [m] is reached from q first.

    Without q the robot starts in its own posture. `joints` by name go before either.
    """

    q: tuple[Finite, ...] | None = None
    joints: dict[str, Finite] = Field(default_factory=dict)
    v: tuple[Finite, ...] | None = None
    end_effector: Vector3 | None = None
