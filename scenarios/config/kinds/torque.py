"""A robot with torque motors on a floor, in a physics simulation."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.plugins import register
from hierarchy.problem import Array
from scenarios.config.plant import AnyPlant
from scenarios.config.sections import (
    Finite,
    Flag,
    Force,
    Length,
    NotNegative,
    Positive,
    Section,
    Span,
    Time,
    Unit,
)

_ROUNDING = 1e-9  # [s] of times


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
    joint_friction: Annotated[NotNegative, Unit("N m")] = 0.0
    """Coulomb friction of every joint."""
    armature: Annotated[NotNegative, Unit("kg m^2")] = 0.0
    """Inertia of the drive of every joint beyond the robot's own."""
    joint_damping: Annotated[NotNegative, Unit("N m s/rad")] = 0.0
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
