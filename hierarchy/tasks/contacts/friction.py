"""What contacts can transmit: forces in the friction cone, pressure inside the sole."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import cos, inf, isnan, pi, sin
from typing import Literal

import numpy as np

from hierarchy.contacts import Contact, Contacts
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, in_turn
from hierarchy.tasks.contacts.forces import FixedRows, OfContact

_SLOW = 0.01      # [m/s] below which the friction of a sliding point falls to zero
_NOTHING = 1e-6   # [N] of normal force that counts as none


@dataclass(frozen=True)
class Friction(FixedRows):
    """Keep every contact force inside its friction cone: |f_t| <= mu f_n, least <= f_n <= largest.

    For each point `faces` (4 or 8) one-sided rows of a pyramid inside the cone, then one row of the
    normal force [N]. Inside: of the cone's tangential force the faces' middles allow 71 % with 4
    faces and 92 % with 8, the edges all of it. `least` >= 0 [N] is per point, so a contact pushes
    and never pulls; `largest` [N] may be infinite. The force of a contact is zero while it is open.
    In the ramp before, its normal force, summed over its points in a row of its own, falls from
    `State.carried` to zero; where that is not known, as in the ramp after, it is bounded by the
    share of the robot's weight. Of a point that slides, two equalities are in the
    place of the faces: f_t = -mu f_n v_t / |v_t| with its velocity along the surface v_t, and less
    in proportion below 1 cm/s.

    Raises HierarchyError for another number of faces, sides that leave no force, or no contacts.
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
        self.refuse(not self.contacts.contacts, "there are no contacts")
        self.refuse(not 0.0 <= self.least < self.largest, "no normal force is pushing and lies "
                    f"between least {self.least} N and largest {self.largest} N")

    def of_contact(self, contact: Contact) -> OfContact:
        """Faces and normal force of each point; the first two tangents are normal to faces.

        A `least` of zero has no side: opposite faces together already say that the point pushes,
        and a row that says it again is a tie at the tip of the pyramid.
        """
        faces, count = self.faces, len(contact.points)
        slope = contact.friction * cos(pi / faces)
        angles = [2.0 * pi * i / faces for i in range(faces)]
        local = [*([-cos(angle), -sin(angle), slope] for angle in angles), [0.0, 0.0, 1.0]]
        rows = np.kron(np.eye(count), np.array(local) @ contact.axes)
        each = [*(f"face {i + 1}" for i in range(faces)), "normal force"]
        names = [f"point {k + 1} {row}" for k in range(count) for row in each]
        low = [*[0.0] * faces, self.least or -inf] * count
        up = [*[inf] * faces, self.largest] * count
        if contact.open and contact.is_surface:  # all points open together
            rows = np.vstack([rows, np.tile(contact.axes[2], count)])
            names, low, up = [*names, "load"], [*low, -inf], [*up, inf]
        return names, rows, low, up

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        contacts, writers = self.contacts.contacts, [super().writer(state, level, rows)]
        parts = rows.split([len(self.of_contact(contact)[0]) for contact in contacts])
        for k, (contact, own) in enumerate(zip(contacts, parts, strict=True)):
            if contact.open:
                writers.append(partial(self._ramp, k, state, own.lower, own.upper))
            if contact.slides:
                forces = own.A[:, self.contacts.blocks[contact.name]]
                writers.append(partial(self._slide, k, state, own._replace(A=forces)))
        return in_turn(*writers)

    def _ramp(self, number: int, state: State, low: Array, up: Array) -> None:
        """Write the sides (r,) of a contact that opens: its last row has all its normal force."""
        contact = self.contacts.contacts[number]
        share, count = contact.load(state.t), len(contact.points)
        if share == 1.0:
            return
        robot, before = self.contacts.robot, self.contacts.before(state.carried)[number]
        weight = robot.masses.sum() * np.linalg.norm(robot.model.gravity.linear)
        allowed = share * (weight if isnan(before) else before)
        each_low, each_up = (side[:count * (self.faces + 1)].reshape(count, -1)
                             for side in (low, up))
        if allowed > _NOTHING:
            each_low[:, -1] = share * self.least or -inf
            up[-1] = min(up[-1], allowed)
            return
        # Two faces and the normal force are equalities and the other faces are free, because at
        # the tip of the pyramid all faces would hold the force at once.
        each_low[:, :-1] = -inf
        for row in (0, self.faces // 4, -1):
            each_low[:, row] = each_up[:, row] = 0.0

    def _slide(self, number: int, state: State, rows: Rows) -> None:
        """Write the rows (faces + 1, 3) of one point that slides, over its force."""
        contact, (A, low, up) = self.contacts.contacts[number], rows
        first = self.contacts.blocks[contact.name].start - state.n
        along = contact.axes[:2] @ (self.contacts.jacobian(state)[first:first + 3] @ state.v)
        drag = contact.friction * along / max(float(np.linalg.norm(along)), _SLOW)
        low[:-1], up[:-1], low[-1] = -inf, inf, max(low[-1], 0.0)
        for row, tangent, share in zip((0, self.faces // 4), contact.axes[:2], drag, strict=True):
            A[row] = tangent + share * contact.axes[2]
            low[row] = up[row] = 0.0


@dataclass(frozen=True)
class CentreOfPressure(FixedRows):
    """Keep the centre of pressure of every surface contact at least `margin` [m] inside its sole.

    One row per edge of the sole: sum_k f_nk (d_k - margin) >= 0 [N m], with the distance d_k of
    point k from the edge. Pushing forces at the corners keep it inside the sole without these rows;
    they add the margin. The sole is the convex hull of the points as seen along `Contact.up`.

    Raises HierarchyError without a surface contact, or if the margin is negative or leaves no room.
    Source: P. Sardain, G. Bessonnet, "Forces acting on a biped robot. Center of pressure-zero
    moment point", IEEE Transactions on Systems, Man, and Cybernetics (2004).
    """

    contacts: Contacts
    margin: float = 0.01
    name: str = "centre of pressure"
    kind = "inequality"

    def __post_init__(self) -> None:
        super().__post_init__()
        surfaces = [contact for contact in self.contacts.contacts if contact.is_surface]
        self.refuse(not self.contacts.contacts, "there are no contacts")
        self.refuse(not surfaces, "no contact is a surface")
        for contact in surfaces:
            widest = float(_distances(contact).mean(axis=1).min())
            self.refuse(not 0.0 <= self.margin < widest, f"margin {self.margin} m of contact "
                        f"{contact.name!r} is not from 0 to less than {widest:.4g}, the distance "
                        "of its middle from an edge")

    def of_contact(self, contact: Contact) -> OfContact:
        """A row for each edge of a sole [m], at least zero."""
        levers = _distances(contact) - self.margin
        return ([f"edge {i + 1}" for i in range(len(levers))], np.kron(levers, contact.axes[2]),
                np.zeros(len(levers)), np.full(len(levers), inf))


def _distances(contact: Contact) -> Array:
    """Distance (edges, k) [m] of each point from each edge of the hull, inward positive."""
    points = np.array(contact.points, dtype=float) @ contact.sole[:2].T
    different = np.unique(points.round(6), axis=0, return_index=True)[1]  # to 1 um
    edges = [(points - start) @ inward for start, inward in _edges(points[different])]
    return np.array(edges).reshape(-1, len(points))


def _edges(points: Array) -> Iterator[tuple[Array, Array]]:
    """Yield start and inward normal (2,) of each edge of the hull of different points (k, 2)."""
    for start in points:
        for end in points:
            along = end - start
            inward = np.array([-along[1], along[0]])
            distance, place = (points - start) @ inward, (points - start) @ along
            between = (place > -1e-9) & (place < along @ along + 1e-9)
            if along.any() and (distance >= -1e-9).all() and between[distance < 1e-9].all():
                yield start, inward / np.linalg.norm(along)
