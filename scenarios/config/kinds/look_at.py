"""A frame toward a point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np

from hierarchy.problem import Array
from scenarios.config.sections import Gain, Point, Stiffness
from scenarios.config.tasks import Listed, TaskSection, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("look-at")
class ListedLookAt(Listed, TaskSection):
    """The z axis of `frame` toward the point `target` [m] of the world (2 rows)."""

    kind: Literal["look-at"]
    frame: str
    target: Point
    stiffness: Stiffness = 20.0
    damping: Gain = 10.0
    gain: Gain = 5.0

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import LookAt

        return LookAt(at.frame(self.frame), self.target, *self.gains, self.title)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the angle [deg] from the direction to the point."""
        yield "deg", np.degrees(2 * np.arctan(np.linalg.norm(error, axis=1) / 2))
