"""Position of a frame along a path, with the repulsion of the end effector of eq. (30)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hierarchy.avoidance.measurement import Measurement
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import moving_point, point_at, write_point_jacobian
from hierarchy.measured import Measured, measured
from hierarchy.paths import Path
from hierarchy.robot import Frame
from hierarchy.state import State

_NOTHING_SEEN = Measurement(0).arrays


@measured
def _position(kinematics, reads, goal, J, motion):
    joint, offset, seen, repulsion_within = reads
    placements = kinematics.placements
    write_point_jacobian(kinematics.J, placements, kinematics.supports, joint, offset, J, 0)
    velocity, drift, _ = moving_point(kinematics, joint, offset)
    last = len(seen.distance) - 1
    for i in range(3):
        motion.rate[i], motion.drift[i] = velocity[i], drift[i]
        motion.error[i] = goal[0, i] - point_at(placements, joint, offset, i)
        if seen.distance[last] <= repulsion_within:
            motion.push[i] = seen.magnitude[last] * seen.direction[last, i]  # (30)


@dataclass(frozen=True)
class Position(Measured):
    """Move the origin of `frame` along `path` (m = 3) [m].

    stiffness [1/s^2] and damping [1/s] act at acceleration level, gain [1/s] at velocity level.
    With `repulsion_within` > 0 [m] (eps_ee), the repulsive vector (27) of the end effector is added
    to the reference, eq. (30), while its distance to the obstacles is at most that.
    """

    frame: Frame
    path: Path
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    repulsion_within: float = -1.0
    name: str = "position"
    dimension = 3
    row_names = ("x", "y", "z")

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`."""
        seen = _NOTHING_SEEN if state.measurement is None else state.measurement.arrays
        return _position, (self.frame.joint, self.frame.offset, seen, self.repulsion_within)
