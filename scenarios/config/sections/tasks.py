"""The keys of the tasks of the end effector and of all joints, of [limits] and [damping].

Each section of a task makes it; `kinds` has those that only `[[tasks]]` have.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from math import radians
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from hierarchy.errors import brief
from hierarchy.paths import Path, Shifted, Still
from hierarchy.plugins import Group
from hierarchy.problem import Array
from scenarios.config import sections as keys
from scenarios.config.sections import ScenarioError
from scenarios.config.sections.own import OwnSection, PartSection
from scenarios.config.sections.paths import PathSection

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.sections.references import References

Acceleration = Annotated[keys.Positive, keys.Unit("rad/s^2")]
Rows = Literal["equality", "inequality"]
Axes = Literal["x", "y", "z", "xy", "xz", "yz", "xyz"]
JOINT = "joint"  # stands for the unit of joints


def alike(names: Iterable[str]) -> Iterator[str]:
    """Yield what is wrong with names of tasks, of which those of signals and metrics are made."""
    for name, count in Counter(name.replace(" ", "_") for name in names).items():
        if count > 1:
            yield f"{count} tasks are named {name!r}; give each its own name"


class Made(PartSection):
    """What every section of a task has: a title, and the task that it makes.

    `unit` is that of its error, see `unit_among`, and `shown` has the rows that are shown in
    another one; `of_forces` says that its rows are over contact forces, at level "torque".
    """

    title: ClassVar[str]
    unit: ClassVar[str] = "m"
    shown: ClassVar[dict[str, slice]] = {}
    of_forces: ClassVar[bool] = False

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities, as the key or the constant `rows` says."""
        return getattr(self, "rows", "equality") == "inequality"

    def make(self, at: References, **more: Any) -> Task:
        """Return the task: what `made_by` makes of the keys, of what is `asked`, and of `more`."""
        kind = "inequality" if self.one_sided else "equality"
        task: Task = self.made(at.robot, state=at.start, contacts=at.contacts, name=self.title,
                               **{"kind": kind, **self.asked(at), **more})
        return task

    def asked(self, at: References) -> dict[str, Any]:
        """Return what the maker takes that is no key, or that the section leaves to the start."""
        return {}

    def unit_among(self, joints: Mapping[str, str]) -> str:
        """Return the unit of its error on a robot whose joints have these units, by name."""
        return self.unit

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield unit and size (T,) of the errors (T, m) of the task, or of each part of them."""
        missed = np.maximum(error, 0.0) if self.one_sided else error
        for unit, rows in (self.shown or {self.unit: slice(None)}).items():
            if (part := missed[:, rows]).shape[1]:
                size = np.linalg.norm(part, axis=1)
                yield unit, np.degrees(size) if unit == "deg" else size

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point (..., 3) [m] that it moves, None if it is silent.

        In axes that the task leaves free that is where the point is.
        """
        return None


class TaskSection(Made):
    """What most tasks have: the gains of their error."""

    stiffness: keys.Stiffness = 40.0  #: Gain of the error at acceleration level.
    damping: keys.Gain = 20.0  #: Gain of the error's rate at acceleration level.
    gain: keys.Gain = 10.0  #: Gain of the error at velocity level.


