"""The keys of [plant]: what moves, and how it is measured."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.config.sections import NotNegative, Positive, Section


class MeasurementSection(Section):
    """What the controller is told of the joints, for either plant; all zero: exactly what is so.

    Normal noise of deviation `position_noise` [rad] and `velocity_noise` [rad/s], drawn from
    `seed`; steps of the position `quantisation` [rad]; `delay` [s], whole periods. velocity =
    "measured" is a sensor of its own, "differenced" the backward difference of measured positions
    behind a low-pass of `filter_time` [s].
    """

    position_noise: NotNegative = 0.0
    velocity_noise: NotNegative = 0.0
    quantisation: NotNegative = 0.0
    delay: NotNegative = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
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
        """Whether nothing is changed by measuring."""
        return self.velocity == "measured" and not (
            self.position_noise or self.velocity_noise or self.quantisation or self.delay)


class ServoSection(Section):
    """The position servo of each joint of the physics plant.

    torque = k (reference - q) + c (its rate - v) + `gravity` times what holds the arm, within the
    effort limits. k = m `bandwidth`^2 and c = 2 m `bandwidth` [rad/s], where m is the inertia that
    the joint has at the start, drive included. It runs at `rate` [Hz] (or a little faster, a whole
    number of times a period) on references interpolated linearly. `feedforward` off leaves out the
    rate of the reference. The reference leads its joint by at most `lead` [rad], so that an arm
    that is held back does not run after.
    """

    rate: Annotated[float, Field(ge=200.0, le=10000.0)] = 1000.0
    bandwidth: Positive | tuple[Positive, ...] = 80.0
    gravity: NotNegative = 1.0
    feedforward: bool = True
    lead: Positive = 0.1


class JointsSection(Section):
    """Joints of the physics plant: one number for all, or one each. Plausible, not identified.

    friction [N m] is dry; damping [N m s/rad]; armature [kg m^2] is the inertia of motor and gear
    as felt at the joint.
    """

    friction: NotNegative | tuple[NotNegative, ...] = 0.5
    damping: NotNegative | tuple[NotNegative, ...] = 1.0
    armature: NotNegative | tuple[NotNegative, ...] = 0.3


class PlantSection(Section):
    """What the commands move: "kinematic" follows them exactly, "mujoco" is simulated physics.

    `servo` and `joints` are those of "mujoco". It adds the commands up to a joint position
    reference. With feedback = "commanded" the controller is told that reference in place of what
    `measurement` says: it then sees neither noise nor what the joints do, as where commands through
    FRI are integrated blindly. Both are stable with the letter's gains.
    """

    kind: Literal["kinematic", "mujoco"] = "kinematic"
    feedback: Literal["measured", "commanded"] = "measured"
    measurement: MeasurementSection = MeasurementSection()
    servo: ServoSection = ServoSection()
    joints: JointsSection = JointsSection()
