"""The stops of joints, and how far one may be beyond its own."""

from __future__ import annotations

from typing import final

import numpy as np

from hierarchy import Robot
from hierarchy.problem import Array


@final
class Stops:
    """The position limits of a robot's joints.

    A joint that is more than `beyond` [rad or m] past one has gone through its stop. Where a joint
    starts beyond a limit, at q (nq,), its stop is there.
    """

    def __init__(self, robot: Robot, q: Array, beyond: float) -> None:
        self._names, self._units = robot.velocity_names, robot.velocity_units
        self._of, self._beyond = robot.coordinates, beyond
        self._lower = np.minimum(robot.lower, q)[self._of]
        self._upper = np.maximum(robot.upper, q)[self._of]

    def passed(self, q: Array) -> str | None:
        """Return which joint at q (nq,) is farthest beyond its stop, None if none is too far."""
        here = q[self._of]
        over = np.maximum(self._lower - here, here - self._upper)
        i = int(over.argmax())
        if not over[i] > self._beyond:
            return None
        stop, unit = self._upper[i] if here[i] > self._upper[i] else self._lower[i], self._units[i]
        return (f"joint {self._names[i]} is {over[i]:.2g} {unit} beyond its stop at {stop:.4g} "
                f"{unit} (plant.beyond_stop = {self._beyond:g}),")
