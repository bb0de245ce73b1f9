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
from hierarchy.tasks.contacts.forces import FixedRows

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

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact, point and face of each row."""
        rows, names = [*(f"face {i + 1}" for i in range(self.faces)), "normal force"], list[str]()
        for contact in self.contacts.contacts:
            names += [f"{contact.name} point {k + 1} {row}" for k in range(len(contact.points))
                      for row in rows]
            names += [f"{contact.name} load"] * _summed(contact)
        return tuple(names)

    @property
    def fixed(self) -> tuple[Array, Array, Array]:
        """The rows over the unknowns (m, n + 3 p), their lower and upper sides (m,), (m,) [N].

        A `least` of zero has no side: opposite faces together already say that the point pushes,
        and a row that says it again is a tie at the tip of the pyramid.
        """
        parts, low, up = list[Array](), list[float](), list[float]()
        for contact in self.contacts.contacts:
            own, count, summed = self._of(contact), len(contact.points), _summed(contact)
            part = np.zeros((len(own), self.contacts.unknowns))
            part[:, self.contacts.blocks[contact.name]] = own
            parts.append(part)
            low += [*[0.0] * self.faces, self.least or -inf] * count + [-inf] * summed
            up += [*[inf] * self.faces, self.largest] * count + [inf] * summed
        return np.vstack(parts), np.array(low), np.array(up)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        contacts, writers = self.contacts.contacts, [super().writer(state, level, rows)]
        parts = rows.split([len(self._of(contact)) for contact in contacts])
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

    def _of(self, contact: Contact) -> Array:
        """Rows (r, 3 k) of one contact; the first two tangents are normal to faces."""
        angles = [2.0 * pi * i / self.faces for i in range(self.faces)]
        slope = contact.friction * cos(pi / self.faces)
        local = [*([-cos(angle), -sin(angle), slope] for angle in angles), [0.0, 0.0, 1.0]]
        count, normal = len(contact.points), contact.axes[2]
        rows = np.kron(np.eye(count), np.array(local) @ contact.axes)
        return np.vstack([rows, np.tile(normal, (_summed(contact), count))])


def _summed(contact: Contact) -> int:
    """Return the number of rows over all points' normal force: one if several open together."""
    return int(bool(contact.open) and contact.is_surface)


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
        surfaces = self._surfaces()
        self.refuse(not self.contacts.contacts, "there are no contacts")
        self.refuse(not surfaces, "no contact is a surface")
        for contact in surfaces:
            widest = float(_distances(contact).mean(axis=1).min())
            self.refuse(not 0.0 <= self.margin < widest, f"margin {self.margin} m of contact "
                        f"{contact.name!r} is not from 0 to less than {widest:.4g}, the distance "
                        "of its middle from an edge")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact and edge of each row."""
        return tuple(f"{contact.name} edge {i + 1}" for contact in self._surfaces()
                     for i in range(len(_distances(contact))))

    @property
    def fixed(self) -> tuple[Array, Array, Array]:
        """The rows over the unknowns (m, n + 3 p) [m], zero and infinity (m,)."""
        rows = []
        for contact in self._surfaces():
            block = self.contacts.blocks[contact.name]
            for distances in _distances(contact):
                row = np.zeros(self.contacts.unknowns)
                row[block] = np.outer(distances - self.margin, contact.axes[2]).ravel()
                rows.append(row)
        return np.array(rows), np.zeros(len(rows)), np.full(len(rows), inf)

    def _surfaces(self) -> list[Contact]:
        return [contact for contact in self.contacts.contacts if contact.is_surface]


def _distances(contact: Contact) -> Array:
    """Distance (edges, k) [m] of each point from each edge of the hull, inward positive."""
    points = np.array(contact.points, dtype=float) @ contact.sole[:2].T
    different = np.unique(points.round(6), axis=0, return_index=True)[1]  # to 1 um
    return np.array([(points - start) @ inward for start, inward in _edges(points[different])])


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