class AlongSection(TaskSection):
    """Follow a path, or stay at the initial position without one."""

    path: PathSection | None = None  #: Path of the point.
    offset: keys.Point = (0.0, 0.0, 0.0)  #: Shift of the path, or of the initial position.
    from_start: keys.Flag = False  #: Whether the path is relative to the initial position.

    def _wrong(self) -> Iterator[str]:
        if self.from_start and self.path is None:
            yield "from_start needs a path"

    def along(self, here: Array) -> Path:
        """Return the path of a point that starts `here` (3,) [m]."""
        offset = np.array(self.offset)
        if self.path is None:
            return Still((here + offset).tolist())
        path, shift = self.path.make(), offset + here * self.from_start
        return Shifted(path, shift.tolist()) if shift.any() else path

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of the axes of the world that count, from 0: all, or those of its `axes`."""
        return tuple("xyz".index(axis) for axis in getattr(self, "axes", "xyz"))

    def wanted(self, position: Array, error: Array) -> Array | None:
        """Return where the task wants the point."""
        goal = position.copy()
        goal[..., self.numbers] += error[..., :len(self.numbers)]
        return goal


POSE = {"m": slice(3), "deg": slice(3, None)}  # rows of the errors of position and rotation


class PositionTask(AlongSection):
    """The origin of a frame along a path, in some `axes`."""

    made_by: ClassVar[str] = "hierarchy.tasks:Position"
    frame: ClassVar[str | None]
    axes: ClassVar[str]

    def make(self, at: References, **more: Any) -> Task:
        """Return the task, in its axes."""
        from hierarchy.tasks import Along, Position

        task = super().make(at, **more)
        assert isinstance(task, Position)
        return task if self.axes == "xyz" else Along(
            task, np.eye(3)[list(self.numbers)].tolist(), self.title)

    def asked(self, at: References) -> dict[str, Any]:
        """Return the frame and its path."""
        frame = at.frame(self.frame)
        return {"frame": frame, "path": self.along(at.start.position(frame))}


class PointingTask(TaskSection):
    """The z axis of a frame on or in a cone (1 row)."""

    axis: keys.Vector3  #: Axis of the cone in the world.
    alpha_d: Annotated[float, Field(strict=True, ge=0.0, le=180.0), keys.Unit("deg")]
    """Half-angle of the cone."""
    rows: Rows = "inequality"  #: "equality": on the cone. "inequality": in it.
    buffer: Annotated[keys.Positive, keys.Unit("deg")] | None = None
    """Width inside the cone within which an inequality acts if control.stack is "smooth"."""
    stiffness: keys.Stiffness = 5.0
    damping: keys.Gain = 2.0
    gain: keys.Gain = 5.0
    made_by: ClassVar[str] = "hierarchy.tasks:Pointing"
    unit: ClassVar[str] = ""
    frame: ClassVar[str | None]

    def asked(self, at: References) -> dict[str, Any]:
        """Return the frame and the half angle."""
        return {"frame": at.frame(self.frame), "half_angle": radians(self.alpha_d)}

    def angle(self, error: Array) -> Array:
        """Return the angle [deg] from the axis of the cone at errors of the task."""
        cosine = np.cos(np.radians(self.alpha_d)) - error
        return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the angle [deg] off the cone, or outside it."""
        beyond = self.angle(error[:, 0]) - self.alpha_d
        yield "deg", np.maximum(beyond, 0.0 if self.rows == "inequality" else -beyond)


class PostureTask(TaskSection):
    """All joints to a posture."""

    made_by: ClassVar[str] = "hierarchy.tasks:Posture"
    unit: ClassVar[str] = JOINT
    target: tuple[keys.JointPosition, ...] | None = None  #: As `start.q`; by default the start.
    joints: dict[str, keys.JointValue] = Field(default_factory=dict)
    """Positions by name, which override `target`."""
    stiffness: keys.Stiffness = 10.0
    damping: keys.Gain = 5.0
    gain: keys.Gain = 1.0

    def unit_among(self, joints: Mapping[str, str]) -> str:
        """Return the unit of all joints, "" where they have two."""
        return keys.shared(joints.values())

    def asked(self, at: References) -> dict[str, Any]:
        """Return the posture, by default that of the start."""
        q = at.start.q if self.target is None else at.robot.configuration(self.target)
        return {"target": at.posture(self.joints, q)}


class PositionSection(PositionTask):
    """The end effector's position along a path, by default where it starts."""

    title: ClassVar[str] = "position"
    frame: ClassVar[str | None] = None
    axes: ClassVar[str] = "xyz"


