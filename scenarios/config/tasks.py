"""The keys of the tasks of the end effector and of all joints, of [limits] and [damping].

Each kind of task is one class; `scenarios.config.listed` adds names and frames for `[[tasks]]`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from scenarios.config.sections import (
    Finite,
    Flag,
    JointValue,
    NotNegative,
    PathSection,
    Positive,
    Section,
    Vector3,
)

Rows = Literal["equality", "inequality"]
TaskName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")]


class TaskSection(Section):
    """What every task has: gains of its error, in [1/s^2] and [1/s] (acceleration) and [1/s].

    `unit` is that of its error, "m", "rad" or "".
    """

    unit: ClassVar[str] = "m"
    stiffness: NotNegative = 40.0
    damping: NotNegative = 20.0
    gain: NotNegative = 10.0


class AlongSection(TaskSection):
    """Follow `path`, or stay at the initial position without one, shifted by `offset` [m].

    With `from_start` the path is relative to the initial position.
    """

    path: PathSection | None = None
    offset: Vector3 = (0.0, 0.0, 0.0)
    from_start: Flag = False

    @model_validator(mode="after")
    def _has_a_path_to_shift(self) -> Self:
        if self.from_start and self.path is None:
            raise ValueError("from_start needs a path")
        return self


class PositionTask(AlongSection):
    """The origin of a frame along a path (3 rows)."""


class PointingTask(TaskSection):
    """The z axis of a frame on or in a cone (1 row).

    `buffer` [deg] goes with control.stack = "smooth": an inequality acts within it inside the cone.
    """

    axis: Vector3
    alpha_d: Annotated[float, Field(strict=True, ge=0.0, le=180.0)]
    rows: Rows = "inequality"
    buffer: Positive | None = None
    stiffness: NotNegative = 5.0
    damping: NotNegative = 2.0
    gain: NotNegative = 5.0

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return self.rows == "inequality"


class PostureTask(TaskSection):
    """All joints to a posture: the values of all joints, or all coordinates, as in `start.q`."""

    unit: ClassVar[str] = "rad"
    target: tuple[Finite, ...] | None = None
    joints: dict[str, JointValue] = Field(default_factory=dict)
    stiffness: NotNegative = 10.0
    damping: NotNegative = 5.0
    gain: NotNegative = 1.0


class PositionSection(PositionTask):
    """The end effector's position along a path; without one it stays where it starts."""

    title: ClassVar[str] = "position"
    frame: ClassVar[None] = None


class PointingSection(PointingTask):
    """The end effector's z axis at `alpha_d` [deg] from `axis`, or with "inequality" within it."""

    title: ClassVar[str] = "pointing"
    frame: ClassVar[None] = None
    rows: Rows = Field("inequality", alias="kind")


class PostureSection(PostureTask):
    """A posture [rad or m] as the null-space term, or with `role` = "task" as the last level."""

    title: ClassVar[str] = "posture"
    role: Literal["null-space", "task"] = "null-space"


class LimitsSection(Section):
    """The robot's joint limits, as the first level of the stack.

    With `place` = "guard" they are not in the stack: each command is clamped to them joint by
    joint, regardless of the tasks, which works with every resolver. "either": in the stack if the
    resolver handles bounds, otherwise a guard. "bounds": in the stack, above all else, as far as
    they bound single unknowns: without torque limits and the limits of contact forces.

    Position and velocity limits are those of the robot; `acceleration` [rad/s^2] is one value for
    all joints or one each; `margin` [rad] shrinks the position limits; `torque` is the usable share
    of the effort limits, None for no torque limit. At level "torque" no torque changes by more than
    `torque_step` [N m] from one tick to the next. `base_speed` and `base_acceleration`, each
    [linear, angular] in m, rad and s, limit a floating base; by default to 2 m/s and 3 rad/s, and
    the largest `acceleration`; at level "torque", where only forces move it, not at all. With
    `danger_reach` [m] joints that would move a control point toward an obstacle nearer than that
    are slowed down, see hierarchy.tasks.DangerBounds.
    """

    acceleration: Positive | tuple[Positive, ...]
    place: Literal["stack", "guard", "either", "bounds"] = "stack"
    margin: NotNegative = 0.0
    danger_reach: Positive | None = None
    torque: Annotated[float, Field(strict=True, gt=0.0, le=1.0)] | None = None
    torque_step: Positive | None = None
    base_speed: tuple[Positive, Positive] | None = None
    base_acceleration: tuple[Positive, Positive] | None = None


class DampingSection(Section):
    """Null-space term a = -D v, eq. (15): D = value I, or value M(q) with weight = "mass"."""

    value: NotNegative
    weight: Literal["identity", "mass"] = "identity"
