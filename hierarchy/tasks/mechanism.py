"""The mechanism of a robot: joints that follow others, and chains that are closed.

A model of a robot is a tree. What its file says beyond that holds whatever the tasks ask for, so
these rows stand at the top of a stack.
"""

from __future__ import annotations

from collections.abc import Sequence

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
_TURNS_BACK = 20         # Newton steps of `closed`; five take 1 mm to rounding
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


def closed(robot: Robot, q: ArrayLike) -> Array:
    """Return the configuration (nq,) near q that the mechanism allows, or q itself without one.

    It is found by Newton's method, in steps of the least norm. Where the mechanism cannot be
    closed, it is closed as far as 20 steps take it, see `gap`.
    """
    here = robot.normalised(q)
    for task in model_rows(robot):
        least, best = np.inf, here
        for _ in range(_TURNS_BACK):
            state = State.at(robot, here)
            error = task.error(state)
            missed = float(np.abs(error).max())
            if not missed < least:
                break
            least, best = missed, here
            here = robot.integrate(here, np.linalg.lstsq(task.jacobian(state), error,
                                                         rcond=_INDEPENDENT)[0])
        here = best
    return here


def gap(robot: Robot, q: ArrayLike) -> tuple[float, str]:
    """Return by how much the mechanism is open at q, at most, and where [m or rad]; 0.0 and ""."""
    for task in model_rows(robot):
        error = np.abs(task.error(State.at(robot, q)))
        worst = int(error.argmax())
        return float(error[worst]), task.row_names[worst]
    return 0.0, ""


def moving_with(robot: Robot, q: ArrayLike, v: Array) -> Array:
    """Return the velocity (n,) nearest to v that the mechanism allows at q."""
    for task in model_rows(robot):
        J = task.jacobian(State.at(robot, q))
        v = v - np.linalg.lstsq(J, J @ v, rcond=_INDEPENDENT)[0]
    return v
