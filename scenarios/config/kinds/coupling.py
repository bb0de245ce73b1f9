"""Joints coupled by factors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from scenarios.config.sections import Finite, Stiffness
from scenarios.config.tasks import Listed, TaskSection, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("coupling")
class ListedCoupling(Listed, TaskSection):
    """The sum of factor times position over `joints` at `value` [rad or m] (1 row)."""

    unit: ClassVar[str] = "rad"
    kind: Literal["coupling"]
    joints: Annotated[dict[str, Finite], Field(min_length=1)]
    value: Finite = 0.0
    stiffness: Stiffness = 100.0

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import JointCoupling

        return JointCoupling(at.robot, self.joints, self.value, *self.gains, self.title)
