"""The smallest contact forces, as a last level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hierarchy.contacts import Contacts
from hierarchy.problem import Array
from hierarchy.tasks.forces import FixedRows


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
    def forces(self) -> Array:
        """The identity (3 p, 3 p)."""
        return np.eye(3 * len(self.contacts.points.joints))

    @property
    def sides(self) -> tuple[Array, Array]:
        """Zero (3 p,), twice."""
        return np.zeros(self.dimension), np.zeros(self.dimension)
