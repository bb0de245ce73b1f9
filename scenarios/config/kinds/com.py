"""The centre of mass along a path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from scenarios.config.tasks import AlongSection, Listed, register

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References




@register("com")
class ListedCentreOfMass(Listed, AlongSection):
    """The centre of mass along some of the axes "x", "y", "z" of the world."""

    kind: Literal["com"]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"

    def make(self, at: References) -> Task:
        """Return the task."""
        from hierarchy.paths import Still
        from hierarchy.tasks import CentreOfMass

        anywhere = CentreOfMass(at.robot, Still((0.0, 0.0, 0.0)))
        return CentreOfMass(at.robot, self.along(anywhere.position(at.start)),
                            tuple("xyz".index(axis) for axis in self.axes), *self.gains,
                            name=self.title)
