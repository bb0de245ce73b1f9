"""A finished run: arrays by name, time first, SI units, with the scenario that made it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scenarios.config import Scenario


@dataclass(frozen=True)
class Recording:
    """What one run did, tick by tick.

    Row k of `q` and `v` is the state before the command of tick k, `a` is the acceleration that
    this command meant, so row 0 is the start. T ticks, n joints, K control points.

    Signals
    -------
    t (T,) [s] · q, v, a (T, n) [rad, rad/s, rad/s^2] · command (T, n), the x that the resolver
    gave: a velocity or an acceleration, after `scenario.control.level`
    ee_position, desired_position, position_error (T, 3) [m], error = desired - actual
    pointing_error (T,) cos(alpha_d) - cos(alpha), positive outside the cone
    pointing_active (T,) bool, whether the pointing task was in the stack
    control_point_distance (T, K) [m] to the nearest obstacle; minimal_distance (T,) [m], eq. (31)
    active_control_point (T,) number 1..K of the point whose avoidance was in the stack, or -1
    ee_distance (T,) [m]; repulsion_active (T,) bool, whether eq. (30) was in force
    order (T,) index into `orders`; status (T,) value of solvers.Status; iterations (T,)
    time_kinematics, time_rows, time_resolve, time_tick (T,) [s] of computing
    joint_lower, joint_upper, velocity_limit (n,) of the robot, infinite where it has none

    A signal that the scenario has no use for is absent.
    """

    signals: dict[str, NDArray[Any]]
    orders: tuple[str, ...]
    scenario: Scenario
    fault: str | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.signals[name]

    def __contains__(self, name: str) -> bool:
        return name in self.signals

    @property
    def ticks(self) -> int:
        """Number of ticks that were run."""
        return len(self.signals["t"])

    def switches(self) -> NDArray[np.int64]:
        """Ticks k at which the stack's order differs from that of tick k - 1."""
        return np.flatnonzero(np.diff(self.signals["order"])) + 1
