"""Pose of a frame by the logarithm of SE(3) (m = 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import Kinematics
from hierarchy.measured import Measured, Motion, plain
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.tasks.geometric import Placed, cross
from hierarchy.tasks.pose import PoseTask, rotation_vector

_SERIES = 0.01   # [rad^2] squared angle below which coefficients are taken from their series
_STEP = 1e-30    # of a complex step: no difference is formed, so it may be this small


@dataclass(frozen=True)
class FrameLog(PoseTask, Measured):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    The error is e = log(T^-1 T_d), with the poses T of the frame and T_d of its target: the twist
    in the axes of the frame, linear part first, that takes it to the target in unit time. The frame
    moves on a screw, where with `Pose` its origin moves on a straight line. It is what `FrameTask`
    of pink and of placo are. Beyond half a turn the error jumps. The derivative is always exact.

    Source: F. Bullo, R. Murray, "Proportional derivative (PD) control on the Euclidean group",
    European Control Conference (1995).
    """

    name: str = "frame"
    columns = np.arange(6)
    exact = True

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`."""
        return _frame_log, (self, state)

    def goal(self, state: State) -> Array:
        """The part of de/dt that comes from the path, and its derivative, in rows 1 and 2."""
        return np.zeros((3, 6))

    def follow(self, state: State, goal: Array) -> None:
        """The measure writes the goal, which depends on the error."""


@plain
def _frame_log(kinematics: Kinematics, reads: tuple[FrameLog, State], goal: Array, J: Array,
               motion: Motion) -> None:
    """J = D(e) J_b, with the Jacobian J_b of the frame in its own axes; de/dt = D(-e) V_d - J v."""
    task, state = reads
    v, placed, R_d = state.v, Placed.of(kinematics, task.frame), np.array(task.rotation, float)
    p_d, velocity, acceleration = task.path(state.t)
    R = placed.R
    turn, away = rotation_vector(R.T @ R_d), R.T @ (p_d - placed.p)
    K = cross(turn)
    e = np.concatenate([away - K @ away / 2 + _of_angle(turn @ turn)[0] * (K @ K @ away), turn])
    J_b = _own_axes(R, placed.J)
    dJ_b = _own_axes(R, placed.dJ) - _own_axes(R, _both(cross(placed.J[3:] @ v)) @ placed.J)
    J[:] = _left(e) @ J_b
    goal[1] = _left(-e) @ np.append(R_d.T @ velocity, np.zeros(3))
    rate = goal[1] - J @ v
    goal[2] = (_left(-e) @ np.append(R_d.T @ acceleration, np.zeros(3))
               + _along(-e, -rate) @ np.append(R_d.T @ velocity, np.zeros(3)))
    motion.error[:], motion.rate[:] = e, J @ v
    motion.drift[:] = _left(e) @ (dJ_b @ v) + _along(e, rate) @ (J_b @ v)


def _both(A: NDArray[Any]) -> NDArray[Any]:
    """Return the matrix (6, 6) that does to both parts of a twist what A (3, 3) does to one."""
    return np.kron(np.eye(2), A)


def _own_axes(R: Array, J: Array) -> Array:
    """Return a Jacobian (6, n) in the axes of its frame."""
    return _both(R.T) @ J


def _left(e: NDArray[Any]) -> NDArray[Any]:
    """D(e) (6, 6): de/dt = -D(e) V for a frame that moves with the twist V in its own axes.

    It is the inverse of the left Jacobian of SE(3) at e: I - ad / 2 + A ad^2 + B ad^4.
    """
    linear, angular = cross(e[:3]), cross(e[3:])
    ad = np.block([[angular, linear], [np.zeros((3, 3)), angular]])
    _, A, B = _of_angle(e[3:] @ e[3:])
    square = ad @ ad
    return np.asarray(np.eye(6) - ad / 2 + A * square + B * square @ square)


def _of_angle(square: Any) -> tuple[Any, Any, Any]:
    """Coefficients of SO(3), and A and B of SE(3), at a squared angle [rad^2]."""
    if square.real < _SERIES:
        return (1 / 12 + square / 720 + square**2 / 30240 + square**3 / 1209600,
                1 / 12 - square**2 / 30240 - square**3 / 604800,
                -1 / 720 - square / 15120 - square**2 / 403200)
    half = np.sqrt(square) / 2
    alpha, beta = half / np.tan(half), (half / np.sin(half))**2
    return ((1 - alpha) / square, (2 * (1 - alpha) + (alpha - beta) / 2) / square,
            (1 - alpha + (alpha - beta) / 2) / square**2)


def _along(e: Array, rate: Array) -> Array:
    """The derivative of D at e along `rate`, by a complex step: exact to rounding."""
    return np.asarray(_left(e + 1j * _STEP * rate).imag / _STEP)
