"""Pose of a frame: by a rotation vector and a line, by the logarithm of SE(3), in another frame."""

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import finite_numbers
from hierarchy.gate import Rotation, readable
from hierarchy.jit import compiled
from hierarchy.kinematics import (
    Kinematics,
    Placed,
    Spot,
    column,
    cross,
    crossed,
    jacobians_of,
    less,
    motion_of,
    place,
    plus,
    rotation_of,
    rotation_vector,
    row_times,
    times_transposed,
    turned_back,
    write_point_jacobian,
    write_rotation_jacobian,
)
from hierarchy.measured import Measure, Measured, Motion, measured, plain
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State


@measured
def _pose(kinematics, reads, goal, J, motion):
    frame, desired = reads
    v, w, a, b = motion_of(kinematics, frame)
    at = len(motion.error) - 3  # of an orientation alone 0
    write_rotation_jacobian(kinematics, frame.joint, J[at:])
    motion.error[at:] = rotation_vector(times_transposed(
        desired, rotation_of(kinematics.placements, frame)))
    for i in range(3):
        motion.rate[at + i], motion.drift[at + i] = w[i], b[i]
    if at == 3:
        write_point_jacobian(kinematics, frame.joint, frame.offset, J)
        here = place(kinematics.placements[frame.joint], frame.offset)
        for i in range(3):
            motion.error[i], motion.rate[i], motion.drift[i] = goal[0, i] - here[i], v[i], a[i]


