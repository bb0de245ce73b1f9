"""Position and orientation of a frame together (m = 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.kinematics import (
    subtract_over_period,
    write_point_jacobian,
    write_point_jacobian_derivative,
    write_rotation_jacobian,
)
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Frame, State
from hierarchy.task import Task


@dataclass(frozen=True)
class Pose(Task):
    """Bring `frame` along `path` with the fixed orientation `rotation` (m = 6) [m, rad].

    The orientation error is the rotation vector from the actual to the desired orientation, in
    world axes; the rows below are those of the angular velocity. `rotation` (3, 3).
    """

    frame: Frame
    path: Path
    rotation: ArrayLike
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "pose"

    @property
    def dimension(self) -> int:
        """Six rows."""
        return 6

    def error(self, state: State) -> Array:
        """p_d - p [m], then the rotation vector of R_d R^T [rad]: (6,)."""
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
        write_point_jacobian_derivative(*state.arrays, self.frame.joint, self.frame.offset, dJ[:3])
        joint, supports = self.frame.joint, state.supports
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


def rotation_vector(R: Array) -> Array:
    """Rotation vector (3,) [rad] of a rotation matrix (3, 3), angle in 0 .. pi."""
    twist = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine, cosine = float(np.linalg.norm(twist)), float(np.trace(R) - 1.0) / 2
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-7:
        return np.asarray(twist * (angle / sine))
    if cosine > 0.0:
        return twist
    # Half a turn: the axis is the column of R + I with the largest diagonal entry.
    i = int(np.argmax(np.diag(R)))
    axis = R[:, i] + np.eye(3)[i]
    return np.asarray(axis * (angle / np.linalg.norm(axis)))
