"""The mechanism of a robot: joints that follow others, and chains that are closed.

A model of a robot is a tree. What its file says beyond that holds whatever the tasks ask for, so
these rows stand at the top of a stack.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Task
from hierarchy.tasks.coupling import FollowedJoints
from hierarchy.tasks.relative import RelativePose
from hierarchy.tasks.together import Together

MECHANISM = "mechanism"  # the name of the rows in a stack
_FASTEST = 50.0          # [1/s] at which an error dies away
_PER_PERIOD = 0.25       # share of it in a period, at most
_MOST_STEPS = 100        # to close a mechanism; three take 1 mm to rounding
_CLOSED = 1e-9           # [m or rad] from where on a step that gains nothing is rounding
_EXACT = 1e-13           # [m, rad or their rates] what nothing is done about
_LEAST_DAMPING = 1e-4
_INDEPENDENT = 1e-5      # singular value, relative to the largest, of a row that is one


def model_rows(robot: Robot, period: float = 0.001) -> list[Task]:
    """Return the rows of `robot.coupled` and `robot.loops` as one task, or an empty list.

    A joint that is coupled has one row, a loop the three of a common origin, or six if it is rigid.
    They come first in a stack with commands every `period` [s], whose errors then die away at a
    rate of 50 / s, or a quarter of an error per period if that is slower. At level "torque" the
    accelerations keep the mechanism, and torques of all joints make them: the mechanism itself then
    transmits no force, and every joint needs a motor.
    """
    rate = min(_FASTEST, _PER_PERIOD / period)
    gains = rate**2, 2.0 * rate, rate
    parts: list[Task] = []
    if robot.coupled:
        parts.append(FollowedJoints(robot, robot.coupled, *gains))
    for loop in robot.loops:
        frame, to = map(robot.frame, loop.frames)
        parts.append(RelativePose(frame, to, (0.0, 0.0, 0.0), np.eye(3) if loop.rigid else None,
                                  *gains, loop.name))
    return [Together(parts, MECHANISM)] if parts else []


def above(rows: Sequence[Task], limits: Sequence[Task], anywhere: bool) -> list[Task]:
    """Return the rows of a mechanism above limits, or below them for a resolver of bounds alone.

    Such a one takes bounds in the first level only; `anywhere` says that bounds may be lower.
    """
    return [*rows, *limits] if anywhere else [*limits, *rows]


@final
class Mechanism:
    """The mechanism of a robot, to close it at a configuration; for one without it does nothing."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._tasks, self._state = robot, model_rows(robot), State(robot)

    def __bool__(self) -> bool:
        return bool(self._tasks)

    def closed(self, q: ArrayLike, held: Iterable[str] = ()) -> Array:
        """Return the configuration (nq,) near q that the mechanism allows.

        Joints of the names in `held` stay where they are. It is found by the method of Levenberg
        and Marquardt. One that cannot be closed is closed as far as that takes it, see `gap`.
        """
        here = self._robot.normalised(q)
        if not self:
            return here
        moved, damping = self._free(held), 0.0
        J, error = self._rows(here)
        for _ in range(_MOST_STEPS if np.abs(error).max() > _EXACT else 0):
            there = self._robot.integrate(here, _solved(J * moved, error, damping))
            J_there, error_there = self._rows(there)
            if error_there @ error_there < error @ error:
                here, J, error, damping = there, J_there, error_there, damping / 10.0
            elif np.abs(error).max() < _CLOSED:
                break
            else:
                damping = max(10.0 * damping, _LEAST_DAMPING)
        return here

    def _free(self, held: Iterable[str]) -> Array:
        """Return 1 for each velocity (n,), 0 for those of joints that stay where they are."""
        free, fixed = np.ones(self._robot.n), {self._robot.joint(name) for name in held}
        for part in self._robot.parts:
            if part.joint in fixed:
                free[part.v:part.v + part.velocities] = 0.0
        return free

    def gap(self, q: ArrayLike) -> tuple[float, str]:
        """Return by how much it is open at q at most [m or rad], and in which row."""
        if not self:
            return 0.0, ""
        error = np.abs(self._rows(self._robot.normalised(q))[1])
        return float(error.max()), self._tasks[0].row_names[int(error.argmax())]

    def moving(self, q: ArrayLike, v: Array) -> Array:
        """Return the velocity (n,) nearest to v that it allows at q."""
        if not self:
            return v
        J = self._rows(self._robot.normalised(q))[0]
        beside = J @ v
        return v - _solved(J, beside) if np.abs(beside).max() > _EXACT else v

    def _rows(self, q: Array) -> tuple[Array, Array]:
        """Jacobian (m, n) and error (m,) at q."""
        self._state.move(0.0, q, self._state.v)
        return self._tasks[0].jacobian(self._state), self._tasks[0].error(self._state)


def _solved(J: Array, b: Array, damping: float = 0.0) -> Array:
    """Return the x (n,) of least norm that makes |J x - b|^2 + damping |x|^2 least."""
    U, s, V = np.linalg.svd(J, full_matrices=False)
    kept = s > _INDEPENDENT * s[0]
    return np.asarray(((U.T @ b)[kept] * s[kept] / (s[kept]**2 + damping)) @ V[kept])
