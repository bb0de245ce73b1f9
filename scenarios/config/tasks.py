"""The keys of the letter's tasks, the joint limits and the null-space task."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scenarios.config.sections import Finite, NotNegative, PathSection, Positive, Section, Vector3


class PositionSection(Section):
    """End-effector position along a path, which is moved by `offset` [m]."""

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

    With `place` = "guard" they are not in the stack: each command is moved into them joint by
    joint, whatever that does to the tasks. So they suit every resolver. "either": in the stack of a
    resolver that takes bounds, a guard for one that does not.

    Positions and velocities are those of the robot; `acceleration` [rad/s^2] of every joint, or
    one for each; `margin` [rad] is kept off the position limits; `torque` is the share of the
    effort limits that may be used, at acceleration level, or None for any torque. With
    `danger_reach` [m] joints that would move a control point toward an obstacle nearer than that
    are slowed, see hierarchy.tasks.DangerBounds.
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
    """Toward a posture [rad or m]: the null-space term, or with `role` = "task" the last level."""

    target: tuple[Finite, ...]
    role: Literal["null-space", "task"] = "null-space"
    stiffness: NotNegative = 10.0
    damping: NotNegative = 5.0
    gain: NotNegative = 1.0
