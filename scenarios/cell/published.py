"""The two errors in the letter's published code, so that its figures can be reproduced.

Found by central differences: the control-point Jacobians run from the other end of each link than
the points do, and entry (2, 1) of the upper-arm Jacobian reads -l c1 c2 instead of -l c1 s2. Only
the KUKA LWR of the letter has these Jacobians.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy import HierarchyError, State
from hierarchy.errors import refuse
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import row_times, write_point_jacobian
from hierarchy.measured import measured
from hierarchy.problem import Array
from hierarchy.robots import KUKA_LWR
from hierarchy.task import Level, Rows, Writer
from hierarchy.tasks import Avoidance

_UPPER_ARM_POINTS = 4


@dataclass(frozen=True)
class PublishedAvoidance(Avoidance):
    """Avoidance with the erroneous Jacobians of the published code.

    They are not Jacobians of any function, so at acceleration level only backward differences
    exist: a state with exact derivatives raises a HierarchyError.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        points = [(f"joint_{one.joint}", tuple(one.offset)) for one in self.points]
        refuse(points != [*KUKA_LWR.control_points], "avoidance.jacobian = 'published' needs the "
               f"control points of the letter's arm, robot.model = {KUKA_LWR.name!r}")

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`: J_c or r^T J_c with the errors, and the repulsion."""
        # Each point's Jacobian is taken at the mirrored place on its link [m].
        from_shoulder = [(0.0, i / 4 * 0.2, 0.0) for i in range(_UPPER_ARM_POINTS)]
        from_elbow = [(0.0, -i / 4 * 0.39, 0.0) for i in range(4)]
        joints, _, seen = super().measure(state)[1]
        return _published, (joints, np.array([*from_shoulder, *from_elbow]), seen)

    def jacobian_derivative(self, state: State) -> Array:
        """Backward difference of the wrong Jacobian (rows, n), the direction held."""
        _expect_differences(state)
        return super().jacobian_derivative(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        if level == "acceleration":
            _expect_differences(state)
        return super().writer(state, level, rows)


def _expect_differences(state: State) -> None:
    """Raise a HierarchyError for exact derivatives."""
    if state.period == 0.0:
        raise HierarchyError("avoidance.jacobian = 'published' has no exact derivative; set "
                             "control.jacobian_derivative = 'difference'")


@measured
def _published(kinematics, reads, goal, J, motion):
    joints, offsets, seen = reads
    k, placements = max(seen.active[0], 0), kinematics.placements
    offset, r, of_point = offsets[k], seen.direction[k], np.empty((3, J.shape[1]))
    write_point_jacobian(kinematics, joints[k], offset, of_point)
    if k < _UPPER_ARM_POINTS:
        c1, c2 = placements[1, 0], placements[2, 5]
        of_point[1, 0] = -offset[1] * c1 * c2  # the published entry; c1 s2 is right
    if len(motion.error) == 3:
        J[:] = of_point
    else:
        for c in range(J.shape[1]):
            J[0, c] = r[0] * of_point[0, c] + r[1] * of_point[1, c] + r[2] * of_point[2, c]
    for i in range(len(motion.error)):
        motion.error[i] = seen.magnitude[k] * (r[i] if len(motion.error) == 3 else 1.0)
        motion.rate[i] = row_times(J, i, kinematics.v)
