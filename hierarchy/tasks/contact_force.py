"""A contact that pushes with a given force."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hierarchy.contacts import Contacts, Points
from hierarchy.errors import HierarchyError, finite_numbers
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import place, write_equality
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.forces import ForceTask


@dataclass(frozen=True)
class ContactForce(ForceTask):
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
    def dimension(self) -> int:
        """One row per number of the target."""
        return len(self.target)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes, or the normal force."""
        if self.dimension == 1:
            return ("normal force",)
        return tuple(f"{kind} {axis}" for kind in ("force", "moment")
                     for axis in "xyz")[:self.dimension]

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        contact, block = self.contacts[self.contact], self.contacts.blocks[self.contact]
        first, joints, offsets = (block.start - state.n) // 3, *self.contacts.points
        of_contact = slice(first, first + len(contact.points))
        directions = np.vstack([contact.axes[2:] if self.dimension == 1 else np.eye(3)])
        parameters = _Parameters(Points(joints[of_contact], offsets[of_contact]), directions,
                                 contact.frame.offset, np.array(self.target, dtype=float),
                                 block.start)
        return bind(_write, state.placements, parameters, A, lower, upper, row)


class _Parameters(NamedTuple):
    points: Points
    directions: Array  # (1 or 3, 3) of the rows of the force
    origin: Array      # of the moment, in the body
    target: Array
    column: int


@compiled
def _write(placements, parameters, A, lower, upper, row):
    points, directions, origin, target, column = parameters
    T = placements[points.joints[0]]
    ox, oy, oz = place(T, origin[0], origin[1], origin[2])
    for i in range(len(target)):
        for c in range(A.shape[1]):
            A[row + i, c] = 0.0
        write_equality(lower, upper, row + i, target[i])
    for k in range(len(points.joints)):
        f, o = column + 3 * k, points.offsets[k]
        for i in range(directions.shape[0]):
            for c in range(3):
                A[row + i, f + c] = directions[i, c]
        if len(target) == 6:
            x, y, z = place(T, o[0], o[1], o[2])
            _write_moment(x - ox, y - oy, z - oz, A, row + 3, f)


@compiled
def _write_moment(x, y, z, A, row, column):
    """Write the moment r x f of a force at r = (x, y, z)."""
    A[row, column + 1], A[row, column + 2] = -z, y
    A[row + 1, column], A[row + 1, column + 2] = z, -x
    A[row + 2, column], A[row + 2, column + 1] = -y, x
