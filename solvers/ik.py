"""Inverse kinematics of a robot in one call: tasks in order of priority, within joint limits.

It is here, above the resolvers and below scenarios, because it joins a stack of `hierarchy` with a
resolver and needs nothing else. Like the adapters it meets pinocchio only through `hierarchy`.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from threading import local
from typing import NamedTuple, final, overload

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, brief, expect, expect_each, number, positive
from hierarchy.notebook import numbers
from hierarchy.problem import Array, Hierarchy
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Task, check_period, parts
from hierarchy.tasks.joints.joint_limits import StepLimits
from hierarchy.tasks.joints.mechanism import MECHANISM, Mechanism, bends
from hierarchy.words import listed
from solvers.reaching import Reached, reach, stacked
from solvers.resolver import Resolution, Resolver, make
from solvers.status import Status

_MOST_BENDS = 10   # corrections of the rows of a mechanism
_STRAIGHT = 1e-8   # [m/s, rad/s] change of a correction that ends them
_MOST_KEPT = 4     # set-ups, of the last calls with different objects
_warned: set[tuple[str, ...]] = set()  # joints without velocity limits that were named
_of_thread = local()  # in `kept` what its last calls have set up, by the identity of what they got


class Memory(NamedTuple):
    """What the next call of `solve_ik` starts from: the resolver's memory, and the last v (n,)."""

    resolver: Array | None
    v: Array

    def __repr__(self) -> str:
        return f"Memory(v={numbers(self.v)})"


class Step(NamedTuple):
    """The answer of `solve_ik`: velocity v (n,), how the solve ended, memory for the next call."""

    v: Array
    status: Status
    memory: Memory

    def __repr__(self) -> str:
        return f"Step({self.status.name}, v={numbers(self.v)})"


@overload
def solve_ik(robot: Robot, q: ArrayLike, tasks: Sequence[Task], *, dt: float = ...,
             limits: bool | Task = ..., resolver: str | Resolver = ...,
             memory: Memory | None = ..., v: ArrayLike | None = ..., t: float = ...,
             damping: float = ..., until: None = ...) -> Step: ...


@overload
def solve_ik(robot: Robot, q: ArrayLike, tasks: Sequence[Task], *, limits: bool = ...,
             resolver: str | Resolver = ..., t: float = ..., damping: float = ...,
             until: float) -> Reached: ...


def solve_ik(robot: Robot, q: ArrayLike, tasks: Sequence[Task], *, dt: float = 0.01,
             limits: bool | Task = True, resolver: str | Resolver = "hcod",
             memory: Memory | None = None, v: ArrayLike | None = None, t: float = 0.0,
             damping: float = 1.0, until: float | None = None) -> Step | Reached:
    """Return the joint velocity that serves `tasks` at q, most important first.

    Move on with `q = robot.integrate(q, step.v * dt)`. With the same objects, tasks among them, as
    one of the last calls of the thread, what that call has set up serves again, which saves most of
    the time. Of the tasks of `hierarchy` targets and gains that are written into are followed. For
    loops of a fixed rate see docs/loop.md.

    q : (nq,) joint positions [rad or m].
    tasks : tasks of `hierarchy.tasks`, plugins or your own, at velocity level.
    dt : period [s] for which the velocity will be held; that of all tasks which have one.
    limits : above all tasks, below the robot's mechanism: True for the position and velocity limits
        of the robot, approached with a gain of 0.25 / dt (`StepLimits`), False for none, or a task
        such as `JointLimits`, which also limits accelerations, from v on.
    resolver : a name of `solvers.names()`, or a resolver; with limits it must take bounds.
    memory : that of the last call with the same tasks, to start from; it has the last v too.
    v : (n,) velocity of the tick before, for limits of accelerations; None for that of `memory`.
    t : time [s], for tasks that follow a path.
    damping : of tasks where they cannot be met in time, near singularities and for targets out of
        reach, which come to rest; 0 for none, above 1 for more than the curvature of the robot
        asks. Elsewhere it changes nothing; see `solvers.resolvers.settled`.
    until : if given, the configuration in which the errors are at most this is looked for instead
        of a velocity, see `solvers.reaching.reach`, without dt, memory and v; `limits` is then
        True or False.

    Raises HierarchyError: q does not fit the robot, a task is none, dt is not positive or not the
    period of a task, a gain times dt is above 2 or a rate times dt above 1, or the resolver cannot
    handle a row. A numerical failure is a status, with a finite v.
    """
    expect("solve_ik: robot", robot, Robot, "make one with Robot.load(name or file)")
    expect_each("solve_ik: tasks", tasks, Task, "give a list of tasks")
    tasks = tuple(tasks)
    dt = positive("solve_ik: dt [s]", dt)
    if not isinstance(limits, bool | Task):
        raise HierarchyError("solve_ik: limits: expected True, False or a task, got "
                             f"{brief(limits)}")
    if not isinstance(resolver, str):
        expect("solve_ik: resolver", resolver, Resolver, "give a name of solvers.names()")
    damping = number("solve_ik: damping", damping, 0.0)
    if until is not None:
        speeds = {"limits": limits if isinstance(limits, Task) else None, "memory": memory, "v": v}
        for what, given in speeds.items():
            if given is not None:
                raise HierarchyError(f"solve_ik: {what}: not with until, got {brief(given)}: a "
                                     "configuration has no speed")
        return reach(robot, q, tasks, until, limits=limits is True, resolver=_resolver(resolver),
                     t=t, damping=damping)
    before = _before(memory, v, limits)
    kept: dict[tuple[float, ...], _SetUp] = vars(_of_thread).setdefault("kept", {})
    asked = id(robot), *map(id, tasks), id(limits), id(resolver), dt, damping
    made = kept.pop(asked, None)  # away meanwhile: a task may ask the same at another q
    if made is not None and made.fits():
        try:
            return made.step(q, t, *before)
        finally:
            kept[asked] = made
    made = _SetUp(robot, tasks, limits, resolver, dt, damping)
    step = made.step(q, t, *before)
    for oldest in list(kept)[:1 - _MOST_KEPT]:
        del kept[oldest]
    kept[asked] = made
    _warn_of_degrees(robot, made.state.q)
    if limits is True:
        _warn_of_speeds(robot)
    return step


