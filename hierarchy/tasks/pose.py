"""Position and orientation of a frame (m = 6)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.gate import check_rotation
from hierarchy.jit import compiled
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import (
    drift_of_point,
    point_at,
    velocity_of_point,
    write_point_jacobian,
    write_rotation_jacobian,
)
from hierarchy.measured import Measured, measured
from hierarchy.paths import Path
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Task
from hierarchy.tasks.geometric import rotation_of, times_transposed


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


@measured
def _pose(kinematics, reads, goal, J, motion):
    joint, offset, rotation, desired = reads
    v, _, dJ, placements, supports, _, _, _ = kinematics
    rate, drift = motion.rate, motion.drift
    write_point_jacobian(kinematics.J, placements, supports, joint, offset, J, 0)
    write_rotation_jacobian(kinematics.J, supports, joint, J, 3)
    for i in range(3):
        motion.error[i] = goal[0, i] - point_at(placements, joint, offset, i)
    motion.error[3:] = rotation_vector(times_transposed(
        desired, rotation_of(placements, joint, rotation)))
    rate[0], rate[1], rate[2], drift[0], drift[1], drift[2], rate[3], rate[4], rate[5] = (
        drift_of_point(kinematics, joint, offset[0], offset[1], offset[2]))
    _, _, _, drift[3], drift[4], drift[5] = velocity_of_point(dJ, supports, joint, v, 0.0, 0.0, 0.0)


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
    dimension = 6
    row_names = ("x", "y", "z", "about x", "about y", "about z")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rotation(f"task {self.name!r}: rotation", self.rotation)


@dataclass(frozen=True)
class Pose(PoseTask, Measured):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    The orientation error is the rotation vector from the actual to the desired orientation, in
    world axes; the last three rows are those of the angular velocity.
    """

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`."""
        frame = self.frame
        return _pose, (frame.joint, frame.offset, frame.rotation,
                       np.array(self.rotation, dtype=float))
