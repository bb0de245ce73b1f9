"""Limits of the joints' positions, velocities and accelerations, as one box of commands."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.compiled import compiled
from hierarchy.errors import HierarchyError
from hierarchy.limits import Limits, write_box
from hierarchy.problem import Array
from hierarchy.robot import Robot, State
from hierarchy.task import Level, Task


@dataclass(frozen=True)
class JointLimits(Task):
    """Keep every joint within its limits and able to stop before them: lower <= x <= upper.

    n rows, the identity, at both levels. Positions and velocities are limited as `robot` says,
    `margin` [rad or m] is kept off each position limit, `acceleration` [rad/s^2 or m/s^2] is one
    number or (n,), `period` [s] is that of the control loop. What is promised from which start:
    see `hierarchy.limits.Limits`. A continuous joint has no position limits. At velocity level the
    acceleration is that of the commands: a step from `State.commanded`.

    Raises HierarchyError where a limit makes no sense or the margin leaves no room.
    """

    robot: Robot
    acceleration: float | ArrayLike
    period: float
    margin: float = 0.0
    name: str = "joint limits"
    limits: Limits = field(init=False, repr=False, compare=False)
    kind = "inequality"

    def __post_init__(self) -> None:
        robot, acceleration = self.robot, np.asarray(self.acceleration, dtype=float)
        if acceleration.shape not in ((), (robot.n,)):
            raise HierarchyError(f"task {self.name!r}: acceleration has shape "
                                 f"{acceleration.shape}, expected a number or ({robot.n},)")
        if not 0.0 <= self.margin < np.inf:
            raise HierarchyError(f"task {self.name!r}: margin {self.margin} must not be negative")
        lower, upper = robot.position_limits()
        try:
            limits = Limits(lower + self.margin, upper - self.margin, robot.velocity_limit,
                            np.broadcast_to(acceleration, robot.n), self.period)
        except HierarchyError as error:
            raise HierarchyError(f"task {self.name!r}: {error}") from error
        object.__setattr__(self, "limits", limits)

    @property
    def dimension(self) -> int:
        """One row a joint."""
        return self.robot.n

    def box(self, state: State, level: Level) -> tuple[Array, Array]:
        """Return the least and the greatest command (n,), (n,) at a state; never empty."""
        return self.limits.box(self._positions(state), _rates(state, level), level)

    def clamp(self, state: State, level: Level, x: ArrayLike) -> Array:
        """Return the command x (n,) moved into the box; finite also where x is not.

        NaN becomes the command of the box that comes nearest to a standstill.
        """
        return self.limits.clamp(self._positions(state), _rates(state, level), level, x)

    def error(self, state: State) -> Array:
        """How far each joint is from its range (n,) [rad or m], zero within."""
        q = self._positions(state)
        return np.asarray(np.clip(q, *self.limits.packed[:2]) - q)

    def jacobian(self, state: State) -> Array:
        """The identity (n, n)."""
        return np.eye(state.n)

    def jacobian_derivative(self, state: State) -> Array:
        """Zero (n, n)."""
        return np.zeros((state.n, state.n))

    def write(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
              row: int) -> None:
        """See `Task.write`; the rows have two sides."""
        _write(self._positions(state), _rates(state, level), self.limits.packed, self.period,
               level == "acceleration", A, lower, upper, row)

    def _positions(self, state: State) -> Array:
        robot = self.robot
        return state.q if robot.nq == robot.n else np.asarray(state.q[robot.coordinates])


def _rates(state: State, level: Level) -> Array:
    """The velocities (n,) from which the next ones are limited."""
    commanded = state.commanded if level == "velocity" else None
    return state.v if commanded is None else commanded


@compiled
def _write(q, v, limits, T, acceleration, A, lower, upper, row):
    for i in range(len(v)):
        for j in range(len(v)):
            A[row + i, j] = 0.0
        A[row + i, i] = 1.0
    write_box(q, v, limits, T, acceleration, lower, upper, row)
