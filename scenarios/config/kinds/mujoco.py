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
