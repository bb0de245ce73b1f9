"""An arm in a physics simulation, under position servos."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from hierarchy.plugins import register
from scenarios.config.plant import AnyPlant
from scenarios.config.sections import Flag, NotNegative, Positive, Section, Unit

Bandwidth = Annotated[Positive, Unit("rad/s")]
Friction = Annotated[NotNegative, Unit("N m")]
Damping = Annotated[NotNegative, Unit("N m s/rad")]
Inertia = Annotated[NotNegative, Unit("kg m^2")]


class ServoSection(Section):
    """The position servo of each joint of the physics plant.

    torque = k (reference - q) + c (its rate - v) + `gravity` times the gravity torque, within the
    effort limits. k = m `bandwidth`^2 and c = 2 m `bandwidth` [rad/s], where m is the inertia of
    the joint at the start, including the drive. The servo runs at `rate` [Hz] (or slightly faster,
    a whole number of times per period) on linearly interpolated references. Without `feedforward`
    the rate of the reference is ignored. The reference leads its joint by at most `lead` [rad], so
    that a blocked arm does not rush to catch up.
    """

    rate: Annotated[float, Field(strict=True, ge=200.0, le=10000.0), Unit("Hz")] = 1000.0
    bandwidth: Bandwidth | tuple[Bandwidth, ...] = 80.0
    gravity: NotNegative = 1.0
    feedforward: Flag = True
    lead: Annotated[Positive, Unit("rad")] = 0.1


class JointsSection(Section):
    """Joints of the physics plant: one value for all or one each. Plausible, not identified.

    friction [N m] is dry friction; damping [N m s/rad]; armature [kg m^2] is the inertia of motor
    and gear at the joint.
    """

    friction: Friction | tuple[Friction, ...] = 0.5
    damping: Damping | tuple[Damping, ...] = 1.0
    armature: Inertia | tuple[Inertia, ...] = 0.3


@register("plants", "mujoco", shipped=True)
class PhysicsSection(AnyPlant):
    """A robot in a physics simulation, under position servos (extra `sim`).

    A joint more than `beyond_stop` [rad] beyond its position limit ends the run with a fault.
    """

    made_by: ClassVar[str] = "scenarios.cell.plants.physics:PhysicsArm"
    levels: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    kind: Literal["mujoco"]
    beyond_stop: Annotated[Positive, Unit("rad")] = 0.2
    servo: ServoSection = ServoSection()
    joints: JointsSection = JointsSection()
