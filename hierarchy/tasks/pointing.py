"""Relaxed pointing: an axis of a frame on a cone, or inside it (eqs. 16-21)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos
from typing import NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError, finite_numbers, number
from hierarchy.jit import bind, compiled, inlined
from hierarchy.kinematics import axis_at, subtract_over_period, velocity_of_point
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Kind, Level, Task


@dataclass(frozen=True)
class Pointing(Task):
    """Keep the z axis of `frame` at the angle `half_angle` [rad] to `axis` (m = 1, p = z_d . z_e).

    With kind = "equality" the axis lies on the cone, cos(alpha) = cos(alpha_d), eq. (16). With
    kind = "inequality" it lies inside, cos(alpha_d) <= cos(alpha), eq. (21), as one row with a
    lower bound only. `axis` (3,) is z_d, normalised here. Gains as in `Task`.
    """

    frame: Frame
    axis: tuple[float, float, float]
    half_angle: float
    kind: Kind = "equality"
    stiffness: float = 5.0
    damping: float = 2.0
    gain: float = 5.0
    name: str = "pointing"
    z_d: Array = field(init=False, repr=False, compare=False)
    z_e: Array = field(init=False, repr=False, compare=False)
    cos_alpha_d: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        axis = finite_numbers(f"task {self.name!r}: axis", self.axis)
        length = float(np.linalg.norm(axis))
        if axis.shape != (3,) or not 1e-9 < length < np.inf:
            raise HierarchyError(f"task {self.name!r}: axis {list(self.axis)} has no direction")
        number(f"task {self.name!r}: half_angle [rad]", self.half_angle, 0.0, np.pi)
        set_frozen(self, z_d=axis / length, cos_alpha_d=cos(self.half_angle),
                   z_e=np.ascontiguousarray(self.frame.rotation[:, 2]))

    @property
    def dimension(self) -> int:
        """One row."""
        return 1

    def error(self, state: State) -> Array:
        """cos(alpha_d) - cos(alpha) (1,), positive outside the cone."""
        return np.array([self.cone_error(state)])

    def cone_error(self, state: State) -> float:
        """The error as a number."""
        return float(_cone_error(state.placements, self.frame.joint, self.z_e, self.z_d,
                                 self.cos_alpha_d))

    def follow_cone_error(self, state: State) -> Callable[[], float]:
        """Return a function that gives the error at a state as it moves, for Algorithm 1."""
        return bind(_cone_error, state.placements, self.frame.joint, self.z_e, self.z_d,
                    self.cos_alpha_d)

    def jacobian(self, state: State) -> Array:
        """z_d^T S^T(z_e) J_O (1, n), eq. (19)."""
        J = np.empty((1, state.n))
        _write_jacobian(state.J, state.placements, state.supports, self.frame.joint, self.z_e,
                        self.z_d, J, 0)
        return J

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (1, n) [1/s]."""
        dJ = np.empty((1, state.n))
        _write_jacobian_derivative(state.kinematics, self.frame.joint, self.z_e, self.z_d, dJ)
        return dJ

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        parameters = _Parameters(self.frame.joint, self.z_e, self.z_d, self.cos_alpha_d,
                                 self.stiffness, self.damping, self.gain, level == "acceleration",
                                 self.kind == "inequality")
        return bind(_write, state.kinematics, parameters, A, lower, upper, row)


class _Parameters(NamedTuple):
    joint: int
    z_e: Array
    z_d: Array
    cos_alpha_d: float
    stiffness: float
    damping: float
    gain: float
    acceleration: bool
    inequality: bool


@compiled
def _cone_error(placements, joint, z_e, z_d, cos_alpha_d):
    cosine = 0.0
    for i in range(3):
        cosine += z_d[i] * axis_at(placements, joint, z_e, i)  # (16)
    return cos_alpha_d - cosine


@compiled
def _write_jacobian(J, placements, supports, joint, z_e, z_d, A, row):
    x, y, z = (axis_at(placements, joint, z_e, 0), axis_at(placements, joint, z_e, 1),
               axis_at(placements, joint, z_e, 2))
    cx, cy, cz = y * z_d[2] - z * z_d[1], z * z_d[0] - x * z_d[2], x * z_d[1] - y * z_d[0]
    for c in range(A.shape[1]):  # z_d . (w x z_e) = w . (z_e x z_d)
        A[row, c] = (J[3, c] * cx + J[4, c] * cy + J[5, c] * cz) if supports[joint, c] else 0.0


