"""One-sided rows between bodies: self-collision, and the place of [avoidance] in the list."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from scenarios.config.sections import NotNegative, Positive
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
class ListedSelfCollision(_Apart):
    """Links that are not neighbours, kept `distance` [m] apart; other keys as in [avoidance]."""

    kind: Literal["self-collision"]
    distance: NotNegative = 0.03
    rate: Positive = 10.0
    influence: Positive = 0.3
    recovery: NotNegative = 0.2
    limit: Positive = 50.0

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.avoidance import Barrier
        from hierarchy.tasks import SelfSeparation

        pairs = at.pairs(self.distance)
        barrier = Barrier(self.distance, self.rate, self.influence, self.recovery, self.limit)
        return SelfSeparation(at.robot.capsules, barrier, pairs, name=self.title)


@register("collision")
class ListedCollision(_Apart):
    """The place in the list of the rows that [avoidance] with kind = "separation" asks for.

    Without this task they are above all tasks.
    """

    kind: Literal["collision"]