class PointingSection(PointingTask):
    """The end effector's z axis on a cone, or within it."""

    title: ClassVar[str] = "pointing"
    frame: ClassVar[str | None] = None
    rows: Rows = Field("inequality", alias="kind")  #: "equality": on the cone. "inequality": in it.


class PostureSection(PostureTask):
    """A posture, below all tasks."""

    title: ClassVar[str] = "posture"
    role: Literal["null-space", "task"] = "null-space"
    """"null-space": the null-space term of eq. (14). "task": the last level."""


class LimitsSection(keys.Section):
    """The robot's position and velocity limits, and those of acceleration."""

    acceleration: Acceleration | tuple[Acceleration, ...]  #: The largest, of all joints or of each.
    place: Literal["stack", "guard", "either", "bounds"] = "stack"
    """"stack": the first level. "guard": each command is clamped joint by joint, regardless of the
    tasks, with any resolver. "either": in the stack if the resolver handles bounds, else a guard,
    at level "torque" of torques alone.
    "bounds": in the stack, but without torque limits and [forces]."""
    margin: keys.Arc = 0.0  #: Distance kept from the position limits.
    horizon: Annotated[keys.NotNegative, keys.Unit("s")] | None = None
    """Time in which a joint comes to rest at a limit, see docs/theory/joint-limits.md; by default
    0.05 s at level "torque", elsewhere one tick, which is the least."""
    danger_reach: keys.Length | None = None
    """Distance to an obstacle below which joints that approach it are slowed down, see
    hierarchy.tasks.DangerBounds."""
    torque: Annotated[float, Field(strict=True, gt=0.0, le=1.0)] | None = None
    """Usable share of the effort limits; by default torques are unlimited."""
    torque_step: Annotated[keys.Positive, keys.Unit("N m")] | None = None
    """Largest change of a torque in a tick, at level "torque": a level below torque limits and
    friction, and above the joint limits."""
    base_speed: tuple[keys.Positive, keys.Positive] | None = None
    """Linear [m/s] and angular [rad/s] speed of a floating base; by default 2 and 3, at level
    "torque" unlimited."""
    base_acceleration: tuple[keys.Positive, keys.Positive] | None = None
    """The same of its acceleration [m/s^2], [rad/s^2]; by default the largest `acceleration`, at
    level "torque" unlimited."""


class DampingSection(keys.Section):
    """Null-space term a = -D v, eq. (15), at velocity level 0; not with a null-space [posture]."""

    value: keys.NotNegative  #: D [1/s], or with weight = "mass" the factor of M(q).
    weight: Literal["identity", "mass"] = "identity"  #: D = value I, or with "mass" D = value M(q).


class Listed(Made):
    """A task of `[[tasks]]`."""

    name: keys.TaskName | None = None  #: Its name, by default its kind.
    give: keys.NotNegative = 0.0
    """Violation of each row in favour of the tasks below, in the task's unit per s or s^2, or
    [N]."""
    kind: str  #: Which kind it is.

    @property
    def title(self) -> str:  # type: ignore[override]
        """The task's name in stacks, messages and tables."""
        return self.name or self.kind


class OwnTask(Listed, OwnSection):
    """A task of a plug-in, with its keys."""

    group: ClassVar[Group] = "tasks"
    unit: ClassVar[str] = ""

    def make(self, at: References, **more: Any) -> Task:
        """Return the task; raises ScenarioError for whatever goes wrong in the user's code."""
        from hierarchy import Task

        task = super().make(at, **more)
        if not isinstance(task, Task):
            raise ScenarioError(f"the plugin made {brief(task)}, not a Task")
        if task.name != self.title:
            raise ScenarioError(f"its name is {task.name!r}; take the name as the parameter `name`,"
                                " or give the section this name")
        return task


ListedTask = Annotated[Listed, keys.OneOf(None, OwnTask)]
