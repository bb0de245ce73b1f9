"""Forces of contacts, at level "torque"."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from hierarchy.plugins import register
from scenarios.config.sections import Finite
from scenarios.config.tasks import Listed

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("tasks", "contact-force", shipped=True)
class ListedForce(Listed):
    """The force of a contact at a value; at level "torque". See hierarchy.tasks.ContactForce."""

    unit: ClassVar[str] = "N"
    of_forces: ClassVar[bool] = True
    kind: Literal["contact-force"]
    contact: str
    """Name of the contact."""
    target: tuple[Finite, ...]
    """One number, the normal force [N]; three, the force [N]; or six, the wrench [N, N m]."""

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import ContactForce

        return ContactForce(at.contacts, self.contact, self.target, self.title)


@register("tasks", "least-force", shipped=True)
class ListedLeastForce(Listed):
    """The smallest contact forces, as a last level; at level "torque"."""

    unit: ClassVar[str] = "N"
    of_forces: ClassVar[bool] = True
    kind: Literal["least-force"]

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import LeastForce

        return LeastForce(at.contacts, self.title)
