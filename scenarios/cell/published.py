"""The two errors in the letter's published code, so that its figures can be reproduced.

Found by central differences (see the reproduction notes): the control-point Jacobians run from the
other end of each link than the points do, and entry (2, 1) of the upper-arm Jacobian reads
-l c1 c2 instead of -l c1 s2. Only the KUKA LWR of the letter has these Jacobians.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hierarchy import HierarchyError, State, Task
from hierarchy.jit import compiled
from hierarchy.kinematics import subtract_over_period, write_point_jacobian
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.task import Level
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
        if len(self.points) != 8:
            raise HierarchyError(f"avoidance.jacobian = 'published' needs the letter's eight "
                                 f"control points, the robot has {len(self.points)}")
        # Each point's Jacobian is taken at the mirrored place on its link [m].
        from_shoulder = [(0.0, i / 4 * 0.2, 0.0) for i in range(_UPPER_ARM_POINTS)]
        from_elbow = [(0.0, -i / 4 * 0.39, 0.0) for i in range(4)]
        set_frozen(self, offsets=np.array([*from_shoulder, *from_elbow]))

    def jacobian(self, state: State) -> Array:
        """J_c (3, n) or r^T J_c (1, n) of the active point, with the errors."""
        seen, k = self._seen(state)
        J_c = np.empty((3, state.n))
        _write_jacobian(state.J, state.placements, state.supports, self.joints[k],
                        self.offsets[k], k < _UPPER_ARM_POINTS, J_c)
        return J_c if self.rows == 3 else seen.direction[k][None] @ J_c

    def jacobian_derivative(self, state: State) -> Array:
        """Backward difference of the wrong Jacobian (rows, n), the direction held."""
        if state.period == 0.0:
            raise HierarchyError("avoidance.jacobian = 'published' has no exact derivative; set "
                                 "control.jacobian_derivative = 'difference'")
        seen, k = self._seen(state)
        now, before = np.empty((2, 3, state.n))
        for J, placements, out in ((state.J, state.placements, now),
                                   (state.previous_J, state.previous_placements, before)):
            _write_jacobian(J, placements, state.supports, self.joints[k], self.offsets[k],
                            k < _UPPER_ARM_POINTS, out)
        subtract_over_period(now, before, state.period)
        return now if self.rows == 3 else seen.direction[k][None] @ now

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        return Task.writer(self, state, level, A, lower, upper, row)


@compiled
def _write_jacobian(J, placements, supports, joint, offset, upper_arm, out):
    write_point_jacobian(J, placements, supports, joint, offset, out, 0)
    if upper_arm:
        c1, c2 = placements[1, 0], placements[2, 5]
        out[1, 0] = -offset[1] * c1 * c2  # the published entry; c1 s2 is right
