"""Task: rows of Jacobian, drift and reference dynamics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import is_dataclass
from functools import wraps
from typing import Any, ClassVar, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.avoidance.body import ControlPoint, pack_points
from hierarchy.avoidance.laws import Barrier
from hierarchy.avoidance.measurement import Measurement
from hierarchy.contacts import Contacts
from hierarchy.errors import HierarchyError, brief, check_choice, expect, refuse
from hierarchy.gate import check_rows, shaped
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.records import PLAIN, Check, check_fields, equal
from hierarchy.robot import Frame, Robot
from hierarchy.state import State

Level = Literal["velocity", "acceleration", "torque"]
Writer = Callable[[], object]  # of rows, see `Task.writer`
Kind = Literal["equality", "inequality"]

_ROUNDING = 1e-9  # of a period, relative
_STEP = 2.0**-10  # [s] of the differences that give the derivative of a Jacobian
_GAINS = ("stiffness", "damping", "gain")
_BINDS = ("measure", "writer", "distances", "follow_cone_error")  # a kernel
_OF_STATE = ("error", "jacobian", "jacobian_derivative", "desired_velocity",
             "desired_acceleration", "reference_velocity", "reference_acceleration",
             "error_reader", "rows", "box", "clamp", *_BINDS)


def _made(kind: type, remedy: str) -> Check:
    """Return a check of a part of a task; a task has no robot at hand to look up a name."""
    def check(what: str, value: object) -> None:
        if isinstance(value, str) and "NAME" in remedy:
            raise HierarchyError(f"{what} is the name {value!r}; give "
                                 f"{remedy.replace('NAME', repr(value))}")
        expect(what, value, kind, f"give {remedy}")

    return check


_PARTS: dict[Any, Check] = {  # of a task, by the type of the field
    **PLAIN, Sequence[ControlPoint]: lambda what, value: refuse(
        not len(pack_points(value).joints), f"{what}: expected at least one control point"),
    Robot: _made(Robot, "Robot.load(NAME)"), Frame: _made(Frame, "robot.frame(NAME)"),
    Path: _made(Path, "a path of hierarchy.paths, such as Still([x, y, z])"),
    Contacts: _made(Contacts, "Contacts(robot, ...) of hierarchy.contacts"),
    Barrier: _made(Barrier, "Barrier(distance) of hierarchy.avoidance")}


class Rows(NamedTuple):
    """Where a task writes its rows: A (m, n), lower and upper (m,), in the arrays of a stack."""

    A: Array
    lower: Array
    upper: Array

    @classmethod
    def empty(cls, m: int, n: int) -> Rows:
        """Return rows of their own, of zeros."""
        return cls(np.zeros((m, n)), np.zeros(m), np.zeros(m))

    def split(self, sizes: Sequence[int]) -> list[Rows]:
        """Return parts of so many rows each, as views."""
        return [Rows(*(part[end - size:end] for part in self))
                for size, end in zip(sizes, np.cumsum(sizes).tolist(), strict=True)]


class Task(ABC):
    """m rows over the joints: J v = dp/dt, or J a + dJ/dt v = d2p/dt2. Abstract.

    A new task needs `name`, `dimension` (m) or `row_names`, `error`, `jacobian` and
    `jacobian_derivative`. The closed loop is, with the error e = p_d - p (equations (7), (12) and
    [19] of the letter):

    - velocity level: dp/dt = dp_d/dt + gain e
    - acceleration level: d2p/dt2 = d2p_d/dt2 + damping (dp_d/dt - J v) + stiffness e

    With `kind` "equality" the rows require this value, with "inequality" at least this value (for
    an upper bound, write rows of opposite sign). The gains stiffness [1/s^2], damping [1/s] and
    gain [1/s] are 0 unless given; a stack reads those of shipped tasks once.

    A task with `of_forces` has rows over accelerations and contact forces, see `ForceTask`; all
    others have rows over the joints, and serve in a stack at level "torque" unchanged.
    """

    name: str
    kind: Kind = "equality"
    of_forces: ClassVar[bool] = False  # whether contact forces enter the rows
    straight: bool = False  # whether the Jacobian is the same at every configuration
    scale: float = 1.0  # a miss that counts as much as 1 m, rad, m/s^2, ... of other tasks
    contacts: Contacts | None  # whose forces these are; only then
    stiffness: float = 0.0
    damping: float = 0.0
    gain: float = 0.0

    def __init_subclass__(cls) -> None:
        """Let the methods that take a state refuse anything else, and `==` compare arrays."""
        super().__init_subclass__()
        if "__eq__" not in vars(cls):  # a dataclass writes one that raises on arrays
            cls.__eq__ = equal  # type: ignore[method-assign]
        for name in _OF_STATE:
            if callable(vars(cls).get(name)):  # `rows` may be a field
                setattr(cls, name, _of_state(vars(cls)[name], name in _BINDS))

    def __post_init__(self) -> None:
        """Check what the task was made with; raises HierarchyError.

        Dataclasses call it. An override calls it too.
        """
        refuse(not isinstance(self.name, str) or not self.name, f"{type(self).__name__}: name: "
               f"expected a text, got {brief(self.name)}")
        check_choice(f"task {self.name!r}: kind", self.kind, get_args(Kind))
        if is_dataclass(self):
            check_fields(self, f"task {self.name!r}", _PARTS, free=_GAINS)
        check_gains(self)

    def refuse(self, wrong: object, said: str) -> None:
        """Raise a HierarchyError that names the task, and says what is wrong, if it is."""
        refuse(wrong, f"task {self.name!r}: {said}")

    @property
    def dimension(self) -> int:
        """Number of rows m; by default there is one for each of `row_names`."""
        self.refuse(type(self).row_names is Task.row_names, "its class gives no dimension")
        return len(self.row_names)

    @property
    def row_names(self) -> tuple[str, ...]:
        """What each row is about, m names for messages; by default "row 0", "row 1", ..."""
        return tuple(f"row {i}" for i in range(self.dimension))

    def on(self, robot: Robot) -> Task:
        """Return the task for a robot, of which all methods are asked; by default the task itself.

        A task whose number of rows depends on the robot returns one of its class that knows it.
        """
        return self

    def error(self, state: State) -> Array:
        """Error p_d - p at a state: (m,), in the task's unit; by default the reader gives it."""
        self.refuse(type(self).error_reader is Task.error_reader, "its class gives no error")
        return self.error_reader(state)()

    def error_reader(self, state: State) -> Callable[[], Array]:
        """Return a function that returns the error at a state as it is when called."""
        return lambda: self._row("error", self.error(state))

    @abstractmethod
    def jacobian(self, state: State) -> Array:
        """Jacobian J = dp/dq at a state: (m, n)."""

    @abstractmethod
    def jacobian_derivative(self, state: State) -> Array:
        """Time derivative of the Jacobian at a state: (m, n)."""

    def desired_velocity(self, state: State) -> Array:
        """Feedforward dp_d/dt: (m,), zero by default."""
        return np.zeros(self.dimension)

    def desired_acceleration(self, state: State) -> Array:
        """Feedforward d2p_d/dt2: (m,), zero by default."""
        return np.zeros(self.dimension)

    def reference_velocity(self, state: State) -> Array:
        """Reference of the task velocity at velocity level: (m,)."""
        return (self._row("desired_velocity", self.desired_velocity(state))
                + self.gain * self._row("error", self.error(state)))

    def reference_acceleration(self, state: State) -> Array:
        """Reference of the task acceleration at acceleration level: (m,)."""
        rate = (self._row("desired_velocity", self.desired_velocity(state))
                - self.jacobian(state) @ state.v)
        return (self._row("desired_acceleration", self.desired_acceleration(state))
                + self.damping * rate + self.stiffness * self._row("error", self.error(state)))

    def _row(self, what: str, value: ArrayLike) -> Array:
        """Return what a method gave for each row (m,), or one number for the only row."""
        return shaped(f"task {self.name!r}: {what}", np.atleast_1d(value), (self.dimension,))

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """Return a function that writes this task's rows for the present values of the state.

        A stack keeps the writer as long as the state, and the measurement that it carries, are the
        same objects. This general form calls the methods above; tasks override it with a kernel
        bound to its arrays. A call raises HierarchyError, naming task and row, if a method returns
        the wrong shape or NaN.
        """
        what, (A, lower, upper) = f"task {self.name!r}", rows

        def write() -> None:
            A[:] = shaped(f"{what}: jacobian", self.jacobian(state), A.shape)
            if level == "velocity":
                sides = self.reference_velocity(state)
            else:
                drift = shaped(f"{what}: jacobian_derivative", self.jacobian_derivative(state),
                               A.shape) @ state.v
                sides = self.reference_acceleration(state) - drift
            lower[:] = shaped(f"{what}: reference", sides, lower.shape)
            upper[:] = lower if self.kind == "equality" else np.inf
            check_rows(what, *rows)

        return write


