"""Forces that contacts can transmit: inside the friction cone, and pushing only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import cos, inf, pi, sin
from typing import Literal

import numpy as np

from hierarchy.contacts import Contact, Contacts
from hierarchy.errors import HierarchyError
from hierarchy.kinematics import write_point_jacobian
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level
from hierarchy.tasks.forces import FixedRows, required

_SLOW = 0.01  # [m/s] below which the friction of a sliding point falls to zero


@dataclass(frozen=True)
class Friction(FixedRows):
    """Keep every contact force inside its friction cone: |f_t| <= mu f_n, least <= f_n <= largest.

    For each point `faces` (4 or 8) one-sided rows of a pyramid inside the cone, then one row of the
    normal force [N]. Inside: of the cone's tangential force the faces' middles allow 71 % with 4
    faces and 92 % with 8, the edges all of it. `least` >= 0 [N] is per point, so a contact pushes
    and never pulls; `largest` [N] may be infinite. Both are scaled by the load of a contact that
    opens, so its force is zero while it is open. Of a point that slides, two equalities are in the
    place of the faces: f_t = -mu f_n v_t / |v_t| with its velocity along the surface v_t, and less
    in proportion below 1 cm/s.

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
        super().__post_init__()
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
        write_rows, n = super().writer(state, level, A, lower, upper, row), state.n
        changing: list[Callable[[], object]] = []
        for k, contact in enumerate(self.contacts.contacts):
            rows = slice(row, row := row + len(contact.points) * (self.faces + 1))
            low, up = (side[rows].reshape(-1, self.faces + 1) for side in (lower, upper))
            if contact.open:
                changing.append(partial(self._scale_with_time, contact, state, low, up))
            if contact.slides:
                point = self.contacts.blocks[contact.name].start - n
                changing.append(partial(self._slide, k, state, A[rows, n + point:n + point + 3],
                                        (low[0], up[0])))

        def write() -> None:
            write_rows()
            for change in changing:
                change()

        return write if changing else write_rows

    def _scale_with_time(self, contact: Contact, state: State, low: Array, up: Array) -> None:
        self._scale(contact.load(state.t), low, up)

    def _slide(self, number: int, state: State, A: Array, sides: tuple[Array, Array]) -> None:
        """Write the rows (faces + 1, 3) of one point that slides, and their sides."""
        contact, (low, up) = self.contacts.contacts[number], sides
        along = contact.axes[:2] @ self._velocity(contact, state)
        drag = contact.friction * along / max(float(np.linalg.norm(along)), _SLOW)
        low[:-1], up[:-1], low[-1] = -inf, inf, max(low[-1], 0.0)
        for row, tangent, share in zip((0, self.faces // 4), contact.axes[:2], drag, strict=True):
            A[row] = tangent + share * contact.axes[2]
            low[row] = up[row] = 0.0

    def _velocity(self, contact: Contact, state: State) -> Array:
        """Velocity (3,) [m/s] of the first point of a contact."""
        block = self.contacts.blocks[contact.name]
        joints, offsets = self.contacts.points
        k = (block.start - state.n) // 3
        J = np.empty((3, state.n))
        write_point_jacobian(state.J, state.placements, state.supports, joints[k], offsets[k], J, 0)
        velocity: Array = J @ state.v
        return velocity

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
