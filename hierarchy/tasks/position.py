"""Position of a frame along a path, with the repulsion of the end effector of eq. (30)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hierarchy.avoidance.measurement import Measurement
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    drift_of_point,
    point_at,
    write_equality,
    write_point_jacobian,
    write_point_jacobian_derivative,
)
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level, Task, along


@dataclass(frozen=True)
class Position(Task):
    """Move the origin of `frame` along `path` (m = 3) [m].

    stiffness [1/s^2] and damping [1/s] act at acceleration level, gain [1/s] at velocity level.
    With `repulsion_within` > 0 [m] (eps_ee), the repulsive vector (27) of the end effector is added
    to the reference, eq. (30), while its distance to the obstacles is at most that.
    """

    frame: Frame
    path: Path
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    repulsion_within: float = -1.0
    name: str = "position"

    @property
    def dimension(self) -> int:
        """Three rows."""
        return 3

    @property
    def row_names(self) -> tuple[str, ...]:
        """The axes of the world."""
        return ("x", "y", "z")

    def error(self, state: State) -> Array:
        """p_d - p (3,) [m]."""
        target: Array = self.path(state.t)[0]
        return target - state.position(self.frame)

    def jacobian(self, state: State) -> Array:
        """Linear Jacobian of the frame's origin (3, n) [m]."""
        J = np.empty((3, state.n))
        write_point_jacobian(state.J, state.placements, state.supports, self.frame.joint,
                             self.frame.offset, J, 0)
        return J

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (3, n) [m/s]."""
        dJ = np.empty((3, state.n))
        write_point_jacobian_derivative(state.kinematics, self.frame.joint, self.frame.offset, dJ)
        return dJ

    def desired_velocity(self, state: State) -> Array:
        """dp_d/dt (3,) [m/s]."""
        return np.asarray(self.path(state.t)[1])

    def desired_acceleration(self, state: State) -> Array:
        """d2p_d/dt2 (3,) [m/s^2]."""
        return np.asarray(self.path(state.t)[2])

    def reference_velocity(self, state: State) -> Array:
        """Closed loop plus repulsion (3,) [m/s]."""
        return super().reference_velocity(state) + self.repulsion(state)

    def reference_acceleration(self, state: State) -> Array:
        """Closed loop plus repulsion (3,) [m/s^2], eq. (30)."""
        return super().reference_acceleration(state) + self.repulsion(state)

    def repulsion(self, state: State) -> Array:
        """Repulsive vector (27) of the end effector (3,), zero beyond `repulsion_within`."""
        seen = state.measurement
        if seen is None or not seen.distance[-1] <= self.repulsion_within:
            return np.zeros(3)
        return np.asarray(seen.magnitude[-1] * seen.direction[-1])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        seen, target = state.measurement, np.empty((3, 3))  # p_d, dp_d/dt, d2p_d/dt2
        parameters = _Parameters(self.frame.joint, self.frame.offset, target, self.stiffness,
                                 self.damping, self.gain, level == "acceleration",
                                 self.repulsion_within)
        write_rows = bind(_write, state.kinematics, parameters,
                          _NOTHING_SEEN if seen is None else seen.arrays, A, lower, upper, row)
        return along(self.path, target, state, write_rows)


_NOTHING_SEEN = Measurement(0).arrays


class _Parameters(NamedTuple):
    joint: int
    offset: Array
    target: Array
    stiffness: float
    damping: float
    gain: float
    acceleration: bool
    repulsion_within: float


@compiled
def _write(kinematics, parameters, seen, A, lower, upper, row):
    joint, offset, target, stiffness, damping, gain, acceleration, repulsion_within = parameters
    write_point_jacobian(kinematics.J, kinematics.placements, kinematics.supports, joint, offset,
                         A, row)
    velocity = drift = (0.0, 0.0, 0.0)
    if acceleration:
        vx, vy, vz, ax, ay, az, _, _, _ = drift_of_point(kinematics, joint, offset[0], offset[1],
                                                         offset[2])
        velocity, drift = (vx, vy, vz), (ax, ay, az)
    last = len(seen.distance) - 1
    for i in range(3):
        error = target[0, i] - point_at(kinematics.placements, joint, offset, i)
        if acceleration:
            rate = target[1, i] - velocity[i]
            b = target[2, i] + damping * rate + stiffness * error - drift[i]
        else:
            b = target[1, i] + gain * error
        if seen.distance[last] <= repulsion_within:
            b += seen.magnitude[last] * seen.direction[last, i]  # (30)
        write_equality(lower, upper, row + i, b)
