"""Position of a frame along a path, in all directions or some, with the repulsion of eq. (30)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.avoidance.measurement import Measurement
from hierarchy.errors import expect
from hierarchy.kinematics import moving_point, place, write_point_jacobian
from hierarchy.measured import Measure, Measured, measured
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, Written, in_turn

_NOTHING_SEEN = Measurement(0).arrays


@measured
def _position(kinematics, reads, goal, J, motion):
    joint, offset, seen, repulsion_within = reads
    write_point_jacobian(kinematics, joint, offset, J)
    here = place(kinematics.placements[joint], offset)
    velocity, drift, _ = moving_point(kinematics, joint, offset)
    last = len(seen.distance) - 1
    for i in range(3):
        motion.rate[i], motion.drift[i] = velocity[i], drift[i]
        motion.error[i] = goal[0, i] - here[i]
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

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        seen = _NOTHING_SEEN if state.measurement is None else state.measurement.arrays
        return _position, (self.frame.joint, self.frame.offset, seen, self.repulsion_within)


@dataclass(frozen=True)
class Along(Written):
    """The rows of a position task along `directions` (m, 3) of the world, m = 1, 2 or 3 [m].

    A hand that slides on a table is moved along two of them and pushes along the third. The gains
    are those of `task`. Raises HierarchyError unless the directions are of length one and
    orthogonal.
    """

    task: Position
    directions: Sequence[Sequence[float]]
    name: str = "along"

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"task {self.name!r}: task", self.task, Position, "give a position task")
        try:
            D = np.array(self.directions, dtype=float)
        except (TypeError, ValueError, OverflowError):
            D = np.empty(0)
        self.refuse(D.ndim != 2 or D.shape[1:] != (3,) or not np.allclose(D @ D.T, np.eye(len(D))),
                    f"directions {self.directions!r} are not of length one and orthogonal, (m, 3)")

    @property
    def row_names(self) -> tuple[str, ...]:
        """The directions: an axis of the world by its name."""
        axes = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}
        return tuple(axes.get(tuple(one), f"along {list(one)}") for one in
                     np.array(self.directions, dtype=float).tolist())

    def error_reader(self, state: State) -> Callable[[], Array]:
        """See `Task.error_reader`: the distance to the path along the directions (m,) [m]."""
        directions, read = np.asarray(self.directions), self.task.error_reader(state)
        return lambda: np.asarray(directions @ read())

    def desired_velocity(self, state: State) -> Array:
        """Velocity of the path along the directions (m,) [m/s]."""
        return np.asarray(self.directions) @ self.task.desired_velocity(state)

    def desired_acceleration(self, state: State) -> Array:
        """Acceleration of the path along the directions (m,) [m/s^2]."""
        return np.asarray(self.directions) @ self.task.desired_acceleration(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        three, D = Rows.empty(3, rows.A.shape[1]), np.asarray(self.directions, dtype=float)

        def project() -> None:
            rows.A[:] = D @ three.A
            rows.lower[:] = rows.upper[:] = D @ three.lower

        return in_turn(self.task.writer(state, level, three), project)
