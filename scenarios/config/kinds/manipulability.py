"""The manipulability of a frame."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Literal

from scenarios.config.sections import Gain, NotNegative, Stiffness
from scenarios.config.tasks import Listed, Rows, TaskSection, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("manipulability")
class ListedManipulability(Listed, TaskSection):
    """The manipulability of `frame` at `least` or more (1 row); rows = "equality": at `least`.

    `part` "position" counts the linear rows of its Jacobian, "pose" all six.
    """

    unit: ClassVar[str] = ""
    kind: Literal["manipulability"]
    frame: str
    least: NotNegative
    part: Literal["position", "pose"] = "position"
    rows: Rows = "inequality"
    stiffness: Stiffness = 20.0
    damping: Gain = 10.0
    gain: Gain = 5.0

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities."""
        return self.rows == "inequality"

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import Manipulability

        task = Manipulability(at.frame(self.frame), self.least, self.part, self.rows,
                              name=self.title)
        task.jacobian(at.start)  # refuses a robot that it is not for
        return replace(task, stiffness=self.stiffness, damping=self.damping, gain=self.gain)
