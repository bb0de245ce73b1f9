"""The keys of [plant]: those of every kind, and the kinds; scenarios.cell.plants has the plants."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from hierarchy.plugins import Group, register
from hierarchy.problem import Array
from scenarios.config import sections as keys
from scenarios.config.sections.own import OwnSection, PartSection

Bandwidth = Annotated[keys.Positive, keys.Unit("rad/s")]
Friction = Annotated[keys.NotNegative, keys.Unit("N m")]
Damping = Annotated[keys.NotNegative, keys.Unit("N m s/rad")]
Inertia = Annotated[keys.NotNegative, keys.Unit("kg m^2")]
_ROUNDING = 1e-9  # [s] of times


class MeasurementSection(keys.Section):
    """Errors of measured joints."""

    position_noise: keys.Arc = 0.0  #: Standard deviation of the normal noise of positions.
    velocity_noise: Annotated[keys.NotNegative, keys.Unit("rad/s")] = 0.0  #: That of velocities.
    quantisation: keys.Arc = 0.0  #: Step of measured positions.
    delay: keys.Time = 0.0  #: Age of measurements, a whole number of periods.
    seed: keys.Count = 0  #: Seed of the noise.
    velocity: Literal["measured", "differenced"] = "measured"
    """"differenced": the backward difference of measured positions, after a low-pass filter."""
    filter_time: keys.Time = 0.0  #: Time constant of the filter, 0 for none.

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
    kind: str  #: Which kind it is.
    feedback: Literal["measured", "commanded"] = "measured"
    """The controller receives "measured" joints or its "commanded" ones, integrated, as through
    FRI."""
    measurement: MeasurementSection = MeasurementSection()  #: Errors of the measured joints.

    def _wrong(self) -> Iterator[str]:
        if self.feedback == "commanded" and not self.measurement.ideal:
            yield 'feedback = "commanded" takes no errors of the measurement, which nobody reads'


@register("plants", "kinematic", shipped=True)
class KinematicSection(AnyPlant):
    """Follows its commands exactly."""

    made_by: ClassVar[str] = "scenarios.cell.plants.plant:KinematicArm"
    follows: ClassVar[bool] = True
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    kind: str = "kinematic"


class ServoSection(keys.Section):
    """The position servo of each joint.

    torque = k (reference - q) + c (its rate - v) + `gravity` times the gravity torque, within the
    effort limits; k = m `bandwidth`^2, c = 2 m `bandwidth`, m the joint's inertia at the start,
    with its drive.
    """

    rate: Annotated[float, Field(strict=True, ge=200.0, le=10000.0), keys.Unit("Hz")] = 1000.0
    """Steps per second, rounded up to a whole number per period, on linearly interpolated
    references."""
    bandwidth: Bandwidth | tuple[Bandwidth, ...] = 80.0  #: How fast joints follow, all or each.
    gravity: keys.NotNegative = 1.0  #: Share of the gravity torque that is compensated.
    feedforward: keys.Flag = True  #: Whether the rate of the reference counts.
    lead: keys.PositiveAngle = 0.1  #: How far the reference may lead its joint.


class JointsSection(keys.Section):
    """One value for all joints or one each; plausible, not identified."""

    friction: Friction | tuple[Friction, ...] = 0.5  #: Dry friction.
    damping: Damping | tuple[Damping, ...] = 1.0  #: Viscous friction.
    armature: Inertia | tuple[Inertia, ...] = 0.3  #: Inertia of motor and gear at the joint.


@register("plants", "mujoco", shipped=True)
class PhysicsSection(AnyPlant):
    """Physics, with position servos (extra `sim`)."""

    made_by: ClassVar[str] = "scenarios.cell.plants.physics:PhysicsArm"
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    beyond_stop: keys.PositiveAngle = 0.2  #: How far a joint may pass its limit before a fault.
    servo: ServoSection = ServoSection()  #: The servo of each joint.
    joints: JointsSection = JointsSection()  #: Friction and inertia of the joints.


class PushSection(keys.Section):
    """A horizontal force at a body's centre of mass."""

    joint: str  #: Joint whose body is pushed.
    force: keys.Force  #: Size of the force.
    direction: Annotated[keys.Finite, keys.Unit("deg")] = 0.0  #: From the world's x axis toward y.
    at: keys.Time = 0.0  #: When the push begins.
    duration: keys.Span = 0.1  #: How long it lasts.

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
    """Physics, with torque motors (extra `sim`).

    The controller does not know `joint_friction`, `joint_damping`, `armature`, `delay` and
    `bandwidth`.
    """

    made_by: ClassVar[str] = "scenarios.cell.plants.torque:TorqueRobot"
    levels: ClassVar[tuple[str, ...]] = ("torque",)
    height: keys.Coordinate = 0.0  #: Height of the floor.
    friction: keys.Positive = 0.7  #: Coefficient of friction of the floor.
    softness: keys.Span = 0.005  #: Time constant of a contact.
    joint_friction: Friction | None = None
    """Coulomb friction of every joint, by default 0.5 % of its effort limit."""
    joint_damping: Damping | None = None
    """Viscous friction of every joint, by default 0.2 % of its effort limit per rad/s."""
    armature: Inertia | None = None
    """Additional inertia of every joint's drive, by default 0.01 % of its effort limit per rad/s^2.
    """
    delay: keys.Time = 0.0  #: Delay of torques, a whole number of periods.
    bandwidth: keys.Frequency | None = None  #: Bandwidth of motor torques, by default infinite.
    stops: keys.Flag = True  #: Whether joints have a stop at their position limit.
    self_collision: keys.Flag = False
    """Whether capsules collide, except neighbours and those that overlap initially."""
    fall: keys.Length = 0.2  #: How far a floating base's centre of mass may sink before a fault.
    tilt: keys.PositiveAngle = 1.0  #: How far the base may tilt before a fault.
    beyond_stop: keys.PositiveAngle = 0.2  #: How far a joint may pass its limit before a fault.
    pushes: tuple[PushSection, ...] = ()  #: Forces that disturb the robot.


class OwnPlant(AnyPlant, OwnSection):
    """A plant of a plug-in, with its keys."""

    group: ClassVar[Group] = "plants"


PlantKind = Annotated[AnyPlant, keys.OneOf("kinematic", OwnPlant)]
