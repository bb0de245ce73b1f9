"""Inverse kinematics of a robot in one call: tasks in order of priority, within joint limits.

It is here, above the resolvers and below scenarios, because it joins a stack of `hierarchy` with a
resolver and needs nothing else. Like the adapters it meets pinocchio only through `hierarchy`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, brief, expect, number
from hierarchy.notebook import numbers
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.stack import Stack
from hierarchy.state import State
from hierarchy.task import Level, Task
from hierarchy.tasks.joint_rows import JointRows
from hierarchy.tasks.mechanism import above, model_rows
from solvers.resolver import Resolver, make
from solvers.status import Status


class Step(NamedTuple):
    """The answer of `solve_ik`: velocity v (n,), how the solve ended, memory for the next call."""

    v: Array
    status: Status
    memory: Array | None

    def __repr__(self) -> str:
        return f"Step({self.status.name}, v={numbers(self.v)})"


def solve_ik(robot: Robot, q: ArrayLike, tasks: Sequence[Task], *, dt: float = 0.01,
             limits: bool | Task = True, resolver: str | Resolver = "hcod",
             memory: Array | None = None, t: float = 0.0) -> Step:
    """Return the joint velocity that serves `tasks` at q, most important first.

    Move on with `q = robot.integrate(q, step.v * dt)`. A loop at a fixed rate saves the set-up of
    each call with a `Stack` and a `State` of its own, see docs/loop.md.

    Parameters
    ----------
    q : (nq,) joint positions [rad or m].
    tasks : tasks of `hierarchy.tasks`, plugins or your own, at velocity level.
    dt : period [s] for which the velocity will be held.
    limits : above all tasks, below the robot's mechanism: True for the position and velocity limits
        of the robot, False for none, or a task such as `JointLimits`, which also limits
        accelerations. Beyond a limit the joint moves back, as fast as its velocity limit allows.
    resolver : a name of `solvers.names()`, or a resolver; with limits it must take bounds.
    memory : that of the last call with the same tasks, to start from.
    t : time [s], for tasks that follow a path.

    Raises
    ------
    HierarchyError : q does not fit the robot, a task is none, dt is not positive, or the resolver
        cannot handle a row. A numerical failure is a status, with a finite v.
    """
    expect("solve_ik: robot", robot, Robot, "make one with Robot.load(name or file)")
    expect("solve_ik: tasks", tasks, Sequence, "give a list of tasks")
    if number("solve_ik: dt [s]", dt) <= 0.0:
        raise HierarchyError(f"solve_ik: dt = {dt} s must be positive and finite")
    if not isinstance(limits, bool | Task):
        raise HierarchyError("solve_ik: limits: expected True, False or a task, got "
                             f"{brief(limits)}")
    if not isinstance(resolver, str):
        expect("solve_ik: resolver", resolver, Resolver, "give a name of solvers.names()")
    solver = make(resolver) if isinstance(resolver, str) else resolver
    box = [limits] if isinstance(limits, Task) else [StepLimits(robot, dt)] if limits else []
    first = above(model_rows(robot, dt), box, solver.can_resolve("inequalities"))
    h = Stack([*first, *tasks], "velocity").hierarchy(State.at(robot, q, t=t))
    found = solver.solve(h, memory)
    return Step(found.x, found.status, found.memory)


@final
@dataclass(frozen=True)
class StepLimits(JointRows):
    """Keep each joint within its position limits after a step of `period` [s], and its speed.

    One row per velocity, those of a floating base too. Accelerations are not limited, so that a
    step does not depend on the one before; see `hierarchy.tasks.JointLimits` for limits that a
    robot can obey.
    """

    robot: Robot
    period: float
    name: str = "limits"
    kind = "inequality"
    first = 0

    def box(self, state: State) -> tuple[Array, Array]:
        """Least and largest velocities (n,), (n,) [rad/s or m/s]."""
        lower, upper = self.robot.position_limits()
        q, fastest = state.q[self.robot.coordinates], self.robot.velocity_limit
        return (np.clip((lower - q) / self.period, -fastest, fastest),
                np.clip((upper - q) / self.period, -fastest, fastest))

    def error(self, state: State) -> Array:
        """How far each velocity would have to be raised from zero (m,) [rad/s or m/s]."""
        return np.maximum(self.box(state)[0], 0.0)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; for velocity level."""
        if level != "velocity":
            raise HierarchyError(f"task {self.name!r}: for velocity level; see JointLimits")
        rows = slice(row, row + self.dimension)

        def write() -> None:
            A[rows] = self.jacobian(state)
            lower[rows], upper[rows] = self.box(state)

        return write