def _resolver(asked: str | Resolver) -> Resolver:
    return make(asked) if isinstance(asked, str) else asked


def _before(memory: Memory | None, v: ArrayLike | None,
            limits: bool | Task) -> tuple[Array | None, ArrayLike | None]:
    """Return the memory of the resolver, and the velocity of the previous tick if known."""
    if memory is not None:
        expect("solve_ik: memory", memory, Memory, "give the memory of the last step")
        return memory.resolver, memory.v if v is None else v
    if v is None and isinstance(limits, Task) and hasattr(limits, "acceleration"):
        raise HierarchyError(f"solve_ik: limits: {limits.name!r} limits accelerations; give v, the "
                             "velocity of the tick before (zeros at rest), or the memory of the "
                             "last step, which has it")
    return None, v


def _warn_of_degrees(robot: Robot, q: Array) -> None:
    """Warn of a joint that is more than a turn beyond its limits, as no angle in radians is."""
    for part in robot.parts:
        i = part.q
        beyond = max(robot.lower[i] - q[i], q[i] - robot.upper[i])
        if part.size == 1 and part.unit == "rad" and beyond > 2.0 * np.pi:
            warnings.warn(f"solve_ik: {robot.coordinate_names[i]} at {q[i]:g} is far beyond its "
                          f"limits, {robot.lower[i]:.4g} to {robot.upper[i]:.4g}. Are these "
                          "degrees?", stacklevel=3)
            return


def _warn_of_speeds(robot: Robot) -> None:
    """Warn, once for each robot, of joints whose speed `limits=True` does not limit."""
    speeds = list(zip(robot.velocity_names, robot.velocity_limit, strict=True))[robot.actuated:]
    free = [name for name, limit in speeds if not np.isfinite(limit)]
    if free and (robot.name, *free) not in _warned:
        _warned.add((robot.name, *free))
        warnings.warn(f"robot {robot.name!r} has no velocity limit for {listed(free)}: limits=True "
                      "does not limit their speed; set robot.velocity_limit", stacklevel=3)


@final
class _SetUp:
    """What calls with the same objects share: a state, and the stack of the tasks over it."""

    def __init__(self, robot: Robot, tasks: Sequence[Task], limits: bool | Task,
                 resolver: str | Resolver, dt: float, damping: float) -> None:
        self.objects = robot, *tasks, limits, resolver  # kept, so that their `id` stays theirs
        self.state = State(robot)
        self.mechanism = Mechanism(robot) if bends(robot) else None
        box = [limits] if isinstance(limits, Task) else [StepLimits(robot, dt)] if limits else []
        self.stack, self.resolver = stacked(robot, tasks, dt, box, _resolver(resolver), damping)
        for task in (*box, *tasks):
            check_period(task, dt)
        self.tasks = [self.stack[task.name] for task in tasks]
        self.read = [value for task in tasks for part in (task, *parts(task))
                     if type(part).__module__.startswith("hierarchy.")
                     for name, value in vars(part).items() if _is_read_once(name, value)]
        self.was = self._now()

    def fits(self) -> bool:
        """Whether tasks have as many rows, which a user's may change, and what was read once."""
        return self._now() == self.was

    def _now(self) -> list[object]:
        return [*(task.dimension for task in self.tasks),
                *(value.tobytes() if isinstance(value, np.ndarray) else
                  repr([id(part) if isinstance(part, Task) else part for part in value])
                  for value in self.read)]

    def step(self, q: ArrayLike, t: float, memory: Array | None, v: ArrayLike | None) -> Step:
        """Return the answer at q and v; the memory is the resolver's."""
        state = self.state
        state.go(q, v, t)
        state.commanded = state.v.copy()
        found = self._solved(self.stack.hierarchy(state), memory)
        return Step(found.x, found.status, Memory(found.memory, found.x.copy()))

    def _solved(self, h: Hierarchy, memory: Array | None) -> Resolution:
        """Solve, and where the mechanism bends within the period again with that on its sides.

        Beside a singular configuration that may diverge: the first answer then counts.
        """
        plain = found = self.resolver.solve(h, memory)
        if self.mechanism is None:
            return found
        first, before, change = h.offsets[h.names.index(MECHANISM)], np.zeros(1), np.inf
        for _ in range(_MOST_BENDS):
            bend = self.mechanism.bend(self.state.q, found.x, self.resolver.period)
            last, change = change, np.abs(bend - before).max(initial=0.0)
            if change < _STRAIGHT:
                break
            if change > last:
                return plain
            lower, upper, rows = h.lower.copy(), h.upper.copy(), slice(first, first + len(bend))
            lower[rows] += bend
            upper[rows] += bend
            found = self.resolver.solve(h.changed(lower=lower, upper=upper), memory)
            before = bend
        return found


def _is_read_once(name: str, value: object) -> bool:
    """Whether a field of a task can be written into where a stack does not follow it."""
    return isinstance(value, list) or (isinstance(value, np.ndarray) and (
        name in ("stiffness", "damping", "gain") or value.dtype != np.float64
        or not value.flags.carray))
