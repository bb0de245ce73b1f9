"""The keys of the tasks of the end effector and of all joints, of [limits] and [damping].

Each section of a task makes it; `scenarios.config.kinds` has those that only `[[tasks]]` have.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import radians
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from hierarchy.errors import brief
from hierarchy.paths import Path, Shifted, Still
from hierarchy.plugins import Group
from hierarchy.problem import Array
from scenarios.config.errors import ScenarioError
from scenarios.config.own import OwnSection
from scenarios.config.paths import PathSection
from scenarios.config.sections import (
    Finite,
    Flag,
    Gain,
    JointValue,
    Length,
    NotNegative,
    Point,
    Positive,
    Registered,
    Section,
    Stiffness,
    TaskName,
    Unit,
    Vector3,
)

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References

Acceleration = Annotated[Positive, Unit("rad/s^2")]
Rows = Literal["equality", "inequality"]


class Made(Section):
    """What every section of a task has: a title, and the task that it makes.

    `unit` is that of its error, "m", "rad" or ""; `of_forces` says that its rows are over contact
    forces, at level "torque".
    """

    title: ClassVar[str]
    unit: ClassVar[str] = "m"
    of_forces: ClassVar[bool] = False

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return False

    def make(self, at: References) -> Task:
        """Return the task; values that the section omits are those of the start."""
        raise NotImplementedError

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield unit and size (T,) of the errors (T, m) of the task."""
        missed = np.maximum(error, 0.0) if self.one_sided else error
        yield self.unit, np.linalg.norm(missed, axis=1)

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point (..., 3) [m] that it moves, None if it is silent.

        In axes that the task leaves free that is where the point is.
        """
        return None


class TaskSection(Made):
    """What most tasks have: gains of its error, in [1/s^2] and [1/s] (acceleration) and [1/s]."""

    stiffness: Stiffness = 40.0
    damping: Gain = 20.0
    gain: Gain = 10.0

    @property
    def gains(self) -> tuple[float, float, float]:
        """Stiffness, damping and gain."""
        return self.stiffness, self.damping, self.gain


class AlongSection(TaskSection):
    """Follow `path`, or stay at the initial position without one, shifted by `offset` [m].

    With `from_start` the path is relative to the initial position.
    """

    path: PathSection | None = None
    offset: Point = (0.0, 0.0, 0.0)
    from_start: Flag = False

    @model_validator(mode="after")
    def _has_a_path_to_shift(self) -> Self:
        if self.from_start and self.path is None:
            raise ValueError("from_start needs a path")
        return self

    def along(self, here: Array) -> Path:
        """Return the path of a point that starts `here` (3,) [m]."""
        offset = np.array(self.offset)
        if self.path is None:
            return Still((here + offset).tolist())
        path, shift = self.path.make(), offset + here * self.from_start
        return Shifted(path, shift.tolist()) if shift.any() else path


def of_pose(error: Array) -> Iterator[tuple[str, Array]]:
    """Yield the sizes (T,) of errors (T, 6), of position [m] and of rotation [deg]."""
    yield "m", np.linalg.norm(error[:, :3], axis=1)
    yield "deg", np.degrees(np.linalg.norm(error[:, 3:], axis=1))


class PositionTask(AlongSection):
    """The origin of a frame along a path, in some `axes`."""

    frame: ClassVar[str | None]
    axes: ClassVar[str]

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Along, Position

        frame = at.frame(self.frame)
        task = Position(frame, self.along(at.start.position(frame)), *self.gains, name=self.title)
        return task if self.axes == "xyz" else Along(
            task, np.eye(3)[["xyz".index(axis) for axis in self.axes]].tolist(), self.title)

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point."""
        axes, goal = ["xyz".index(axis) for axis in self.axes], position.copy()
        goal[..., axes] += error
        return goal


