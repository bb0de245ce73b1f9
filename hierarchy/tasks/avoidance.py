"""Obstacle avoidance by a control point of the body: 3-D (28), or relaxed to one row (29)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from hierarchy.avoidance.control_points import ControlPoint, pack_points
from hierarchy.errors import HierarchyError
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import add_row, dot, moving_point, place, triple, write_point_jacobian
from hierarchy.measured import Measured, measured
from hierarchy.state import State
from hierarchy.task import seen_by


@measured
def _avoidance(kinematics, reads, goal, J, motion):
    joints, offsets, seen = reads
    k = max(seen.active[0], 0)
    joint, offset, r, magnitude = joints[k], offsets[k], seen.direction[k], seen.magnitude[k]
    columns, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    velocity, drift, _ = moving_point(kinematics, joint, offset)
    if len(motion.error) == 3:  # (28)
        write_point_jacobian(columns, placements, supports, joint, offset, J, 0)
        for i in range(3):
            motion.error[i] = magnitude * r[i]
            motion.rate[i], motion.drift[i] = velocity[i], drift[i]
        return
    point = place(placements[joint], offset[0], offset[1], offset[2])
    add_row(columns, supports, joint, point, triple(r, 0), J, 0)
    motion.error[0], motion.rate[0] = magnitude, dot(r, velocity)
    motion.drift[0] = dot(r, drift)  # (29)


@dataclass(frozen=True)
class Avoidance(Measured):
    """Push the active control point of the measurement away from the nearest obstacle.

    With rows = 3 the acceleration of the point equals the repulsive vector, eqs. (27)-(28). With
    rows = 1 its component along the direction of repulsion equals the magnitude, eq. (29). At
    velocity level the vector is a velocity. With one row the derivative is r^T dJ_c/dt, with the
    direction held constant, because (29) projects an acceleration and does not differentiate a
    distance.

    `points` are the control points in the order of the measurement; the task acts on
    `measurement.active`, or on the first point while that is -1.
    """

    points: Sequence[ControlPoint]
    rows: Literal[1, 3] = 1
    name: str = "avoidance"
    stiffness = gain = 1.0  # the error is the command at both levels

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rows not in (1, 3):
            raise HierarchyError(f"task {self.name!r}: rows must be 1 or 3, got {self.rows}")

    @property
    def dimension(self) -> int:
        """One row or three."""
        return self.rows

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`; the error is the repulsion [m/s^2 or m/s]."""
        return _avoidance, (*pack_points(self.points), seen_by(self, state).arrays)
