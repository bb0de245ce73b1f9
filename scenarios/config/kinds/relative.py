"""One frame in the axes of another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal, Self

from pydantic import model_validator

from hierarchy.problem import Array
from scenarios.config.sections import Flag, Point, Rows3
from scenarios.config.tasks import Listed, TaskSection, of_pose, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("relative")
class ListedRelative(Listed, TaskSection):
    """The pose of `frame` in the axes of the frame `to` (6 rows), by default the initial one.

    `position` [m] and `rotation` (rows) are those wanted; without `orientation` only the position
    counts (3 rows).
    """

    kind: Literal["relative"]
    frame: str
    to: str
    position: Point | None = None
    rotation: Rows3 | None = None
    orientation: Flag = True

    @model_validator(mode="after")
    def _counts_its_rotation(self) -> Self:
        if self.rotation is not None and not self.orientation:
            raise ValueError("rotation goes with orientation = true")
        return self

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.tasks import RelativePose

        start, frame, to = at.start, at.frame(self.frame), at.frame(self.to)
        axes = start.rotation(to).T
        position = (axes @ (start.position(frame) - start.position(to)) if self.position is None
                    else self.position)
        rotation = axes @ start.rotation(frame) if self.rotation is None else self.rotation
        return RelativePose(frame, to, position, rotation if self.orientation else None,
                            *self.gains, self.title)

    def sizes(self, error: Array) -> Iterator[tuple[str, Array]]:
        """Yield the error of the position and of the rotation."""
        return of_pose(error) if self.orientation else super().sizes(error)
