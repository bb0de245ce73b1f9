"""The momentum of the whole robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from scenarios.config.sections import Gain
from scenarios.config.tasks import Listed, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("momentum")
class ListedMomentum(Listed):
    """The linear or angular momentum of the whole robot to zero, with `damping` [1/s]."""

    kind: Literal["momentum"]
    part: Literal["linear", "angular"] = "angular"
    damping: Gain = 10.0

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of its error."""
        return "N s" if self.part == "linear" else "N m s"

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Momentum

        return Momentum(self.part, damping=self.damping, name=self.title)
