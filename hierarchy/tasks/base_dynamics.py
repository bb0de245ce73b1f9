"""The equations of motion of a floating base, which no motor moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hierarchy.contacts import Contacts, zero_while_open
from hierarchy.jit import bind
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.forces import ForceTask
from hierarchy.tasks.torque_limits import write_torques


@dataclass(frozen=True)
class BaseDynamics(ForceTask):
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
    def dimension(self) -> int:
        """Six rows, or none for a fixed base."""
        return self.contacts.robot.actuated

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes of the base."""
        return tuple(f"{kind} {axis}" for kind in ("force", "moment")
                     for axis in "xyz")[:self.dimension]

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        M, h = state.dynamics
        parameters = M, h, state.kinematics, self.contacts.points, 0
        write_rows = bind(write_torques, parameters, np.zeros(self.dimension), A, lower, upper, row)
        forces = [(A[row:row + self.dimension, self.contacts.blocks[contact.name]],)
                  for contact in self.contacts.contacts]
        return zero_while_open(write_rows, state, self.contacts, forces)
