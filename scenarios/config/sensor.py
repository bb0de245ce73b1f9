"""The keys of [sensor] that every kind has; scenarios.config.kinds has the kinds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from hierarchy.plugins import Group, register
from scenarios.config.own import OwnSection, PartSection
from scenarios.config.sections import Registered

FOOT = 0.31  # [m] height of the column that a robot without floor stands on


class AnySensor(PartSection):
    """What every sensor has: the height `foot` [m] of the column that its robot stands on."""

    has_frames: ClassVar[bool] = True    # that a fault may leave out
    is_recorded: ClassVar[bool] = False  # whether it shows no obstacle of the scenario
    kind: str
    """Which kind it is."""
    if TYPE_CHECKING:
        foot: ClassVar[float]


@register("sensors", "exact", shipped=True)
class ExactSection(AnySensor):
    """Distances of the known geometry, without errors."""

    foot: ClassVar[float] = FOOT
    has_frames: ClassVar[bool] = False
    kind: Literal["exact"] = "exact"

    def made(self, robot: Any, **given: Any) -> Any:
        """Return the exact sensor, which is given."""
        return given["exact"]


class OwnSensor(AnySensor, OwnSection):
    """A sensor of a plug-in, with its keys."""

    group: ClassVar[Group] = "sensors"
    foot: ClassVar[float] = FOOT


SensorKind = Annotated[AnySensor, Registered("exact", "sensors", OwnSensor)]
