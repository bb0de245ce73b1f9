"""The keys of [plant]: those of every kind, and the kinds; scenarios.cell.plants has the plants."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from hierarchy.plugins import Group, register
from hierarchy.problem import Array
from scenarios.config.own import OwnSection, PartSection
from scenarios.config.sections import (
    Count,
    Finite,
    Flag,
    Force,
    Length,
    NotNegative,
    Positive,
    Registered,
    Section,
    Span,
    Time,
    Unit,
)

Bandwidth = Annotated[Positive, Unit("rad/s")]
Friction = Annotated[NotNegative, Unit("N m")]
Damping = Annotated[NotNegative, Unit("N m s/rad")]
Inertia = Annotated[NotNegative, Unit("kg m^2")]
_ROUNDING = 1e-9  # [s] of times


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

    made_by: ClassVar[str] = "scenarios.cell.plants.plant:KinematicArm"
    follows: ClassVar[bool] = True
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    kind: Literal["kinematic"] = "kinematic"


class ServoSection(Section):
    """The position servo of each joint of the physics plant.

    torque = k (reference - q) + c (its rate - v) + `gravity` times the gravity torque, within the
    effort limits. k = m `bandwidth`^2 and c = 2 m `bandwidth`, where m is the inertia of the joint
    at the start, including the drive.
    """

    rate: Annotated[float, Field(strict=True, ge=200.0, le=10000.0), Unit("Hz")] = 1000.0
    """Steps of the servo per second (or slightly more, a whole number per period) on linearly
    interpolated references."""
    bandwidth: Bandwidth | tuple[Bandwidth, ...] = 80.0
    """How fast a joint follows, one value for all joints or one each."""
    gravity: NotNegative = 1.0
    """Share of the gravity torque that is compensated."""
    feedforward: Flag = True
    """Whether the rate of the reference counts."""
    lead: Annotated[Positive, Unit("rad")] = 0.1
    """How far the reference may lead its joint, so that a blocked arm does not rush to catch up."""


class JointsSection(Section):
    """Joints of the physics plant: one value for all or one each. Plausible, not identified."""

    friction: Friction | tuple[Friction, ...] = 0.5
    """Dry friction."""
    damping: Damping | tuple[Damping, ...] = 1.0
    """Viscous friction."""
    armature: Inertia | tuple[Inertia, ...] = 0.3
    """Inertia of motor and gear at the joint."""


@register("plants", "mujoco", shipped=True)
class PhysicsSection(AnyPlant):
    """A robot in a physics simulation, under position servos (extra `sim`)."""

    made_by: ClassVar[str] = "scenarios.cell.plants.physics:PhysicsArm"
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    kind: Literal["mujoco"]
    beyond_stop: Annotated[Positive, Unit("rad")] = 0.2
    """How far a joint may pass its position limit; beyond it the run ends with a fault."""
    servo: ServoSection = ServoSection()
    """The servo of each joint."""
    joints: JointsSection = JointsSection()
    """Friction and inertia of the joints."""


class PushSection(Section):
    """A horizontal force on a body, at its centre of mass."""

    joint: str
    """Joint whose body is pushed."""
    force: Force
    """Size of the force."""
    direction: Annotated[Finite, Unit("deg")] = 0.0
    """From the world's x axis toward its y axis."""
    at: Time = 0.0
    """When the push begins."""
    duration: Span = 0.1
    """How long it lasts."""

    @property
    def vector(self) -> Array:
        """The force (3,) [N] in the world."""
        angle = np.radians(self.direction)
        return self.force * np.array([np.cos(angle), np.sin(angle), 0.0])

    def acts(self, t: ArrayLike) -> NDArray[np.bool_]:
        """Whether it pushes in the periods that begin at the times t (...) [s]."""
        passed = np.asarray(t) - self.at + _ROUNDING
        return (passed >= 0.0) & (passed < self.duration)


@register("plants", "torque", shipped=True)
class TorqueSection(AnyPlant):
    """A robot with torque motors in a physics simulation (extra `sim`).

    Its [[contacts]] touch a floor, or table. The controller knows nothing of `joint_friction`,
    `joint_damping`, `armature`, `delay` and `bandwidth`.
    """

    made_by: ClassVar[str] = "scenarios.cell.plants.torque:TorqueRobot"
    levels: ClassVar[tuple[str, ...]] = ("torque",)
    kind: Literal["torque"]
    height: Annotated[Finite, Unit("m")] = 0.0
    """Height of the floor."""
    friction: Positive = 0.7
    """Coefficient of friction of the floor."""
    softness: Span = 0.005
    """Time constant of a contact."""
    joint_friction: Friction = 0.0
    """Coulomb friction of every joint."""
    armature: Inertia = 0.0
    """Inertia of the drive of every joint beyond the robot's own."""
    joint_damping: Damping = 0.0
    """Viscous friction of every joint."""
    delay: Time = 0.0
    """Time by which torques arrive late, a whole number of periods."""
    bandwidth: Annotated[Positive, Unit("Hz")] | None = None
    """Bandwidth of the motors' torques; without it they follow at once."""
    stops: Flag = True
    """Whether joints have a stop at their position limit."""
    self_collision: Flag = False
    """Whether the robot's capsules touch one another, except neighbours and those that overlap at
    the start."""
    fall: Length = 0.2
    """How far the centre of mass may sink below its start; beyond it the robot has fallen, which
    ends the run with a fault."""
    tilt: Annotated[Positive, Unit("rad")] = 1.0
    """How far the base may tilt from its start; beyond it the robot has fallen."""
    beyond_stop: Annotated[Positive, Unit("rad")] = 0.2
    """How far a joint may pass its position limit; beyond it the run ends with a fault."""
    pushes: tuple[PushSection, ...] = ()
    """Forces that disturb the robot."""


class OwnPlant(AnyPlant, OwnSection):
    """A plant of a plug-in, with its keys."""

    group: ClassVar[Group] = "plants"


PlantKind = Annotated[AnyPlant, Registered("kinematic", "plants", OwnPlant)]
