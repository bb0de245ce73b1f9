"""Look at a point: the z axis of a frame, such as a camera, toward a point of the world."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.jit import compiled
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import row_times
from hierarchy.measured import Measured, measured
from hierarchy.paths.path import check_point
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.tasks.geometric import (
    Spot,
    column,
    crossed,
    jacobians_of,
    less,
    motion_of,
    position_of,
    rotation_of,
    turned_back,
)

_NEAR = 1e-6    # [m] from the target, where no direction leads to it
_BEHIND = 1e-6  # 1 + u_z of a target straight behind, where every way round is as long
_ASIDE = np.array([1e-3, 0.0, -(1.0 - 1e-6) ** 0.5])


@dataclass(frozen=True)
class LookAt(Measured):
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
    dimension = 2
    row_names = ("x", "y")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_point(f"task {self.name!r}: target", self.target)

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`: the error is -2 (u_x, u_y) / (1 + u_z)."""
        return _look_at, (Spot.of(self.frame), np.array(self.target, dtype=float))


@compiled
def _sight(placements, frame, point):
    """u and the distance r of the target, the vector d to it in world axes, and the frame's R."""
    p = position_of(placements, frame)
    d = (point[0] - p[0], point[1] - p[1], point[2] - p[2])
    R = rotation_of(placements, frame.joint, frame.rotation)
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
def _drift(kinematics, frame, sight):
    """Exact dJ/dt v, two numbers."""
    u, r, d, R = sight
    v, w, a, b = motion_of(kinematics, frame)
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


@measured
def _look_at(kinematics, reads, goal, J, motion):
    """The rows are P (1 - u u^T) / r R^T (-J + [d]x W), with the projection's derivative P."""
    frame, point = reads
    sight = u, r, d, R = _sight(kinematics.placements, frame, point)
    linear, angular = jacobians_of(kinematics.J, kinematics.placements, kinematics.supports, frame)
    for c in range(J.shape[1]):
        s = less(crossed(d, column(angular, c)), column(linear, c))
        J[0, c], J[1, c], _ = _seen_from(u, r, turned_back(R, s))
    for i in range(2):
        motion.error[i] = -2.0 * u[i] / (1.0 + u[2])
        motion.rate[i] = row_times(J, i, kinematics.v)
    motion.drift[0], motion.drift[1] = _drift(kinematics, frame, sight)
