"""The equations of motion of a floating base, which no motor moves."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hierarchy.contacts import Contacts, write_dynamics, zero_while_open
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import write_equality
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.forces import ForceTask


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
        parameters = M, h, state.kinematics, self.contacts.points
        write_rows = bind(_write, parameters, A, lower, upper, row, self.dimension)
        forces = [(A[row:row + self.dimension, self.contacts.blocks[contact.name]],)
                  for contact in self.contacts.contacts]
        return zero_while_open(write_rows, state, self.contacts, forces)


@compiled
def _write(parameters, A, lower, upper, row, count):
    M, h, kinematics, points = parameters
    write_dynamics(M, kinematics, points, A, row, 0, count)
    for i in range(count):
        write_equality(lower, upper, row + i, -h[i])
