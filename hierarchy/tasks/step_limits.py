"""Limits of joint positions and speeds for a velocity that is held for one period."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hierarchy.errors import HierarchyError, number
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.joint_rows import JointRows

APPROACH = 0.25  # gain times period: a robot that lags a tick comes to rest without overshooting


@dataclass(frozen=True)
class StepLimits(JointRows):
    """Keep each joint within its limits of position and speed: gain (lower - q) <= v, and so on.

    One row per velocity, n in number, with infinite sides where the robot has no limit. A joint
    comes nearer to a limit by the share gain times `period` [s] of its distance per tick. `gain`
    [1/s] is at most 1 / period, and None for a quarter of it: a robot that obeys one tick late then
    comes to rest at its limit, beyond a quarter it oscillates. Beyond a limit a joint comes back in
    the same way, as fast as its velocity limit allows. Accelerations are not limited, so that a
    step does not depend on the one before; see `hierarchy.tasks.JointLimits`.

    Raises HierarchyError for a period or gain out of range, and at another level than velocity.
    """

    robot: Robot
    period: float
    gain: float | None = None  # type: ignore[assignment]
    name: str = "limits"
    kind = "inequality"
    first = 0

    def __post_init__(self) -> None:
        if not number(f"task {self.name!r}: period [s]", self.period) > 0.0:
            raise HierarchyError(f"task {self.name!r}: period {self.period} s must be positive")
        gain = APPROACH / self.period if self.gain is None else self.gain
        number(f"task {self.name!r}: gain [1/s]", gain, 0.0, 1.0 / self.period)
        set_frozen(self, gain=gain)
        super().__post_init__()

    def box(self, state: State) -> tuple[Array, Array]:
        """Least and largest velocity of each joint (n,), (n,) [rad/s or m/s]."""
        q, fastest = state.q[self.robot.coordinates], self.robot.velocity_limit
        lower, upper = (np.clip(self.gain * (side - q), -fastest, fastest)
                        for side in self.robot.position_limits())
        return lower, upper

    def error(self, state: State) -> Array:
        """How far each velocity would have to be raised from zero (n,) [rad/s or m/s]."""
        return np.maximum(self.box(state)[0], 0.0)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; for velocity level."""
        if level != "velocity":
            raise HierarchyError(f"task {self.name!r}: for velocity level; see JointLimits")
        rows = slice(row, row + self.dimension)

        def write() -> None:
            A[rows] = np.eye(state.n)
            lower[rows], upper[rows] = self.box(state)

        return write
