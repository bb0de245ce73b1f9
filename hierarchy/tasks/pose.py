"""Position and orientation of a frame (m = 6)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.gate import check_rotation
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    drift_of_point,
    point_at,
    subtract_over_period,
    velocity_of_point,
    write_equality,
    write_point_jacobian,
    write_point_jacobian_derivative,
    write_rotation_jacobian,
)
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level, Task, along


@dataclass(frozen=True)
class PoseTask(Task):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    Abstract: its subclasses differ in the error.
    """

    frame: Frame
    path: Path
    rotation: ArrayLike
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "pose"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rotation(f"task {self.name!r}: rotation", self.rotation)

    @property
    def dimension(self) -> int:
        """Six rows."""
        return 6

    @property
    def row_names(self) -> tuple[str, ...]:
        """The axes of the world."""
        return ("x", "y", "z", "about x", "about y", "about z")


@dataclass(frozen=True)
class Pose(PoseTask):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    The orientation error is the rotation vector from the actual to the desired orientation, in
    world axes; the last three rows are those of the angular velocity.
    """

    def error(self, state: State) -> Array:
        """p_d - p [m], followed by the rotation vector of R_d R^T [rad]: (6,)."""
        turn = np.asarray(self.rotation, dtype=float) @ state.rotation(self.frame).T
        return np.concatenate([self.path(state.t)[0] - state.position(self.frame),
                               rotation_vector(turn)])

    def jacobian(self, state: State) -> Array:
        """Linear and angular Jacobian of the frame, world axes: (6, n)."""
        J = np.empty((6, state.n))
        write_point_jacobian(state.J, state.placements, state.supports, self.frame.joint,
                             self.frame.offset, J, 0)
        write_rotation_jacobian(state.J, state.supports, self.frame.joint, J, 3)
        return J

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (6, n)."""
        dJ, angular = np.empty((6, state.n)), np.empty((3, state.n))
        joint, supports = self.frame.joint, state.supports
        write_point_jacobian_derivative(state.kinematics, joint, self.frame.offset, dJ[:3])
        if state.period > 0.0:
            before = np.empty_like(angular)
            write_rotation_jacobian(state.J, supports, joint, angular, 0)
            write_rotation_jacobian(state.previous_J, supports, joint, before, 0)
            subtract_over_period(angular, before, state.period)
        else:
            write_rotation_jacobian(state.dJ, supports, joint, angular, 0)
        dJ[3:] = angular
        return dJ

    def desired_velocity(self, state: State) -> Array:
        """Velocity of the path, no rotation: (6,)."""
        return np.concatenate([self.path(state.t)[1], np.zeros(3)])

    def desired_acceleration(self, state: State) -> Array:
        """Acceleration of the path, no rotation: (6,)."""
        return np.concatenate([self.path(state.t)[2], np.zeros(3)])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        target = np.empty((3, 3))  # p_d, dp_d/dt, d2p_d/dt2
        parameters = _Parameters(self.frame.joint, self.frame.offset, self.frame.rotation, target,
                                 np.array(self.rotation, dtype=float), self.stiffness,
                                 self.damping, self.gain, level == "acceleration")
        write_rows = bind(_write, state.kinematics, parameters, A, lower, upper, row)
        return along(self.path, target, state, write_rows)


class _Parameters(NamedTuple):
    joint: int
    offset: Array
    rotation: Array  # of the frame in its body
    target: Array
    desired: Array  # rotation of the frame in the world
    stiffness: float
    damping: float
    gain: float
    acceleration: bool


@compiled
def rotation_vector(R):
    """Rotation vector (3,) [rad] of a rotation matrix (3, 3), angle in 0 .. pi."""
    twist = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    cosine = (R[0, 0] + R[1, 1] + R[2, 2] - 1.0) / 2
    angle = atan2(sine, cosine)
    if sine > 1e-7:
        return twist * (angle / sine)
    if cosine > 0.0:
        return twist
    # Half a turn: the axis is the column of R + I with the largest diagonal entry.
    i = 0
    for k in range(1, 3):
        if R[k, k] > R[i, i]:
            i = k
    axis = R[:, i].copy()
    axis[i] += 1.0
    return axis * (angle / sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2))


@compiled
def _turn(T, rotation, desired):
    """R_d R^T (3, 3) of a frame with `rotation` on the body whose placement is T (12,)."""
    R, turn = np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                R[i, j] += T[3 * k + i] * rotation[k, j]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                turn[i, j] += desired[i, k] * R[j, k]
    return turn


@compiled
def _write(kinematics, parameters, A, lower, upper, row):
    joint, offset, rotation, target, desired, stiffness, damping, gain, acceleration = parameters
    J, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    write_point_jacobian(J, placements, supports, joint, offset, A, row)
    write_rotation_jacobian(J, supports, joint, A, row + 3)
    error, velocity, drift = np.empty(6), np.zeros(6), np.zeros(6)
    for i in range(3):
        error[i] = target[0, i] - point_at(placements, joint, offset, i)
    error[3:] = rotation_vector(_turn(placements[joint], rotation, desired))
    if acceleration:
        (velocity[0], velocity[1], velocity[2], drift[0], drift[1], drift[2], velocity[3],
         velocity[4], velocity[5]) = drift_of_point(
            kinematics, joint, offset[0], offset[1], offset[2])
        drift[3:] = _turning(kinematics, joint)
    for i in range(6):
        rate, feedforward = (target[1, i], target[2, i]) if i < 3 else (0.0, 0.0)
        if acceleration:
            b = feedforward + damping * (rate - velocity[i]) + stiffness * error[i] - drift[i]
        else:
            b = rate + gain * error[i]
        write_equality(lower, upper, row + i, b)


@compiled
def _turning(kinematics, joint):
    """Drift (3,) of the angular velocity: exact or a backward difference."""
    v, J, dJ, _, supports, previous_J, _, period = kinematics
    if period > 0.0:
        _, _, _, x, y, z = velocity_of_point(J, supports, joint, v, 0.0, 0.0, 0.0)
        _, _, _, bx, by, bz = velocity_of_point(previous_J, supports, joint, v, 0.0, 0.0, 0.0)
        return np.array([x - bx, y - by, z - bz]) / period
    _, _, _, x, y, z = velocity_of_point(dJ, supports, joint, v, 0.0, 0.0, 0.0)
    return np.array([x, y, z])
