"""The keys of [plant]: the simulated robot and its measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from hierarchy.plugins import Group, register
from hierarchy.problem import Array
from scenarios.config.own import OwnSection
from scenarios.config.sections import (
    Count,
    Finite,
    Flag,
    NotNegative,
    Positive,
    Section,
    any_kind,
)

_ROUNDING = 1e-9  # [s] of times


class MeasurementSection(Section):
    """Measurement of the joints, for either plant; with all values zero it is exact.

    Normal noise with standard deviations `position_noise` [rad] and `velocity_noise` [rad/s],
    determined by `seed`; position steps of `quantisation` [rad]; `delay` [s], a whole number of
    periods. velocity = "measured" is a separate sensor, "differenced" the backward difference of
    measured positions after a low-pass filter with time constant `filter_time` [s].
    """

    position_noise: NotNegative = 0.0
    velocity_noise: NotNegative = 0.0
    quantisation: NotNegative = 0.0
    delay: NotNegative = 0.0
    seed: Count = 0
    velocity: Literal["measured", "differenced"] = "measured"
    filter_time: NotNegative = 0.0

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        key = "velocity_noise" if self.velocity == "differenced" else "filter_time"
        if getattr(self, key) > 0.0:
            raise ValueError(f"velocity = {self.velocity!r} takes no {key}")
        return self

    @property
    def ideal(self) -> bool:
        """Whether the measurement is exact."""
        return self.velocity == "measured" and not (
            self.position_noise or self.velocity_noise or self.quantisation or self.delay)


class ServoSection(Section):
    """The position servo of each joint of the physics plant.

    torque = k (reference - q) + c (its rate - v) + `gravity` times the gravity torque, within the
    effort limits. k = m `bandwidth`^2 and c = 2 m `bandwidth` [rad/s], where m is the inertia of
    the joint at the start, including the drive. The servo runs at `rate` [Hz] (or slightly faster,
    a whole number of times per period) on linearly interpolated references. Without `feedforward`
    the rate of the reference is ignored. The reference leads its joint by at most `lead` [rad], so
    that a blocked arm does not rush to catch up.
    """

    rate: Annotated[float, Field(strict=True, ge=200.0, le=10000.0)] = 1000.0
    bandwidth: Positive | tuple[Positive, ...] = 80.0
    gravity: NotNegative = 1.0
    feedforward: Flag = True
    lead: Positive = 0.1


class JointsSection(Section):
    """Joints of the physics plant: one value for all or one each. Plausible, not identified.

    friction [N m] is dry friction; damping [N m s/rad]; armature [kg m^2] is the inertia of motor
    and gear at the joint.
    """

    friction: NotNegative | tuple[NotNegative, ...] = 0.5
    damping: NotNegative | tuple[NotNegative, ...] = 1.0
    armature: NotNegative | tuple[NotNegative, ...] = 0.3


class AnyPlant(Section):
    """What every plant has.

    With feedback = "commanded" the controller receives its own commands, integrated to a joint
    position reference, instead of a measurement: it sees neither noise nor the real joints, as when
    commands through FRI are integrated blindly. Both are stable with the letter's gains.
    """

    kind: str
    feedback: Literal["measured", "commanded"] = "measured"
    measurement: MeasurementSection = MeasurementSection()


@register("plants", "kinematic", shipped=True)
class KinematicSection(AnyPlant):
    """A robot that follows its commands exactly."""

    kind: Literal["kinematic"] = "kinematic"


@register("plants", "mujoco", shipped=True)
class PhysicsSection(AnyPlant):
    """A robot in a physics simulation, under position servos (extra `sim`).

    A joint more than `beyond_stop` [rad] beyond its position limit ends the run with a fault.
    """

    kind: Literal["mujoco"]
    beyond_stop: Positive = 0.2
    servo: ServoSection = ServoSection()
    joints: JointsSection = JointsSection()


class PushSection(Section):
    """A force on the body of `joint`, at its centre of mass, from `at` for `duration` [s].

    `force` [N] is horizontal, in the `direction` [deg] from the world's x axis toward its y axis.
    """

    joint: str
    force: NotNegative
    direction: Finite = 0.0
    at: NotNegative = 0.0
    duration: Positive = 0.1

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

    Its [[contacts]] touch a floor, or table, at `height` [m] whose coefficient is `friction`;
    `softness` [s] is the time constant of a contact. `joint_friction` [N m] is Coulomb's friction,
    `armature` [kg m^2] the inertia of the drive of every joint beyond the robot's own, `delay` [s],
    a whole number of periods, the time by which torques arrive late; the controller knows of none
    of them. `pushes` disturb it. A robot whose centre of mass is `fall` [m] below its start, or
    whose base has tilted by `tilt` [rad] from it, has fallen, which ends the run with a fault. So
    does a joint more than `beyond_stop` [rad] beyond its position limit: joints have no stops in
    the simulation.
    """

    kind: Literal["torque"]
    height: Finite = 0.0
    friction: Positive = 0.7
    softness: Positive = 0.005
    joint_friction: NotNegative = 0.0
    armature: NotNegative = 0.0
    delay: NotNegative = 0.0
    fall: Positive = 0.2
    tilt: Positive = 1.0
    beyond_stop: Positive = 0.2
    pushes: tuple[PushSection, ...] = ()


class OwnPlant(AnyPlant, OwnSection):
    """A plant of a plugin; further keys are those of the plugin."""

    group: ClassVar[Group] = "plants"


if TYPE_CHECKING:
    PlantKind = AnyPlant
else:
    PlantKind = any_kind("plants", OwnPlant, "kinematic")
