"""The keys of the letter's tasks, the joint limits and the null-space task."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scenarios.config.sections import Finite, NotNegative, PathSection, Positive, Section, Vector3


class PositionSection(Section):
    """End-effector position along a path, shifted by `offset` [m]."""

    path: PathSection
    offset: Vector3 = (0.0, 0.0, 0.0)
    stiffness: NotNegative = 40.0
    damping: NotNegative = 20.0
    gain: NotNegative = 10.0


class PointingSection(Section):
    """The end effector's z axis in a cone of half-angle `alpha_d` [deg] about `axis`."""

    kind: Literal["equality", "inequality"] = "inequality"
    axis: Vector3
    alpha_d: Annotated[float, Field(ge=0.0, le=180.0)]
    stiffness: NotNegative = 5.0
    damping: NotNegative = 2.0
    gain: NotNegative = 5.0


class LimitsSection(Section):
    """The robot's joint limits, as the first level of the stack.

    With `place` = "guard" they are not in the stack: each command is clamped to them joint by
    joint, regardless of the tasks, which works with every resolver. "either": in the stack if the
    resolver handles bounds, otherwise a guard.

    Position and velocity limits are those of the robot; `acceleration` [rad/s^2] is one value for
    all joints or one each; `margin` [rad] shrinks the position limits; `torque` is the usable share
    of the effort limits, at acceleration level, None for no torque limit. With `danger_reach` [m]
    joints that would move a control point toward an obstacle nearer than that are slowed down, see
    hierarchy.tasks.DangerBounds.
    """

    acceleration: Positive | tuple[Positive, ...]
    place: Literal["stack", "guard", "either"] = "stack"
    margin: NotNegative = 0.0
    danger_reach: Positive | None = None
    torque: Annotated[float, Field(gt=0.0, le=1.0)] | None = None


class DampingSection(Section):
    """Null-space term a = -D v, eq. (15): D = value I, or value M(q) with weight = "mass"."""

    value: NotNegative
    weight: Literal["identity", "mass"] = "identity"


class PostureSection(Section):
    """A posture [rad or m] as the null-space term, or with `role` = "task" as the last level."""

    target: tuple[Finite, ...]
    role: Literal["null-space", "task"] = "null-space"
    stiffness: NotNegative = 10.0
    damping: NotNegative = 5.0
    gain: NotNegative = 1.0
