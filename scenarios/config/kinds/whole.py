"""Kinds of tasks of the whole robot: joints, centre of mass, momentum, self-collision."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field

from hierarchy.paths import Still
from hierarchy.plugins import register
from scenarios.config.avoidance import BarrierSection
from scenarios.config.sections import Finite, Gain, JointPosition, Stiffness
from scenarios.config.tasks import AlongSection, Listed, PostureTask, Rows, TaskSection

if TYPE_CHECKING:
    from scenarios.config.references import References


@register("tasks", "posture", shipped=True)
class ListedPosture(Listed, PostureTask):
    """All joints to a posture."""

    kind: Literal["posture"]


@register("tasks", "coupling", shipped=True)
class ListedCoupling(Listed, TaskSection):
    """A weighted sum of joint positions (1 row)."""

    unit: ClassVar[str] = "rad"
    made_by: ClassVar[str] = "hierarchy.tasks:JointCoupling"
    kind: Literal["coupling"]
    joints: Annotated[dict[str, Finite], Field(min_length=1)]
    """The factor of each joint, by name."""
    value: JointPosition = 0.0
    """The value of the sum."""
    stiffness: Stiffness = 100.0


@register("tasks", "com", shipped=True)
class ListedCentreOfMass(Listed, AlongSection):
    """The centre of mass along a path."""

    made_by: ClassVar[str] = "hierarchy.tasks:CentreOfMass"
    kind: Literal["com"]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"
    """Axes of the world that count."""

    def asked(self, at: References) -> dict[str, Any]:
        """Return the path and the numbers of the axes."""
        from hierarchy.tasks import CentreOfMass

        anywhere = CentreOfMass(at.robot, Still((0.0, 0.0, 0.0)))
        return {"path": self.along(anywhere.position(at.start)),
                "axes": tuple("xyz".index(axis) for axis in self.axes)}


@register("tasks", "momentum", shipped=True)
class ListedMomentum(Listed):
    """The momentum of the whole robot to zero."""

    made_by: ClassVar[str] = "hierarchy.tasks:Momentum"
    kind: Literal["momentum"]
    part: Literal["linear", "angular"] = "angular"
    """Which of the two."""
    damping: Gain = 10.0
    """Gain of the momentum."""

    @property
    def unit(self) -> str:  # type: ignore[override]
        """That of its error."""
        return "N s" if self.part == "linear" else "N m s"


class _Apart(Listed):
    """A task with one-sided rows between bodies."""

    unit: ClassVar[str] = "m"
    rows: ClassVar[Rows] = "inequality"


@register("tasks", "self-collision", shipped=True)
class ListedSelfCollision(_Apart, BarrierSection):
    """Links kept apart, except neighbours."""

    made_by: ClassVar[str] = "hierarchy.tasks:SelfSeparation"
    kind: Literal["self-collision"]

    def asked(self, at: References) -> dict[str, Any]:
        """Return the capsules, those of them to keep apart, and how."""
        return {"capsules": at.robot.capsules, "barrier": self.barrier(self.distance),
                "pairs": at.pairs(self.distance)}


@register("tasks", "collision", shipped=True)
class ListedCollision(_Apart):
    """Where the rows of [avoidance] `separation` stand; by default above all tasks."""

    kind: Literal["collision"]
