"""Rows over contact forces: what they have in common, a force that is given, the least ones."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hierarchy.contacts import Contacts, Points
from hierarchy.errors import HierarchyError, finite_numbers
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import less, place
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, NamedRows, Rows, Writer, Written

WRENCH = tuple(f"{kind} {axis}" for kind in ("force", "moment") for axis in "xyz")


class ForceTask(Written):
    """m rows over x = (a, f), the unknowns of `contacts`, at level "torque". Abstract.

    Such rows have no task variable and no gains: they say what x must satisfy. A new one needs
    `dimension` and `writer`, see `Task.writer`; A then has n + 3 p columns.
    """

    of_forces: ClassVar[bool] = True
    scale = 3.0  # N
    contacts: Contacts

    def error(self, state: State) -> Array:
        """The residual at x = 0 (m,), in the unit of the rows."""
        _, lower, upper = self.rows(state)
        return np.asarray(np.clip(0.0, lower, upper))


class FixedRows(NamedRows, ForceTask):
    """Rows over forces that do not change with the state. Abstract: needs `fixed`."""

    @property
    @abstractmethod
    def fixed(self) -> tuple[Array, Array, Array]:
        """The rows over the forces (m, 3 p), their lower and upper sides (m,)."""

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        forces, *sides = self.fixed
        A = np.hstack([np.zeros((len(forces), state.n)), forces])
        return bind(_copy, A, *sides, *rows)


def required(contacts: Contacts, task: str) -> Contacts:
    """Return contacts that are at least one; HierarchyError, naming the task, if there is none."""
    if not contacts.contacts:
        raise HierarchyError(f"task {task!r}: there are no contacts")
    return contacts


@compiled
def _copy(rows, low, up, A, lower, upper):
    for i in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            A[i, c] = rows[i, c]
        lower[i], upper[i] = low[i], up[i]


@dataclass(frozen=True)
class ContactForce(NamedRows, ForceTask):
    """Let the surroundings push on one contact with `target`, the sum over its points.

    `target` has 1 number for the normal force [N], 3 for the force in world axes [N], or 6 for the
    wrench: the force, and the moment about the origin of the contact's frame [N m], world axes. The
    force is that on the robot: a hand that presses with 20 N has the normal force 20. One row per
    number. Raises UnknownNameError for an unknown contact, and HierarchyError for another number of
    numbers or one that is not finite.
    """

    contacts: Contacts
    contact: str
    target: Sequence[float]
    name: str = "contact force"

    def __post_init__(self) -> None:
        super().__post_init__()
        self.contacts[self.contact]
        if len(finite_numbers(f"task {self.name!r}: target", self.target)) not in (1, 3, 6):
            raise HierarchyError(f"task {self.name!r}: target {self.target!r} is not 1, 3 or 6 "
                                 "numbers")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes, or the normal force."""
        return ("normal force",) if len(self.target) == 1 else WRENCH[:len(self.target)]

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        contact, block = self.contacts[self.contact], self.contacts.blocks[self.contact]
        first, joints, offsets = (block.start - state.n) // 3, *self.contacts.points
        of_contact = slice(first, first + len(contact.points))
        directions = np.vstack([contact.axes[2:] if self.dimension == 1 else np.eye(3)])
        parameters = (Points(joints[of_contact], offsets[of_contact]), directions,
                      contact.frame.offset, np.array(self.target, dtype=float), block.start)
        return bind(_write, state.placements, parameters, *rows)


@compiled
def _write(placements, parameters, A, lower, upper):
    # The directions (1 or 3, 3) are those of the rows of the force, the origin is of the moment.
    points, directions, origin, target, column = parameters
    T = placements[points.joints[0]]
    o = place(T, origin)
    for i in range(len(target)):
        for c in range(A.shape[1]):
            A[i, c] = 0.0
        lower[i] = upper[i] = target[i]
    for k in range(len(points.joints)):
        f = column + 3 * k
        for i in range(directions.shape[0]):
            for c in range(3):
                A[i, f + c] = directions[i, c]
        if len(target) == 6:
            x, y, z = less(place(T, points.offsets[k]), o)
            A[3, f + 1], A[3, f + 2] = -z, y  # the moment r x f
            A[4, f], A[4, f + 2] = z, -x
            A[5, f], A[5, f + 1] = -y, x


@dataclass(frozen=True)
class LeastForce(FixedRows):
    """Let the contact forces be as small as the levels above allow: f = 0 (m = 3 p) [N].

    As a last level it shares the load among the contact points, which the motion leaves open.
    """

    contacts: Contacts
    name: str = "least force"

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact, point and axis of each row."""
        return tuple(f"{contact.name} point {k + 1} {axis}" for contact in self.contacts.contacts
                     for k in range(len(contact.points)) for axis in "xyz")

    @property
    def fixed(self) -> tuple[Array, Array, Array]:
        """The identity (3 p, 3 p), and zeros (3 p,), twice."""
        count = 3 * len(self.contacts.points.joints)
        return np.eye(count), np.zeros(count), np.zeros(count)