@compiled
def _write_jacobian_derivative(kinematics, joint, z_e, z_d, out):
    v, J, dJ, placements, supports, previous_J, previous_placements, period = kinematics
    n = out.shape[1]
    if period > 0.0:
        before = np.empty((1, n))
        _write_jacobian(J, placements, supports, joint, z_e, z_d, out, 0)
        _write_jacobian(previous_J, previous_placements, supports, joint, z_e, z_d, before, 0)
        subtract_over_period(out, before, period)
        return
    wx, wy, wz = 0.0, 0.0, 0.0
    for c in range(n):
        if supports[joint, c]:
            wx += J[3, c] * v[c]
            wy += J[4, c] * v[c]
            wz += J[5, c] * v[c]
    x, y, z = (axis_at(placements, joint, z_e, 0), axis_at(placements, joint, z_e, 1),
               axis_at(placements, joint, z_e, 2))
    dx, dy, dz = wy * z - wz * y, wz * x - wx * z, wx * y - wy * x  # (18)
    cx, cy, cz = y * z_d[2] - z * z_d[1], z * z_d[0] - x * z_d[2], x * z_d[1] - y * z_d[0]
    ex, ey, ez = dy * z_d[2] - dz * z_d[1], dz * z_d[0] - dx * z_d[2], dx * z_d[1] - dy * z_d[0]
    for c in range(n):
        out[0, c] = (dJ[3, c] * cx + dJ[4, c] * cy + dJ[5, c] * cz
                     + J[3, c] * ex + J[4, c] * ey + J[5, c] * ez) if supports[joint, c] else 0.0


@inlined
def _motion(kinematics, joint, z_e, z_d):
    """Rate J v and drift dJ/dt v of z_d . z_e; the drift is exact or a backward difference."""
    v, J, dJ, placements, supports, previous_J, previous_placements, period = kinematics
    x, y, z, wx, wy, wz, dx, dy, dz = _turning(v, J, placements, supports, joint, z_e)
    rate = z_d[0] * dx + z_d[1] * dy + z_d[2] * dz
    if period > 0.0:
        _, _, _, _, _, _, bx, by, bz = _turning(v, previous_J, previous_placements, supports,
                                                joint, z_e)
        return rate, (rate - (z_d[0] * bx + z_d[1] * by + z_d[2] * bz)) / period
    _, _, _, ax, ay, az = velocity_of_point(dJ, supports, joint, v, 0.0, 0.0, 0.0)
    return rate, (z_d[0] * (ay * z - az * y + wy * dz - wz * dy)
                  + z_d[1] * (az * x - ax * z + wz * dx - wx * dz)
                  + z_d[2] * (ax * y - ay * x + wx * dy - wy * dx))


@inlined
def _turning(v, J, placements, supports, joint, z_e):
    """z_e in the world, the angular velocity of its body, and dz_e/dt, eq. (18)."""
    x, y, z = (axis_at(placements, joint, z_e, 0), axis_at(placements, joint, z_e, 1),
               axis_at(placements, joint, z_e, 2))
    _, _, _, wx, wy, wz = velocity_of_point(J, supports, joint, v, 0.0, 0.0, 0.0)
    return x, y, z, wx, wy, wz, wy * z - wz * y, wz * x - wx * z, wx * y - wy * x


@compiled
def _write(kinematics, parameters, A, lower, upper, row):
    joint, z_e, z_d, cos_alpha_d, stiffness, damping, gain, acceleration, inequality = parameters
    placements = kinematics.placements
    _write_jacobian(kinematics.J, placements, kinematics.supports, joint, z_e, z_d, A, row)
    error = _cone_error(placements, joint, z_e, z_d, cos_alpha_d)
    if acceleration:
        rate, drift = _motion(kinematics, joint, z_e, z_d)
        b = stiffness * error - damping * rate - drift
    else:
        b = gain * error
    lower[row] = b
    upper[row] = np.inf if inequality else b  # (21), (16)
