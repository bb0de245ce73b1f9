"""The centre of pressure of each sole, kept away from its edges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hierarchy.contacts import Contact, Contacts
from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.tasks.forces import FixedRows, required


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
        if not surfaces:
            required(self.contacts, self.name)
            raise HierarchyError(f"task {self.name!r}: no contact is a surface")
        for contact in surfaces:
            widest = float(_distances(contact).mean(axis=1).min())
            if not 0.0 <= self.margin < widest:
                raise HierarchyError(f"task {self.name!r}: margin {self.margin} m of contact "
                                     f"{contact.name!r} is not from 0 to less than {widest:.4g}, "
                                     "the distance of its middle from an edge")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact and edge of each row."""
        return tuple(f"{contact.name} edge {i + 1}" for contact in self._surfaces()
                     for i in range(len(_distances(contact))))

    @property
    def forces(self) -> Array:
        """The rows over the forces (m, 3 p) [m]."""
        rows = []
        for contact in self._surfaces():
            block = self.contacts.blocks[contact.name]
            for distances in _distances(contact):
                row = np.zeros(self.contacts.unknowns)
                row[block] = np.outer(distances - self.margin, contact.axes[2]).ravel()
                rows.append(row[self.contacts.robot.n:])
        return np.array(rows)

    @property
    def sides(self) -> tuple[Array, Array]:
        """Zero and infinity, (m,) each."""
        return np.zeros(self.dimension), np.full(self.dimension, np.inf)

    def _surfaces(self) -> list[Contact]:
        return [contact for contact in self.contacts.contacts if contact.is_surface]


def _distances(contact: Contact) -> Array:
    """Distance (edges, k) [m] of each point from each edge of the hull, inward positive."""
    points = np.array(contact.points, dtype=float) @ contact.sole[:2].T
    edges = _edges(np.unique(points, axis=0))
    return np.array([(points - start) @ inward for start, inward in edges])


def _edges(points: Array) -> Iterator[tuple[Array, Array]]:
    """Yield start and inward normal (2,) of each edge of the hull of different points (k, 2)."""
    for start in points:
        for end in points:
            along = end - start
            inward = np.array([-along[1], along[0]])
            distance = (points - start) @ inward
            beyond = (abs(distance) < 1e-9) & ((points - start) @ along > along @ along + 1e-9)
            before = (abs(distance) < 1e-9) & ((points - start) @ along < -1e-9)
            if along.any() and (distance >= -1e-9).all() and not (beyond | before).any():
                yield start, inward / np.linalg.norm(along)