@dataclass(frozen=True)
class Pose(Measured):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    The orientation error is the rotation vector from the actual to the desired orientation, in
    world axes; the last three rows are those of the angular velocity. What is written into the
    array `rotation` turns the target, without feedforward.
    """

    frame: Frame
    path: Path = field()  # required here
    rotation: Rotation
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "pose"
    row_names = ("x", "y", "z", "about x", "about y", "about z")

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        return _pose, (Spot.of(self.frame), readable(self.name, self.rotation))


@dataclass(frozen=True)
class Orientation(Measured):
    """Turn `frame` to the constant orientation `rotation` (3, 3), wherever it is (m = 3) [rad].

    Its rows are the last three of `Pose`, and `rotation` can be written into as there. Beside a
    centre of mass it holds a trunk, whose position that already determines.
    """

    frame: Frame
    rotation: Rotation
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "orientation"
    row_names = Pose.row_names[3:]

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        return _pose, (Spot.of(self.frame), readable(self.name, self.rotation))


_SERIES = 0.01   # [rad^2] squared angle below which coefficients are taken from their series
_STEP = 1e-30    # of a complex step: no difference is formed, so it may be this small


@dataclass(frozen=True)
class FrameLog(Pose):
    """A pose whose error is a screw from the frame to its target (m = 6).

    It is e = log(T^-1 T_d), with the poses T of the frame and T_d of its target: the twist
    in the axes of the frame, linear part first, that takes it to the target in unit time. The frame
    moves on a screw, where with `Pose` its origin moves on a straight line. It is what `FrameTask`
    of pink and of placo are. Beyond half a turn the error jumps. The derivative is always exact.

    Source: F. Bullo, R. Murray, "Proportional derivative (PD) control on the Euclidean group",
    European Control Conference (1995).
    """

    name: str = "frame"
    columns = np.arange(6)
    exact = True

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        return _frame_log, (self, state)

    def follow(self, state: State, goal: Array) -> None:
        """The measure writes the goal: the part of de/dt that comes from the path, and its rate."""


@plain
def _frame_log(kinematics: Kinematics, reads: tuple[FrameLog, State], goal: Array, J: Array,
               motion: Motion) -> None:
    """J = D(e) J_b, with the Jacobian J_b of the frame in its own axes; de/dt = D(-e) V_d - J v."""
    task, state = reads
    v, placed, R_d = state.v, Placed.of(kinematics, task.frame), np.array(task.rotation, float)
    R, target = placed.R, task.path(state.t)
    turn, away = rotation_vector(R.T @ R_d), R.T @ (target[0] - placed.p)
    K = cross(turn)
    e = np.concatenate([away - K @ away / 2 + _of_angle(turn @ turn)[0] * (K @ K @ away), turn])
    to_frame, D, D_target = _both(R.T), _left(e), _left(-e)
    J_b = to_frame @ placed.J
    dJ_b = to_frame @ (placed.dJ - _both(cross(placed.J[3:] @ v)) @ placed.J)
    _, V_d, dV_d = np.hstack([target @ R_d, np.zeros((3, 3))])  # of the target in its own axes
    J[:], goal[1] = D @ J_b, D_target @ V_d
    rate = goal[1] - J @ v
    goal[2] = D_target @ dV_d + _along(-e, -rate) @ V_d
    motion.error[:], motion.rate[:] = e, J @ v
    motion.drift[:] = D @ (dJ_b @ v) + _along(e, rate) @ (J_b @ v)


def _both(A: NDArray[Any]) -> NDArray[Any]:
    """Return the matrix (6, 6) that does to both parts of a twist what A (3, 3) does to one."""
    return np.kron(np.eye(2), A)


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


@dataclass(frozen=True)
class RelativePose(Measured):
    """Keep `frame` at `position` (3,) [m] and `rotation` (3, 3) in the axes of the frame `to`.

    m = 6, or 3 with `rotation` None: then only the position counts. The orientation error is the
    rotation vector from the actual to the desired orientation, in the axes of `to`.
    """

    frame: Frame
    to: Frame
    position: Annotated[ArrayLike, partial(finite_numbers, size=3)]
    rotation: Rotation | None = None
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "relative"

    @property
    def row_names(self) -> tuple[str, ...]:
        """Axes of `to`: six, or three without orientation."""
        return Pose.row_names[:3 if self.rotation is None else 6]

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        rotation = np.eye(3) if self.rotation is None else self.rotation
        return _relative, (Spot.of(self.frame), Spot.of(self.to),
                           readable(self.name, self.position), readable(self.name, rotation))


@compiled
def _write_jacobian(kinematics, frame, to, R, d, J):
    """Write R^T (J_f - J_t + [d]x W_t) and R^T (W_f - W_t), with d = p_f - p_t."""
    linear, angular = jacobians_of(kinematics, frame)
    linear_to, angular_to = jacobians_of(kinematics, to)
    for c in range(J.shape[1]):
        w = column(angular_to, c)
        apart = less(column(linear, c), column(linear_to, c))
        moved = turned_back(R, plus(apart, crossed(d, w)))
        turned = turned_back(R, less(column(angular, c), w))
        for i in range(3):
            J[i, c] = moved[i]
            if J.shape[0] == 6:
                J[3 + i, c] = turned[i]


@measured
def _relative(kinematics, reads, goal, J, motion):
    """The drift is the exact dJ/dt v, with dR/dt = [w]x R."""
    frame, to, position, rotation = reads
    placements = kinematics.placements
    R = rotation_of(placements, to)
    d = less(place(placements[frame.joint], frame.offset), place(placements[to.joint], to.offset))
    _write_jacobian(kinematics, frame, to, R, d, J)
    v, w, a, b = motion_of(kinematics, frame)
    v_to, w_to, a_to, b_to = motion_of(kinematics, to)
    apart = less(v, v_to)
    linear = plus(plus(less(a, a_to), crossed(apart, w_to)), crossed(d, b_to))
    linear = less(linear, crossed(w_to, plus(apart, crossed(d, w_to))))
    here, moved = turned_back(R, d), turned_back(R, linear)
    for i in range(3):
        motion.error[i], motion.drift[i] = position[i] - here[i], moved[i]
    if len(motion.error) == 6:
        there = rotation_of(placements, frame)
        motion.error[3:] = rotation_vector(times_transposed(
            times_transposed(rotation, there), R.T))  # R_d (R^T R_f)^T
        moved = turned_back(R, less(less(b, b_to), crossed(w_to, less(w, w_to))))
        for i in range(3):
            motion.drift[3 + i] = moved[i]
    for i in range(len(motion.rate)):
        motion.rate[i] = row_times(J, i, kinematics.v)
