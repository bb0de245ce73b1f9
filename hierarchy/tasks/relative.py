"""Pose of a frame in another frame: two hands that hold one thing, a loop that is closed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import finite_numbers
from hierarchy.gate import check_rotation
from hierarchy.jit import compiled
from hierarchy.kinematics import crossed, less, place, plus, row_times
from hierarchy.measured import Measure, Measured, measured
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import NamedRows
from hierarchy.tasks.geometric import (
    Spot,
    column,
    jacobians_of,
    motion_of,
    rotation_of,
    times_transposed,
    turned_back,
)
from hierarchy.tasks.pose import PoseTask, rotation_vector


@dataclass(frozen=True)
class RelativePose(NamedRows, Measured):
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
    def row_names(self) -> tuple[str, ...]:
        """Axes of `to`: six, or three without orientation."""
        return PoseTask.row_names[:3 if self.rotation is None else 6]

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        rotation = np.eye(3) if self.rotation is None else self.rotation
        return _relative, (Spot.of(self.frame), Spot.of(self.to),
                           np.array(self.position, dtype=float), np.array(rotation, dtype=float))


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


@compiled
def _write_drift(kinematics, frame, to, R, d, drift):
    """Write the exact dJ/dt v (3 or 6,), with dR/dt = [w]x R."""
    v, w, a, b = motion_of(kinematics, frame)
    v_to, w_to, a_to, b_to = motion_of(kinematics, to)
    apart = less(v, v_to)
    linear = plus(plus(less(a, a_to), crossed(apart, w_to)), crossed(d, b_to))
    linear = less(linear, crossed(w_to, plus(apart, crossed(d, w_to))))
    moved = turned_back(R, linear)
    turned = turned_back(R, less(less(b, b_to), crossed(w_to, less(w, w_to))))
    for i in range(3):
        drift[i] = moved[i]
        if len(drift) == 6:
            drift[3 + i] = turned[i]


@measured
def _relative(kinematics, reads, goal, J, motion):
    frame, to, position, rotation = reads
    placements = kinematics.placements
    R = rotation_of(placements, to.joint, to.rotation)
    d = less(place(placements[frame.joint], frame.offset), place(placements[to.joint], to.offset))
    _write_jacobian(kinematics, frame, to, R, d, J)
    _write_drift(kinematics, frame, to, R, d, motion.drift)
    here = turned_back(R, d)
    for i in range(3):
        motion.error[i] = position[i] - here[i]
    if len(motion.error) == 6:
        there = rotation_of(placements, frame.joint, frame.rotation)
        motion.error[3:] = rotation_vector(times_transposed(
            times_transposed(rotation, there), R.T))  # R_d (R^T R_f)^T
    for i in range(len(motion.rate)):
        motion.rate[i] = row_times(J, i, kinematics.v)
