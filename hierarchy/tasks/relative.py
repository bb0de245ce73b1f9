"""Pose of a frame in another frame: two hands that hold one thing, a loop that is closed."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import finite_numbers
from hierarchy.gate import check_rotation
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import row_times, write_equality
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.geometric import (
    Geometric,
    Spot,
    View,
    cross,
    crossed,
    jacobians_of,
    less,
    motion_of,
    plus,
    position_of,
    rates_of,
    rotation_of,
    turned_back,
    view_of,
)
from hierarchy.tasks.pose import rotation_vector


@dataclass(frozen=True)
class RelativePose(Geometric):
    """Keep `frame` at `position` (3,) [m] and `rotation` (3, 3) in the axes of the frame `to`.

    m = 6, or 3 with `rotation` None: then only the position counts. The orientation error is the
    rotation vector from the actual to the desired orientation, in the axes of `to`.
    """

    frame: Frame
    to: Frame
    position: ArrayLike
    rotation: ArrayLike | None = None
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "relative"

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_numbers(f"task {self.name!r}: position", self.position, 3)
        if self.rotation is not None:
            check_rotation(f"task {self.name!r}: rotation", self.rotation)

    @property
    def dimension(self) -> int:
        """Six rows, or three without orientation."""
        return 3 if self.rotation is None else 6

    @property
    def row_names(self) -> tuple[str, ...]:
        """Axes of `to`."""
        return ("x", "y", "z", "about x", "about y", "about z")[:self.dimension]

    def error(self, state: State) -> Array:
        """Desired minus actual position [m], then the rotation vector [rad]: (m,)."""
        there, here = view_of(state).frame(self.frame), view_of(state).frame(self.to)
        missed = np.asarray(self.position, dtype=float) - here.R.T @ (there.p - here.p)
        if self.rotation is None:
            return np.asarray(missed)
        turn = np.asarray(self.rotation, dtype=float) @ (here.R.T @ there.R).T
        return np.concatenate([missed, rotation_vector(turn)])

    def rows(self, view: View) -> Array:
        """R^T (J_f - J_t + [d]x W_t) and R^T (W_f - W_t), of frame f and frame t, d = p_f - p_t."""
        R, linear, angular = self._parts(view)
        return np.vstack([R.T @ linear, R.T @ angular])[:self.dimension]

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`, with dR/dt = [w]x R."""
        view = view_of(state)
        there, here = view.frame(self.frame), view.frame(self.to)
        of, to = rates_of(state, self.frame, there), rates_of(state, self.to, here)
        R, linear, angular = self._parts(view)
        turning = cross(to.w)
        dlinear = (of.dJ - to.dJ + cross(of.v - to.v) @ here.W
                   + cross(there.p - here.p) @ to.dW - turning @ linear)
        return np.vstack([R.T @ dlinear,
                          R.T @ (of.dW - to.dW - turning @ angular)])[:self.dimension]

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        rotation = np.eye(3) if self.rotation is None else self.rotation
        parameters = _Parameters(
            Spot.of(self.frame), Spot.of(self.to), np.array(self.position, dtype=float),
            np.array(rotation, dtype=float), self.dimension, self.stiffness, self.damping,
            self.gain, level == "acceleration")
        return bind(_write, state.kinematics, parameters, A, lower, upper, row)

    def _parts(self, view: View) -> tuple[Array, Array, Array]:
        """R of `to`, and linear and angular Jacobian (3, n) relative to it, in world axes."""
        there, here = view.frame(self.frame), view.frame(self.to)
        linear = there.J - here.J + cross(there.p - here.p) @ here.W
        return here.R, linear, there.W - here.W


class _Parameters(NamedTuple):
    frame: Spot
    to: Spot
    position: Array
    rotation: Array
    rows: int
    stiffness: float
    damping: float
    gain: float
    acceleration: bool


@compiled
def _write_jacobian(J, placements, supports, parameters, A, row):
    frame, to = parameters.frame, parameters.to
    linear, angular = jacobians_of(J, placements, supports, frame)
    linear_to, angular_to = jacobians_of(J, placements, supports, to)
    R = rotation_of(placements, to.joint, to.rotation)
    d = less(position_of(placements, frame), position_of(placements, to))
    for c in range(A.shape[1]):
        w = (angular_to[0, c], angular_to[1, c], angular_to[2, c])
        apart = (linear[0, c] - linear_to[0, c], linear[1, c] - linear_to[1, c],
                 linear[2, c] - linear_to[2, c])
        moved = turned_back(R, plus(apart, crossed(d, w)))
        turned = turned_back(R, less((angular[0, c], angular[1, c], angular[2, c]), w))
        for i in range(3):
            A[row + i, c] = moved[i]
            if parameters.rows == 6:
                A[row + 3 + i, c] = turned[i]


@compiled
def _error(placements, parameters):
    """Error (6,), see `RelativePose.error`."""
    frame, to = parameters.frame, parameters.to
    R = rotation_of(placements, to.joint, to.rotation)
    d = turned_back(R, less(position_of(placements, frame), position_of(placements, to)))
    error, there = np.zeros(6), rotation_of(placements, frame.joint, frame.rotation)
    for i in range(3):
        error[i] = parameters.position[i] - d[i]
    if parameters.rows == 6:
        turn = np.zeros((3, 3))  # R_d (R^T R_f)^T = R_d R_f^T R
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    for m in range(3):
                        turn[i, j] += parameters.rotation[i, k] * there[m, k] * R[m, j]
        error[3:] = rotation_vector(turn)
    return error


@compiled
def _drift(kinematics, parameters):
    """Exact dJ/dt v (6,), with dR/dt = [w]x R."""
    frame, to = parameters.frame, parameters.to
    R = rotation_of(kinematics.placements, to.joint, to.rotation)
    d = less(position_of(kinematics.placements, frame), position_of(kinematics.placements, to))
    v, w, a, b = motion_of(kinematics, frame)
    v_to, w_to, a_to, b_to = motion_of(kinematics, to)
    apart = less(v, v_to)
    linear = plus(plus(less(a, a_to), crossed(apart, w_to)), crossed(d, b_to))
    linear = less(linear, crossed(w_to, plus(apart, crossed(d, w_to))))
    moved = turned_back(R, linear)
    turned = turned_back(R, less(less(b, b_to), crossed(w_to, less(w, w_to))))
    drift = np.empty(6)
    for i in range(3):
        drift[i], drift[3 + i] = moved[i], turned[i]
    return drift


@compiled
def _write(kinematics, parameters, A, lower, upper, row):
    v, J, _, placements, supports, previous_J, previous_placements, period = kinematics
    _write_jacobian(J, placements, supports, parameters, A, row)
    error, drift = _error(placements, parameters), np.zeros(6)
    if parameters.acceleration and period == 0.0:
        drift = _drift(kinematics, parameters)
    elif parameters.acceleration:
        before = np.empty((6, A.shape[1]))
        _write_jacobian(previous_J, previous_placements, supports, parameters, before, 0)
        for i in range(parameters.rows):
            drift[i] = (row_times(A, row + i, v) - row_times(before, i, v)) / period
    for i in range(parameters.rows):
        b = parameters.gain * error[i]
        if parameters.acceleration:
            b = (parameters.stiffness * error[i]
                 - parameters.damping * row_times(A, row + i, v) - drift[i])
        write_equality(lower, upper, row + i, b)