def check_gains(task: Task, rows: int | None = None) -> None:
    """Raise a HierarchyError for a gain that is not a number >= 0, or one for each of `rows`."""
    for gain in _GAINS:
        value = getattr(task, gain)
        try:
            sides = np.asarray(value)
            sound = bool(sides.dtype.kind in "iuf" and ((sides >= 0.0) & (sides < np.inf)).all())
        except (TypeError, ValueError):
            sound = False
        refuse(not sound, f"task {task.name!r}: {gain} = {value!r}, expected a number >= 0")
        refuse(rows is not None and sides.shape not in ((), (1,), (rows,)), f"task {task.name!r}: "
               f"{gain} has the shape {sides.shape}, expected a number or ({rows},)")


def check_period(task: Task, period: float, level: Level = "velocity") -> None:
    """Raise a HierarchyError unless a task suits commands that are held for `period` [s].

    A period of the task, or of one in it, is that one, and its error must not grow by itself: after
    a tick it is 1 - gain period times what it was, so gain period is at most 2. So is, at the other
    levels, damping period, for the rate of the error. A barrier lets (rate period) times the
    distance that is left go in a tick, so rate period is at most 1.
    """
    what, of = ("gain", "error") if level == "velocity" else ("damping", "rate")
    for part in (task, *parts(task)):
        own = getattr(part, "period", period)
        refuse(abs(own - period) > _ROUNDING * period, f"task {part.name!r}: its period is "
               f"{own:g} s, that of the commands {period:g} s; give both the same")
        gain = np.max(np.asarray(getattr(part, what), dtype=float), initial=0.0)
        refuse(gain * period > 2.0 * (1.0 + _ROUNDING), f"task {part.name!r}: {what} = {gain:g} 1/s"
               f" times the period of {period:g} s is {gain * period:g}; above 2 its {of} grows "
               f"from tick to tick, so give at most {2.0 / period:g} 1/s")
        rate = part.barrier.rate if hasattr(part, "barrier") else 0.0
        refuse(rate * period > 1.0 + _ROUNDING, f"task {part.name!r}: rate = {rate:g} 1/s times "
               f"the period of {period:g} s is {rate * period:g}; above 1 a tick may take more "
               f"than the distance left, so give at most {1.0 / period:g} 1/s")


