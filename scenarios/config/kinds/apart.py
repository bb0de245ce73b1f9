"""One-sided rows between bodies: self-collision, and the place of [avoidance] in the list."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from scenarios.config.avoidance import BarrierSection
from scenarios.config.tasks import Listed, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




class _Apart(Listed):
    """A task with one-sided rows between bodies."""

    unit: ClassVar[str] = "m"

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return True


@register("self-collision")
class ListedSelfCollision(_Apart, BarrierSection):
    """Links that are not neighbours, kept `distance` [m] apart; other keys as in [avoidance]."""

    kind: Literal["self-collision"]

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import SelfSeparation

        return SelfSeparation(at.robot.capsules, self.barrier(self.distance),
                              at.pairs(self.distance), name=self.title)


@register("collision")
class ListedCollision(_Apart):
    """The place in the list of the rows that [avoidance] with kind = "separation" asks for.

    Without this task they are above all tasks.
    """

    kind: Literal["collision"]
