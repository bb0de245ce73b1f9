"""Rows of the equations of motion: those of a floating base, and limits of joint torques."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from hierarchy.contacts import Contacts, write_dynamics, zero_while_open
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, NamedRows, Rows, Writer
from hierarchy.tasks.forces import WRENCH, ForceTask
from hierarchy.tasks.joint_limits import JointRows


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

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; HierarchyError at velocity level."""
        if level == "velocity":
            raise HierarchyError(f"task {self.name!r}: torque limits need the acceleration level, "
                                 f"not {level!r}")
        M, h = state.dynamics
        contacts = Contacts(self.robot) if self.contacts is None else self.contacts
        parameters = M, h, state.kinematics, contacts.points, self.robot.actuated
        write_rows = bind(write_torques, parameters, self.limit, *rows)
        if level != "torque" or self.step == inf:
            return write_rows
        efforts = h[self.robot.actuated:]

        def write() -> None:
            write_rows()
            if state.commanded is not None:
                here = state.commanded - efforts
                for side in rows[1:]:
                    np.clip(side, here - self.step, here + self.step, out=side)

        return write


@compiled
def write_torques(parameters, limit, A, lower, upper):
    """Write rows of M a + h - J_c^T f from -limit to limit, of the velocities from `first` on."""
    M, h, kinematics, points, first = parameters
    write_dynamics(M, kinematics, points, A, first)
    for i in range(len(limit)):
        lower[i], upper[i] = -limit[i] - h[first + i], limit[i] - h[first + i]


@dataclass(frozen=True)
class BaseDynamics(NamedRows, ForceTask):
    """Let the contact forces move the base: M_b(q) a + h_b(q, v) = J_cb^T f [N, N m].

    Six rows, those of the floating base; none for a fixed one. It belongs at the top of a stack: an
    x that violates it cannot happen. A contact without load moves nothing; without contacts the
    rows say that the robot falls.

    Source: A. Herzog et al., "Momentum control with hierarchical inverse dynamics on a
    torque-controlled humanoid", Autonomous Robots (2016), eq. (7).
    """

    contacts: Contacts
    name: str = "base dynamics"

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes of the base, or none for a fixed one."""
        return WRENCH[:self.contacts.robot.actuated]

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        M, h = state.dynamics
        parameters = M, h, state.kinematics, self.contacts.points, 0
        write_rows = bind(write_torques, parameters, np.zeros(self.dimension), *rows)
        forces = [(rows.A[:, self.contacts.blocks[contact.name]],)
                  for contact in self.contacts.contacts]
        return zero_while_open(write_rows, state, self.contacts, forces)