def curved(tasks: Iterable[Task], joints: int) -> frozenset[str]:
    """Return the names of tasks whose rows, or what tasks above leave of them, bend.

    Those are all, most important first, but straight ones that are at the top or have a row for
    each of the `joints`.
    """
    names, bent = set[str](), False
    for task in tasks:
        if not task.straight or (bent and task.dimension < joints):
            names.add(task.name)
        bent |= not task.straight
    return frozenset(names)


def parts(task: Task) -> Iterator[Task]:
    """Yield the tasks that are fields of a task, and the tasks in these."""
    for value in vars(task).values():
        for part in value if isinstance(value, list | tuple) else (value,):
            if isinstance(part, Task):
                yield part
                yield from parts(part)


def _of_state(method: Callable[..., Any], binds: bool) -> Callable[..., Any]:
    """Return a method of a task, for the robot of a state, that refuses anything but a State.

    One that binds a kernel, which looks at no index, refuses the state of another robot, and a
    writer arrays of another size.
    """
    @wraps(method)
    def checked(self: Task, state: State, *rest: Any, **named: Any) -> Any:
        if not isinstance(state, State):
            expect(f"task {self.name!r}: state", state, State, "make one with State.at(robot, q)")
        known = self.on(state.robot)
        if binds:
            _check_robot(known, state.robot)
        if method.__name__ == "writer":
            _check_rows(known, state, *rest, **named)
        return method(known, state, *rest, **named)

    return checked


