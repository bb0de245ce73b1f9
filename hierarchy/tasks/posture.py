"""Tasks of the joints themselves: a target posture, and damping of the motion (eq. 15)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError, expect, finite_numbers
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import write_equality, write_identity
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Task


class JointTask(Task):
    """A task with the identity as Jacobian: a last level or the null-space reference of a stack."""

    joints: int
    straight = True

    @property
    def dimension(self) -> int:
        """One row per joint."""
        return self.joints

    def jacobian(self, state: State) -> Array:
        """The identity (n, n)."""
        return np.eye(self.joints)

    def jacobian_derivative(self, state: State) -> Array:
        """Zero (n, n)."""
        return np.zeros((self.joints, self.joints))


@dataclass(frozen=True)
class Posture(JointTask):
    """Move every joint to `target` (n,) [rad or m]; gains as in `Task`.

    A floating base does not count as a joint: the rows are those of the other joints.
    """

    target: tuple[float, ...]
    stiffness: float = 10.0
    damping: float = 5.0
    gain: float = 1.0
    name: str = "posture"

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_numbers(f"task {self.name!r}: target", self.target)

    @property
    def joints(self) -> int:  # type: ignore[override]
        """Number of joints n."""
        return len(self.target)

    def error(self, state: State) -> Array:
        """q_d - q (n,) [rad or m]."""
        return np.asarray(self.target - self._positions(state))

    def jacobian(self, state: State) -> Array:
        """The identity (n, n), to the right of zeros for a floating base."""
        return np.eye(state.n)[state.n - self.joints:]

    def jacobian_derivative(self, state: State) -> Array:
        """Zero, of the same shape."""
        return np.zeros((self.joints, state.n))

    def _positions(self, state: State) -> Array:
        """A view of the joints' positions (n,)."""
        robot = state.robot
        joints = robot.nq - (7 if robot.base == "floating" else 0)
        if joints != robot.n - robot.actuated or joints != self.joints:
            raise HierarchyError(f"task {self.name!r}: {self.joints} targets for "
                                 f"{joints} joint positions")
        return np.asarray(state.q[robot.nq - joints:])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        positions, rates = self._positions(state), state.v[state.n - self.joints:]
        target = np.array(self.target, dtype=float)
        for (i,) in np.argwhere(~np.isfinite(target))[:1]:
            raise HierarchyError(f"task {self.name!r}: target {i} is {target[i]}")
        parameters = _Parameters(target, self.stiffness, self.damping, self.gain,
                                 level == "acceleration")
        return bind(_write, positions, rates, parameters, A, lower, upper, row)


@dataclass(frozen=True)
class JointDamping(JointTask):
    """Damp every joint: a = -D v, eq. (15), with D = k I or D = k M(q); v = 0 at velocity level.

    `damping` is k, in [1/s] with weight = "identity" and in [1/(kg m^2 s)] with "mass".
    """

    joints: int
    damping: float = 5.0
    weight: Literal["identity", "mass"] = "identity"
    name: str = "damping"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.weight not in ("identity", "mass"):
            raise HierarchyError(f"task {self.name!r}: weight must be 'identity' or 'mass', got "
                                 f"{self.weight!r}")
        expect(f"task {self.name!r}: joints", self.joints, int, "give robot.n")

    def error(self, state: State) -> Array:
        """Zero (n,), because there is no target position."""
        return np.zeros(self.joints)

    def reference_acceleration(self, state: State) -> Array:
        """-D v (n,) [rad/s^2]."""
        if self.weight == "mass":
            return np.asarray(-self.damping * (state.mass_matrix() @ state.v))
        return np.asarray(-self.damping * state.v)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        if self.joints != state.n:
            raise HierarchyError(f"task {self.name!r}: {self.joints} joints, the robot has "
                                 f"{state.n} velocities")
        if self.weight == "identity" or level == "velocity":
            damping = self.damping if level == "acceleration" else 0.0
            return bind(_brake, state.v, damping, A, lower, upper, row)
        write_rows, rows = bind(write_identity, A, row, self.joints), slice(row, row + self.joints)

        def write() -> None:
            write_rows()
            lower[rows] = upper[rows] = self.reference_acceleration(state)

        return write


class _Parameters(NamedTuple):
    target: Array
    stiffness: float
    damping: float
    gain: float
    acceleration: bool


@compiled
def _write(q, v, parameters, A, lower, upper, row):
    target, stiffness, damping, gain, acceleration = parameters
    write_identity(A, row, len(target))
    for i in range(len(target)):
        error = target[i] - q[i]
        b = stiffness * error - damping * v[i] if acceleration else gain * error
        write_equality(lower, upper, row + i, b)


@compiled
def _brake(v, damping, A, lower, upper, row):
    write_identity(A, row, len(v))
    for i in range(len(v)):
        write_equality(lower, upper, row + i, -damping * v[i])  # (15)
