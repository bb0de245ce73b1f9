"""Look at a point: the z axis of a frame, such as a camera, toward a point of the world."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from hierarchy.jit import bind, compiled
from hierarchy.kinematics import row_times, write_equality
from hierarchy.paths.path import check_point
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.geometric import (
    Geometric,
    Placed,
    Spot,
    View,
    cross,
    crossed,
    jacobians_of,
    less,
    motion_of,
    position_of,
    rates_of,
    rotation_of,
    turned_back,
    view_of,
)

_NEAR = 1e-6    # [m] from the target, where no direction leads to it
_BEHIND = 1e-6  # 1 + u_z of a target straight behind, where every way round is as long
_ASIDE = np.array([1e-3, 0.0, -(1.0 - 1e-6) ** 0.5])


@dataclass(frozen=True)
class LookAt(Geometric):
    """Turn and move `frame` so that its z axis points at `target` (3,) [m] of the world (m = 2).

    With the unit vector u to the target in the frame's axes, the rows are 2 u_x / (1 + u_z) and
    2 u_y / (1 + u_z), of length 2 tan(angle / 2): the stereographic projection, which is regular on
    the axis, where the cosine of `Pointing` has no gradient, and everywhere but straight behind. At
    velocity level the angle falls by gain sin(angle).
    """

    frame: Frame
    target: tuple[float, float, float]
    stiffness: float = 20.0
    damping: float = 10.0
    gain: float = 5.0
    name: str = "look-at"
    point: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_point(f"task {self.name!r}: target", self.target)
        set_frozen(self, point=np.array(self.target, dtype=float))

    @property
    def dimension(self) -> int:
        """Two rows."""
        return 2

    @property
    def row_names(self) -> tuple[str, ...]:
        """Axes of the frame."""
        return ("x", "y")

    def error(self, state: State) -> Array:
        """-2 (u_x, u_y) / (1 + u_z) (2,)."""
        u, _ = self._direction(view_of(state).frame(self.frame))
        return np.asarray(-2.0 * u[:2] / (1.0 + u[2]))

    def rows(self, view: View) -> Array:
        """P (1 - u u^T) / r  R^T (-J + [d]x W), at the distance r = |d|, P the projection's."""
        placed = view.frame(self.frame)
        u, r = self._direction(placed)
        return _projection(u) @ _across(u, r) @ self._seen(placed)

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`."""
        placed = view_of(state).frame(self.frame)
        rates = rates_of(state, self.frame, placed)
        (u, r), M = self._direction(placed), self._seen(placed)
        s = M @ state.v  # derivative of r u
        P, N = _projection(u), _across(u, r)
        du, dr = N @ s, float(u @ s)
        d = self.point - placed.p
        dM = placed.R.T @ (-rates.dJ + cross(-rates.v) @ placed.W + cross(d) @ rates.dW
                           - cross(rates.w) @ (-placed.J + cross(d) @ placed.W))
        dN = -(np.outer(du, u) + np.outer(u, du)) / r - N * (dr / r)
        return _projection_rate(u, du) @ N @ M + P @ (dN @ M + N @ dM)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        parameters = _Parameters(Spot.of(self.frame), self.point, self.stiffness, self.damping,
                                 self.gain, level == "acceleration")
        return bind(_write, state.kinematics, parameters, A, lower, upper, row)

    def _seen(self, placed: Placed) -> Array:
        """Jacobian (3, n) of the target in the frame's axes."""
        return placed.R.T @ (-placed.J + cross(self.point - placed.p) @ placed.W)

    def _direction(self, placed: Placed) -> tuple[Array, float]:
        """u (3,) and the distance [m] of the target, at least 1e-6 m; beside what is behind."""
        d = placed.R.T @ (self.point - placed.p)
        r = max(float(np.linalg.norm(d)), _NEAR)
        return (d / r, r) if d[2] > (_BEHIND - 1.0) * r else (_ASIDE, r)


def _projection(u: Array) -> Array:
    """Derivative (2, 3) of 2 (u_x, u_y) / (1 + u_z) by u."""
    c = 1.0 + u[2]
    return np.array([[2.0 / c, 0.0, -2.0 * u[0] / c**2], [0.0, 2.0 / c, -2.0 * u[1] / c**2]])


def _projection_rate(u: Array, du: Array) -> Array:
    """Time derivative (2, 3) of `_projection`."""
    c, dc = 1.0 + u[2], du[2]
    last = -2.0 * du[:2] / c**2 + 4.0 * u[:2] * dc / c**3
    return np.column_stack([-2.0 * dc / c**2 * np.eye(2), last])


def _across(u: Array, r: float) -> Array:
    """Derivative (3, 3) of the direction u by the vector r u."""
    return (np.eye(3) - np.outer(u, u)) / r


class _Parameters(NamedTuple):
    frame: Spot
    point: Array
    stiffness: float
    damping: float
    gain: float
    acceleration: bool


@compiled
def _sight(placements, parameters):
    """u and the distance r of the target, and the vector d to it in world axes."""
    p = position_of(placements, parameters.frame)
    point = parameters.point
    d = (point[0] - p[0], point[1] - p[1], point[2] - p[2])
    R = rotation_of(placements, parameters.frame.joint, parameters.frame.rotation)
    x, y, z = turned_back(R, d)
    r = max(np.sqrt(x * x + y * y + z * z), _NEAR)
    if z > (_BEHIND - 1.0) * r:
        return (x / r, y / r, z / r), r, d, R
    return (_ASIDE[0], _ASIDE[1], _ASIDE[2]), r, d, R


@compiled
def _seen_from(u, r, s):
    """P (1 - u u^T) / r s, and the derivative (1 - u u^T) / r s of u, for a motion s of r u."""
    along = u[0] * s[0] + u[1] * s[1] + u[2] * s[2]
    du = ((s[0] - u[0] * along) / r, (s[1] - u[1] * along) / r, (s[2] - u[2] * along) / r)
    c = 1.0 + u[2]
    return 2.0 * (du[0] - u[0] * du[2] / c) / c, 2.0 * (du[1] - u[1] * du[2] / c) / c, du


@compiled
def _write_jacobian(J, placements, supports, parameters, A, row):
    u, r, d, R = _sight(placements, parameters)
    linear, angular = jacobians_of(J, placements, supports, parameters.frame)
    for c in range(A.shape[1]):
        s = less(crossed(d, (angular[0, c], angular[1, c], angular[2, c])),
                 (linear[0, c], linear[1, c], linear[2, c]))
        A[row, c], A[row + 1, c], _ = _seen_from(u, r, turned_back(R, s))


@compiled
def _drift(kinematics, parameters):
    """Exact dJ/dt v, two numbers."""
    u, r, d, R = _sight(kinematics.placements, parameters)
    v, w, a, b = motion_of(kinematics, parameters.frame)
    seen = less(crossed(d, w), v)  # of the target, as it moves for the frame
    s = turned_back(R, seen)
    ds = turned_back(R, less(less(less(crossed(d, b), a), crossed(v, w)), crossed(w, seen)))
    _, _, du = _seen_from(u, r, s)
    fx, fy, _ = _seen_from(u, r, ds)
    # P and (1 - u u^T) / r change with u and r: du and dr = u . s.
    dr, along = u[0] * s[0] + u[1] * s[1] + u[2] * s[2], 0.0
    for i in range(3):
        along += du[i] * s[i]
    turn = ((-du[0] * dr - u[0] * along) / r - du[0] * dr / r,
            (-du[1] * dr - u[1] * along) / r - du[1] * dr / r,
            (-du[2] * dr - u[2] * along) / r - du[2] * dr / r)
    c = 1.0 + u[2]
    gx = 2.0 * (turn[0] - u[0] * turn[2] / c) / c
    gy = 2.0 * (turn[1] - u[1] * turn[2] / c) / c
    hx = 4.0 * du[2] * (u[0] * du[2] / c - du[0]) / c**2
    hy = 4.0 * du[2] * (u[1] * du[2] / c - du[1]) / c**2
    return fx + gx + hx, fy + gy + hy


@compiled
def _write(kinematics, parameters, A, lower, upper, row):
    v, J, _, placements, supports, previous_J, previous_placements, period = kinematics
    _write_jacobian(J, placements, supports, parameters, A, row)
    u, _, _, _ = _sight(placements, parameters)
    error, drift = np.empty(2), np.zeros(2)
    error[0], error[1] = -2.0 * u[0] / (1.0 + u[2]), -2.0 * u[1] / (1.0 + u[2])
    if parameters.acceleration and period == 0.0:
        drift[0], drift[1] = _drift(kinematics, parameters)
    elif parameters.acceleration:
        before = np.empty((2, A.shape[1]))
        _write_jacobian(previous_J, previous_placements, supports, parameters, before, 0)
        for i in range(2):
            drift[i] = (row_times(A, row + i, v) - row_times(before, i, v)) / period
    for i in range(2):
        b = parameters.gain * error[i]
        if parameters.acceleration:
            b = (parameters.stiffness * error[i]
                 - parameters.damping * row_times(A, row + i, v) - drift[i])
        write_equality(lower, upper, row + i, b)