def _check_robot(task: Task, robot: Robot) -> None:
    for name, value in vars(task).items():
        what, own = f"task {task.name!r}: {name}", getattr(value, "robot", value)
        if isinstance(own, Robot):
            robot.check_same(what, own)
        for part in value if isinstance(value, list | tuple) else (value,):
            if isinstance(joint := getattr(part, "joint", None), int):
                robot.check_joint(what, joint, getattr(part, "of", ""))


def _check_rows(task: Task, state: State, level: Level, rows: Rows) -> None:
    contacts = task.contacts if task.of_forces else None
    shape = task.dimension, state.n if contacts is None else contacts.unknowns
    given = rows.A.shape, rows.lower.shape, rows.upper.shape
    task.refuse(given != (shape, shape[:1], shape[:1]),
                f"its rows are {shape}, and arrays of {rows.A.shape} were made; make another stack")


def seen_by(task: Task, state: State, points: Sequence[ControlPoint]) -> Measurement:
    """Return what a state has measured of the points of a task; HierarchyError for anything else.

    The end effector, which is measured last, need not be one of them.
    """
    if (seen := state.measurement) is None:
        raise HierarchyError(f"task {task.name!r}: the state carries no measurement; let a sensor "
                             "measure it first, see docs/loop.md")
    spare = len(seen.distance) - len(points)
    task.refuse(spare not in (0, 1), f"{len(points)} control points, and distances of "
                f"{len(seen.distance)}")
    return seen


def in_turn(*functions: Writer) -> Writer:
    """Return a function that calls some, or the only one."""
    def call() -> None:
        for function in functions:
            function()

    return call if len(functions) > 1 else functions[0]


def writer_in_stack(task: Task, state: State, level: Level, rows: Rows) -> Writer:
    """Return the writer of a task; at level "torque" one of the joints writes their columns."""
    check_choice(f"task {task.name!r}: kind", task.kind, get_args(Kind))
    check_gains(task, rows.lower.size)
    if level == "torque" and not task.of_forces:
        level, rows = "acceleration", rows._replace(A=rows.A[:, :state.n])
    try:
        return task.writer(state, level, rows)
    except HierarchyError as error:
        if repr(task.name) in str(error):
            raise
        raise HierarchyError(f"task {task.name!r}: {error}") from error


class Written(Task):
    """A task whose equations are in its writer alone; the plain methods read them there. Abstract.

    A new one needs `dimension` or `row_names`, `error` and `writer`.
    """

    @abstractmethod
    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""

    def rows(self, state: State, level: Level = "velocity") -> Rows:
        """The rows at a state; of forces, see `ForceTask`."""
        check_choice(f"task {self.name!r}: level", level, get_args(Level))
        contacts = self.contacts if self.of_forces else None
        if self.of_forces:
            level = "acceleration" if contacts is None else "torque"
        rows = Rows.empty(self.dimension, state.n if contacts is None else contacts.unknowns)
        self.writer(state, level, rows)()
        return rows

    def jacobian(self, state: State) -> Array:
        """The rows over the unknowns (m, n)."""
        return self.rows(state).A

    def jacobian_derivative(self, state: State) -> Array:
        """Their exact time derivative (m, n), by differences: to some 1e-9."""
        return derivative(self, state)

    def reference_velocity(self, state: State) -> Array:
        """The least velocity of the task (m,)."""
        return self.rows(state).lower

    def reference_acceleration(self, state: State) -> Array:
        """The least acceleration of the task (m,)."""
        return self.rows(state, "acceleration").lower + self.jacobian_derivative(state) @ state.v


def derivative(task: Task, state: State) -> Array:
    """Return the time derivative of a Jacobian (m, n) by differences along the velocity."""
    coarse, fine = ((task.jacobian(_moved(state, h)) - task.jacobian(_moved(state, -h)))
                    / (2.0 * h) for h in (_STEP, _STEP / 2.0))
    return np.asarray((4.0 * fine - coarse) / 3.0)


def _moved(state: State, step: float) -> State:
    """Return the state beside one, moved by `step` [s] along its velocity; it has seen the same."""
    beside = state.beside
    beside.move(state.t + step, state.robot.integrate(state.q, state.v * step), state.v)
    beside.measurement = state.measurement
    return beside
