"""Forces that contacts can transmit: inside the friction cone, and pushing only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf, pi, sin
from typing import Literal

import numpy as np

from hierarchy.contacts import Contact, Contacts
from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.forces import FixedRows, required


@dataclass(frozen=True)
class Friction(FixedRows):
    """Keep every contact force inside its friction cone: |f_t| <= mu f_n, least <= f_n <= largest.

    For each point `faces` (4 or 8) one-sided rows of a pyramid inside the cone, then one row of the
    normal force [N]. Inside: of the cone's tangential force the faces' middles allow 71 % with 4
    faces and 92 % with 8, the edges all of it. `least` >= 0 [N] is per point, so a contact pushes
    and never pulls; `largest` [N] may be infinite. Both are scaled by the load of a contact that
    opens, so its force is zero while it is open.

    Raises HierarchyError for another number of faces, sides that leave no force, no contacts, or a
    contact that opens and has no finite `largest` to ramp.
    Source: A. Herzog et al., "Momentum control with hierarchical inverse dynamics on a
    torque-controlled humanoid", Autonomous Robots (2016).
    """

    contacts: Contacts
    faces: Literal[4, 8] = 4
    least: float = 0.0
    largest: float = inf
    name: str = "friction"
    kind = "inequality"

    def __post_init__(self) -> None:
        required(self.contacts, self.name)
        if self.faces not in (4, 8):
            raise HierarchyError(f"task {self.name!r}: {self.faces!r} faces, expected 4 or 8")
        if not 0.0 <= self.least < self.largest:
            raise HierarchyError(f"task {self.name!r}: no normal force is pushing and lies between "
                                 f"least {self.least} N and largest {self.largest} N")
        for contact in self.contacts.contacts:
            if contact.open and self.largest == inf:
                raise HierarchyError(f"task {self.name!r}: contact {contact.name!r} opens; give a "
                                     "finite largest force, which ramps to zero")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact, point and face of each row."""
        rows = [*(f"face {i + 1}" for i in range(self.faces)), "normal force"]
        return tuple(f"{contact.name} point {k + 1} {row}" for contact in self.contacts.contacts
                     for k in range(len(contact.points)) for row in rows)

    @property
    def forces(self) -> Array:
        """The rows over the forces (m, 3 p)."""
        contacts = [contact for contact in self.contacts.contacts for _ in contact.points]
        rows = np.zeros((len(contacts), self.faces + 1, len(contacts), 3))
        for k, contact in enumerate(contacts):
            rows[k, :, k] = self._of(contact)
        return rows.reshape(len(contacts) * (self.faces + 1), -1)

    @property
    def sides(self) -> tuple[Array, Array]:
        """Their lower and upper sides (m,), (m,) [N].

        A `least` of zero has no side: opposite faces together already say that the point pushes,
        and a row that says it again is a tie at the tip of the pyramid.
        """
        count = len(self.contacts.points.joints)
        return (np.tile([*np.zeros(self.faces), self.least or -inf], count),
                np.tile([*np.full(self.faces, inf), self.largest], count))

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        write_rows = super().writer(state, level, A, lower, upper, row)
        opening: list[tuple[Contact, Array, Array]] = []
        for contact in self.contacts.contacts:
            rows = slice(row, row := row + len(contact.points) * (self.faces + 1))
            if contact.open:
                opening.append((contact, lower[rows].reshape(-1, self.faces + 1),
                                upper[rows].reshape(-1, self.faces + 1)))

        def write() -> None:
            write_rows()
            for contact, low, up in opening:
                self._scale(contact.load(state.t), low, up)

        return write if opening else write_rows

    def _scale(self, load: float, low: Array, up: Array) -> None:
        """Scale the sides (k, faces + 1) of k points; without load each force is zero.

        Then two faces and the normal force are equalities and the other faces are free, because at
        the tip of the pyramid all faces would hold the force at once.
        """
        low[:, -1], up[:, -1] = load * self.least or -inf, load * self.largest
        if load == 0.0:
            low[:, :-1] = -inf
            for row in (0, self.faces // 4, -1):
                low[:, row] = up[:, row] = 0.0

    def _of(self, contact: Contact) -> Array:
        """Rows (faces + 1, 3) of one point; the first two tangents are normal to faces."""
        angles = [2.0 * pi * i / self.faces for i in range(self.faces)]
        slope = contact.friction * cos(pi / self.faces)
        local = [*([-cos(angle), -sin(angle), slope] for angle in angles), [0.0, 0.0, 1.0]]
        return np.array(local) @ contact.axes
