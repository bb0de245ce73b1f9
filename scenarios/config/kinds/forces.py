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
    """A contact's force or wrench at a value, at level "torque"."""

    made_by: ClassVar[str] = "hierarchy.tasks:ContactForce"
    kind: Literal["contact-force"]
    contact: str
    """Name of the contact."""
    target: tuple[Finite, ...]
    """Normal force [N], force [N] or wrench [N, N m]: 1, 3 or 6 numbers."""


@register("tasks", "least-force", shipped=True)
class ListedLeastForce(_OfForces):
    """The smallest contact forces, as last level, at level "torque"."""

    made_by: ClassVar[str] = "hierarchy.tasks:LeastForce"
    kind: Literal["least-force"]
