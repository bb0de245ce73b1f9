"""A robot that follows its command exactly, integrated over one period."""

from __future__ import annotations

# mypy: disable-error-code="no-untyped-def"
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy import Robot
from hierarchy.jit import compiled
from hierarchy.problem import Array
from hierarchy.task import Level
from hierarchy.tasks.mechanism import Mechanism


class KinematicArm:
    """Integrator: q += v T + a T^2 / 2, v += a T, or at velocity level q += x T, v = x.

    Joints that follow others, and closed chains, stay so: after a step q and v are moved back onto
    the robot's mechanism. `q` (nq,), `v` (n,) hold the state, `a` (n,) the acceleration of the last
    step [rad, s]; `extra` is empty.
    """

    def __init__(self, robot: Robot, q: Array, v: Array, period: float, level: Level) -> None:
        self.q, self.v, self.a = q.copy(), v.copy(), np.zeros(robot.n)
        self.extra: dict[str, NDArray[Any]] = {}
        self._robot, self._period = robot, period
        self._acceleration = int(level == "acceleration")
        self._step = np.zeros(robot.n)
        self._turning = robot.nq != robot.n  # joints with more coordinates than velocities
        self._q = np.zeros(robot.n) if self._turning else self.q
        self._mechanism = Mechanism(robot)

    def act(self, command: Array) -> None:
        """Apply a command (n,) for one period."""
        _integrate(command, self._period, self._acceleration, self.v, self.a, self._step,
                   self._q)
        if self._turning:
            self.q = self._robot.integrate(self.q, self._step)
        if self._mechanism:
            self.q[:] = self._mechanism.closed(self.q)
            self.v[:] = self._mechanism.moving(self.q, self.v)


@compiled
def _integrate(x, T, acceleration, v, a, step, q):
    for i in range(len(v)):
        if acceleration:
            a[i] = x[i]
            step[i] = v[i] * T + x[i] * T * T / 2
            v[i] += x[i] * T
        else:
            a[i] = (x[i] - v[i]) / T
            step[i] = x[i] * T
            v[i] = x[i]
        q[i] += step[i]
