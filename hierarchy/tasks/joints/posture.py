"""Tasks of the joints themselves: a target posture, and damping of the motion (eq. 15)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import finite_numbers, naming
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import row_times, write_identity
from hierarchy.measured import Measure, Measured, measured
from hierarchy.problem import Array
from hierarchy.records import NotNegative, set_frozen
from hierarchy.robot import Robot
from hierarchy.robots.library import pin
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, Written
from hierarchy.tasks.joints.mechanism import Mechanism


class JointTask(Written):
    """A task with the identity as Jacobian: a last level or the null-space reference of a stack."""

    joints: int
    straight = True

    @property
    def dimension(self) -> int:
        """One row per joint."""
        return self.joints

    def error(self, state: State) -> Array:
        """Zero (n,): there is no target position."""
        return np.zeros(self.joints)

    def check_size(self, state: State) -> None:
        """Raise a HierarchyError unless a state has as many velocities as there are joints."""
        self.refuse(self.joints != state.n, f"{self.joints} joints, the robot has {state.n} "
                    "velocities")


@dataclass(frozen=True)
class Posture(Measured):
    """Move every joint to `target` [rad or m]; gains as in `Task`.

    The target has the values of all joints, or is a configuration (nq,), or {joint: value, ...}
    with the other joints at rest, or where a closed chain then has them; see `Robot.configuration`
    for values, such as the angle of a continuous joint. A floating base does not count as a joint:
    the rows are those of the other joints, one for each velocity. The error is the shortest way
    there, `Robot.difference`, and the rows are the identity. For balls, planar and free joints that
    is the derivative of the error along that way, so that at velocity level they go straight to the
    target; in other directions it is the derivative only near it. What is written into an array
    moves the target, where every joint has one position.

    `robot` is that of the stack unless given. Raises HierarchyError for a target that fits none of
    its forms.
    """

    target: ArrayLike | Mapping[str, ArrayLike]
    stiffness: float = 10.0
    damping: float = 5.0
    gain: float = 1.0
    name: str = "posture"
    robot: Robot | None = None
    straight = True
    exact = True
    rest: Array = field(init=False, repr=False, compare=False)  # (nq,)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.target, Mapping):
            finite_numbers(f"task {self.name!r}: target", self.target)
        if self.robot is not None:
            with naming(f"task {self.name!r}"):
                rest = self.robot.configuration(self.target)
            if isinstance(self.target, Mapping) and self.robot.loops:
                rest = Mechanism(self.robot).closed(rest, self.target)
            set_frozen(self, rest=rest)

    def on(self, robot: Robot) -> Posture:
        """Return the posture of a robot."""
        return self if self.robot is robot else replace(self, robot=robot)

    @property
    def dimension(self) -> int:
        """One row for each velocity but those of a floating base."""
        if self.robot is not None:
            return self.robot.n - self.robot.actuated
        self.refuse(isinstance(self.target, Mapping), "a target by name has rows once the robot "
                    "is known; give Posture(..., robot=robot)")
        return len(np.asarray(self.target))

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row, if the robot is known."""
        robot = self.robot
        return super().row_names if robot is None else tuple(robot.velocity_names[robot.actuated:])

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        robot, m = state.robot, self.dimension
        positions = state.q[robot.nq - m:] if _plain(robot) else np.zeros(m)
        return _posture, (positions, robot.actuated)

    def follow(self, state: State, goal: Array) -> Callable[[float], object] | None:
        """See `Measured.follow`: the goal is the target, or the step there."""
        robot, rest, target, m = state.robot, self.rest, self.target, self.dimension
        place = goal[0, :m]
        if not _plain(robot):
            return lambda t: np.copyto(place, pin.difference(  # both sound
                robot.model, state.q, rest)[robot.actuated:])
        place[:] = rest[robot.nq - m:]
        aim = target[len(target) - m:] if isinstance(target, np.ndarray) else None
        return None if aim is None else lambda t: np.copyto(place, aim)


def _plain(robot: Robot) -> bool:
    """Whether each joint that is actuated has one position, which subtracts."""
    return robot.nq - robot.n == (1 if robot.actuated else 0)


@measured
def _posture(kinematics, reads, goal, J, motion):
    positions, first = reads
    for i in range(len(positions)):
        J[i, first + i] = 1.0
        motion.error[i] = goal[0, i] - positions[i]
        motion.rate[i] = kinematics.v[first + i]


@dataclass(frozen=True)
class JointDamping(JointTask):
    """Damp every joint: a = -D v, eq. (15), with D = k I or D = k M(q); v = 0 at velocity level.

    `damping` is k, in [1/s] with weight = "identity" and in [1/(kg m^2 s)] with "mass".
    """

    joints: int
    damping: NotNegative = 5.0
    weight: Literal["identity", "mass"] = "identity"
    name: str = "damping"

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        self.check_size(state)
        damping = self.damping if level == "acceleration" else 0.0
        by_mass = damping > 0.0 and self.weight == "mass"
        weight = state.dynamics.M if by_mass else np.empty((0, 0))
        return bind(_brake, state.v, weight, damping, *rows)


@compiled
def _brake(v, weight, damping, A, lower, upper):
    write_identity(A)
    for i in range(len(v)):
        lower[i] = upper[i] = -damping * (row_times(weight, i, v) if len(weight) else v[i])  # (15)