class PointingTask(TaskSection):
    """The z axis of a frame on or in a cone (1 row).

    `buffer` [deg] goes with control.stack = "smooth": an inequality acts within it inside the cone.
    """

    axis: Vector3
    alpha_d: Annotated[float, Field(strict=True, ge=0.0, le=180.0), Unit("deg")]
    rows: Rows = "inequality"
    buffer: Annotated[Positive, Unit("deg")] | None = None
    stiffness: Stiffness = 5.0
    damping: Gain = 2.0
    gain: Gain = 5.0
    frame: ClassVar[str | None]

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return self.rows == "inequality"

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Pointing

        return Pointing(at.frame(self.frame), self.axis, radians(self.alpha_d), self.rows,
                        *self.gains, name=self.title)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the angle [deg] off the cone, or outside it."""
        cosine = np.clip(np.cos(np.radians(self.alpha_d)) - error[:, 0], -1.0, 1.0)
        beyond = np.degrees(np.arccos(cosine)) - self.alpha_d
        yield "deg", np.maximum(beyond, 0.0 if self.rows == "inequality" else -beyond)


class PostureTask(TaskSection):
    """All joints to a posture: the values of all joints, or all coordinates, as in `start.q`."""

    unit: ClassVar[str] = "rad"
    target: tuple[Finite, ...] | None = None
    joints: dict[str, JointValue] = Field(default_factory=dict)
    stiffness: Stiffness = 10.0
    damping: Gain = 5.0
    gain: Gain = 1.0

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Posture

        robot, q = at.robot, at.start.q
        if self.target is not None:
            q = robot.configuration(self.target)
        return Posture(robot.configuration(self.joints, q), *self.gains, name=self.title,
                       robot=robot)


class PositionSection(PositionTask):
    """The end effector's position along a path; without one it stays where it starts."""

    title: ClassVar[str] = "position"
    frame: ClassVar[str | None] = None
    axes: ClassVar[str] = "xyz"


class PointingSection(PointingTask):
    """The end effector's z axis at `alpha_d` [deg] from `axis`, or with "inequality" within it."""

    title: ClassVar[str] = "pointing"
    frame: ClassVar[str | None] = None
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

    acceleration: Acceleration | tuple[Acceleration, ...]
    place: Literal["stack", "guard", "either", "bounds"] = "stack"
    margin: Annotated[NotNegative, Unit("rad")] = 0.0
    danger_reach: Length | None = None
    torque: Annotated[float, Field(strict=True, gt=0.0, le=1.0)] | None = None
    torque_step: Annotated[Positive, Unit("N m")] | None = None
    base_speed: tuple[Positive, Positive] | None = None
    base_acceleration: tuple[Positive, Positive] | None = None


class DampingSection(Section):
    """Null-space term a = -D v, eq. (15): D = value I, or value M(q) with weight = "mass"."""

    value: NotNegative
    weight: Literal["identity", "mass"] = "identity"


class Listed(Made):
    """A task of `[[tasks]]`; its name defaults to its kind.

    For the sake of the tasks below, each of its rows may `give` that much beyond its least miss, in
    the unit of the rows: [1/s] or [1/s^2] times that of the task, or [N] of forces.
    """

    name: TaskName | None = None
    give: NotNegative = 0.0
    kind: str

    @property
    def title(self) -> str:  # type: ignore[override]
        """The task's name in stacks, messages and tables."""
        return self.name or self.kind


class OwnTask(Listed, OwnSection):
    """A task of a plugin; its keys are those of the plugin."""

    group: ClassVar[Group] = "tasks"
    unit: ClassVar[str] = ""

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities, as the plugin's class says with `kind`."""
        return str(getattr(type(self).maker, "kind", "equality")) == "inequality"

    def make(self, at: References) -> Task:
        """Return the task; raises ScenarioError for whatever goes wrong in the user's code."""
        from hierarchy import Task

        task = self.made(at.robot, state=at.start, name=self.title)
        if not isinstance(task, Task):
            raise ScenarioError(f"the plugin made {brief(task)}, not a Task")
        if task.name != self.title:
            raise ScenarioError(f"its name is {task.name!r}; take the name as the parameter `name`,"
                                " or give the section this name")
        return task


ListedTask = Annotated[Listed, Registered(None, "tasks", OwnTask)]
