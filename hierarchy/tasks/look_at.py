"""Look at a point: the z axis of a frame, such as a camera, toward a point of the world."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.jit import compiled
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import crossed, dot, less, row_times, times, triple
from hierarchy.measured import Measured, measured
from hierarchy.paths.path import check_point
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.tasks.geometric import (
    Spot,
    column,
    jacobians_of,
    motion_of,
    position_of,
    rotation_of,
    turned_back,
)

_NEAR = 1e-6    # [m] from the target, where no direction leads to it
_BEHIND = 1e-6  # 1 + u_z of a target straight behind, where every way round is as long
_ASIDE = (1e-3, 0.0, -(1.0 - 1e-6) ** 0.5)


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
    """The target in the frame's axes y, its distance r, the vector d to it in world axes, and R."""
    d = less(triple(point, 0), position_of(placements, frame))
    R = rotation_of(placements, frame.joint, frame.rotation)
    y = turned_back(R, d)
    r = max(np.sqrt(dot(y, y)), _NEAR)
    if not y[2] > (_BEHIND - 1.0) * r:
        y = times(r, _ASIDE)
    return y, r, d, R


@measured
def _look_at(kinematics, reads, goal, J, motion):
    """The error is -2 y / D, D = r + y_z, and the target moves by R^T (-J + [d]x W) in the axes."""
    frame, point = reads
    y, r, d, R = _sight(kinematics.placements, frame, point)
    D = r + y[2]
    linear, angular = jacobians_of(kinematics.J, kinematics.placements, kinematics.supports, frame)
    for c in range(J.shape[1]):
        s = turned_back(R, less(crossed(d, column(angular, c)), column(linear, c)))
        dD = dot(y, s) / r + s[2]
        for i in range(2):
            J[i, c] = 2.0 * (s[i] - y[i] * dD / D) / D
    v, w, a, b = motion_of(kinematics, frame)
    seen = less(crossed(d, w), v)  # of the target, as it moves for the frame
    s = turned_back(R, seen)
    ds = turned_back(R, less(less(less(crossed(d, b), a), crossed(v, w)), crossed(w, seen)))
    dr = dot(y, s) / r
    dD, ddD = dr + s[2], (dot(s, s) + dot(y, ds) - dr * dr) / r + ds[2]
    for i in range(2):
        motion.error[i] = -2.0 * y[i] / D
        motion.rate[i] = row_times(J, i, kinematics.v)
        turned = 2.0 * s[i] * dD + y[i] * (ddD - 2.0 * dD * dD / D)
        motion.drift[i] = 2.0 * (ds[i] - turned / D) / D
