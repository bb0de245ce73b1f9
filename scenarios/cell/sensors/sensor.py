"""What the control loop needs of a sensor."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from hierarchy import State
from hierarchy.avoidance import Measurement, Obstacles, Repulsion


class Asked(NamedTuple):
    """What a sensor must provide: `region` [m], where directions are means [m], repulsion laws."""

    region: float
    mean_within: tuple[float, float] = (0.0, 0.0)
    body: Repulsion | None = None
    tip: Repulsion | None = None


class Sensor(Protocol):
    """Measures distances of a robot's points to obstacles; see `ExactDistances`, `DepthSensor`."""

    @property
    def measurement(self) -> Measurement:
        """The last measurement, always the same object."""

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles, as they are now."""

    @property
    def outside(self) -> float:
        """Time [s] of the last measurement that the control loop would not spend."""

    def measure(self, state: State) -> Measurement:
        """Measure at a state and hang the measurement on it; valid until the next call."""

    def check_start(self, state: State) -> None:
        """Raise a HierarchyError if an obstacle touches a point of the robot at the start."""
