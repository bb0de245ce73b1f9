"""The keys of [plant] that every kind has; scenarios.config.kinds has the kinds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from hierarchy.plugins import Group, register
from scenarios.config.own import OwnSection, PartSection
from scenarios.config.sections import Count, NotNegative, Registered, Section, Time, Unit


class MeasurementSection(Section):
    """Measurement of the joints; with all values zero it is exact."""

    position_noise: Annotated[NotNegative, Unit("rad")] = 0.0
    """Standard deviation of the normal noise of positions."""
    velocity_noise: Annotated[NotNegative, Unit("rad/s")] = 0.0
    """The same of velocities."""
    quantisation: Annotated[NotNegative, Unit("rad")] = 0.0
    """Step of measured positions."""
    delay: Time = 0.0
    """Age of what is measured, a whole number of periods."""
    seed: Count = 0
    """Seed of the noise."""
    velocity: Literal["measured", "differenced"] = "measured"
    """"measured": by a sensor of its own. "differenced": the backward difference of measured
    positions after a low-pass filter."""
    filter_time: Time = 0.0
    """Time constant of that filter; 0 for none."""

    def _wrong(self) -> Iterator[str]:
        key = "velocity_noise" if self.velocity == "differenced" else "filter_time"
        if getattr(self, key) > 0.0:
            yield f"velocity = {self.velocity!r} takes no {key}"

    @property
    def ideal(self) -> bool:
        """Whether the measurement is exact."""
        return self.velocity == "measured" and not (
            self.position_noise or self.velocity_noise or self.quantisation or self.delay)


class AnyPlant(PartSection):
    """What every plant has."""

    follows: ClassVar[bool] = False  # whether its state is what its commands add up to
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration", "torque")
    kind: str
    """Which kind it is."""
    feedback: Literal["measured", "commanded"] = "measured"
    """"measured": the controller receives the measured joints. "commanded": it receives its own
    commands, integrated to a joint position reference, as through FRI."""
    measurement: MeasurementSection = MeasurementSection()
    """Errors of the measured joints."""


@register("plants", "kinematic", shipped=True)
class KinematicSection(AnyPlant):
    """A robot that follows its commands exactly."""

    made_by: ClassVar[str] = "scenarios.cell.plants.kinematic:KinematicArm"
    follows: ClassVar[bool] = True
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    kind: Literal["kinematic"] = "kinematic"


class OwnPlant(AnyPlant, OwnSection):
    """A plant of a plug-in, with its keys."""

    group: ClassVar[Group] = "plants"


PlantKind = Annotated[AnyPlant, Registered("kinematic", "plants", OwnPlant)]
