"""Joint torque limits as rows over the accelerations, and the contact forces if there are any."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from hierarchy.contacts import Contacts, write_dynamics
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.joint_rows import JointRows


@dataclass(frozen=True)
class TorqueLimits(JointRows):
    """Keep every joint torque within its limits: -limit <= M(q) a + h(q, v) - J_c^T f <= limit.

    One row per actuated joint, n in number below, at acceleration level without contacts and at
    level "torque" with those of the stack. The limit is `fraction`, more than 0 and at most 1, of
    the robot's `effort_limit` [N m or N]; rows of joints without one have infinite bounds. At level
    "torque" no torque differs by more than `step` [N m or N] from that in `State.commanded`; one
    beyond its limit comes back by `step`. The torques are those of the robot's model: rigid bodies,
    no friction, no payload.

    Raises HierarchyError for another fraction, a step that is not positive, or a floating base
    without contacts.
    """

    robot: Robot
    fraction: float = 1.0
    name: str = "torque limits"
    contacts: Contacts | None = None
    step: float = inf
    kind = "inequality"
    of_forces: ClassVar[bool] = True
    straight = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.fraction <= 1.0:
            raise HierarchyError(f"task {self.name!r}: fraction {self.fraction} is not more than 0 "
                                 "and at most 1")
        if not self.step > 0.0:
            raise HierarchyError(f"task {self.name!r}: step {self.step} must be positive")
        if self.robot.base == "floating" and self.contacts is None:
            raise HierarchyError(f"task {self.name!r}: robot {self.robot.name!r} has a floating "
                                 "base; its torques depend on contact forces, so give the contacts")

    @property
    def limit(self) -> Array:
        """The largest torque of each row (n,) [N m or N]."""
        return self.fraction * self.robot.effort_limit[self.robot.actuated:]

    def error(self, state: State) -> Array:
        """Distance of the torque with x = 0 from the limits (n,) [N m or N]."""
        h = state.bias_effort()[self.robot.actuated:]
        return np.asarray(np.clip(h, -self.limit, self.limit) - h)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; HierarchyError at velocity level."""
        if level == "velocity":
            raise HierarchyError(f"task {self.name!r}: torque limits need the acceleration level, "
                                 f"not {level!r}")
        M, h = state.dynamics
        contacts = Contacts(self.robot) if self.contacts is None else self.contacts
        parameters = M, h, state.kinematics, contacts.points, self.robot.actuated
        write_rows = bind(write_torques, parameters, self.limit, A, lower, upper, row)
        if level != "torque" or self.step == inf:
            return write_rows
        rows, efforts = slice(row, row + self.dimension), h[self.robot.actuated:]
        low, up = lower[rows], upper[rows]

        def write() -> None:
            write_rows()
            if state.commanded is not None:
                here = state.commanded - efforts
                np.clip(low, here - self.step, here + self.step, out=low)
                np.clip(up, here - self.step, here + self.step, out=up)

        return write


@compiled
def write_torques(parameters, limit, A, lower, upper, row):
    """Write rows of M a + h - J_c^T f from -limit to limit, of the velocities from `first` on."""
    M, h, kinematics, points, first = parameters
    write_dynamics(M, kinematics, points, A, row, first, len(limit))
    for i in range(len(limit)):
        lower[row + i] = -limit[i] - h[first + i]
        upper[row + i] = limit[i] - h[first + i]
