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
    """A force on the body of `joint`, at its centre of mass, from `at` for `duration` [s].

    `force` [N] is horizontal, in the `direction` [deg] from the world's x axis toward its y axis.
    """

    joint: str
    force: Force
    direction: Annotated[Finite, Unit("deg")] = 0.0
    at: Time = 0.0
    duration: Span = 0.1

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
    a whole number of periods, the time by which torques arrive late, `joint_damping` [N m s/rad]
    viscous friction, `bandwidth` [Hz] that of the motors' torques, without which they follow at
    once; the controller knows of none of them. With `self_collision` the robot's capsules touch
    one another, except neighbours and those that overlap at the start. `pushes` disturb it. A robot
    whose centre of mass is `fall` [m] below its start, or whose base has tilted by `tilt` [rad]
    from it, has fallen, which ends the run with a fault. So does a joint more than `beyond_stop`
    [rad] beyond its position limit, where it has a stop if there are `stops`.
    """

    made_by: ClassVar[str] = "scenarios.cell.plants.torque:TorqueRobot"
    levels: ClassVar[tuple[str, ...]] = ("torque",)
    kind: Literal["torque"]
    height: Annotated[Finite, Unit("m")] = 0.0
    friction: Positive = 0.7
    softness: Span = 0.005
    joint_friction: Annotated[NotNegative, Unit("N m")] = 0.0
    armature: Annotated[NotNegative, Unit("kg m^2")] = 0.0
    joint_damping: Annotated[NotNegative, Unit("N m s/rad")] = 0.0
    delay: Time = 0.0
    bandwidth: Annotated[Positive, Unit("Hz")] | None = None
    stops: Flag = True
    self_collision: Flag = False
    fall: Length = 0.2
    tilt: Annotated[Positive, Unit("rad")] = 1.0
    beyond_stop: Annotated[Positive, Unit("rad")] = 0.2
    pushes: tuple[PushSection, ...] = ()
