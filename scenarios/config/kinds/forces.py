"""Forces of contacts, at level "torque"."""

from __future__ import annotations

from typing import ClassVar, Literal

from hierarchy.plugins import register
from scenarios.config.sections import Finite
from scenarios.config.tasks import Listed


class _OfForces(Listed):
    """A task with rows over contact forces."""

    unit: ClassVar[str] = "N"
    of_forces: ClassVar[bool] = True


@register("tasks", "contact-force", shipped=True)
class ListedForce(_OfForces):
    """The force of a contact at a value; at level "torque". See hierarchy.tasks.ContactForce."""

    made_by: ClassVar[str] = "hierarchy.tasks:ContactForce"
    kind: Literal["contact-force"]
    contact: str
    """Name of the contact."""
    target: tuple[Finite, ...]
    """One number, the normal force [N]; three, the force [N]; or six, the wrench [N, N m]."""


@register("tasks", "least-force", shipped=True)
class ListedLeastForce(_OfForces):
    """The smallest contact forces, as a last level; at level "torque"."""

    made_by: ClassVar[str] = "hierarchy.tasks:LeastForce"
    kind: Literal["least-force"]
