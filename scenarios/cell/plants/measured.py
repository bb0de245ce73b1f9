"""Measurement of a plant, separate from its true state."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hierarchy import Robot
from hierarchy.problem import Array
from scenarios.cell.plants.plant import Driven, Plant, fault_of
from scenarios.config import ScenarioError
from scenarios.config.plant import MeasurementSection

_WHOLE = 1e-6  # of a period: tolerance of a delay in whole periods


class Sensed(Protocol):
    """Turns the true state into the measured one."""

    def __call__(self, q: Array, v: Array) -> tuple[Array, Array]: ...  # noqa: D102


class Apart:
    """A plant whose q and v are measured by `sensed`, once per period.

    The true state at the start of each period is recorded as `true_q`, `true_v`.
    """

    def __init__(self, plant: Plant, sensed: Sensed) -> None:
        self._plant, self._sensed = plant, sensed
        self._true_q, self._true_v = plant.q.copy(), plant.v.copy()
        self.extra: Mapping[str, NDArray[Any]] = {
            "true_q": self._true_q, "true_v": self._true_v, **plant.extra}
        self.q, self.v = sensed(plant.q, plant.v)

    @property
    def a(self) -> Array:
        """The acceleration (n,) [rad/s^2] of the last command."""
        return self._plant.a

    @property
    def fault(self) -> str | None:
        """Why the plant cannot go on, or None."""
        return fault_of(self._plant)

    def act(self, command: Array) -> None:
        """Apply a command (n,) for one period, then measure."""
        plant = self._plant
        self._true_q[:], self._true_v[:] = plant.q, plant.v
        plant.act(command)
        self.q, self.v = self._sensed(plant.q, plant.v)


class Commanded:
    """Returns the integral of the controller's own commands instead of the real joint state."""

    def __init__(self, plant: Driven) -> None:
        self._plant = plant

    def __call__(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the reference in place of q (n,), v (n,)."""
        return self._plant.reference_q.copy(), self._plant.reference_v.copy()


def whole_periods(delay: float, period: float, key: str) -> int:
    """Return a delay [s] in periods; ScenarioError, naming its key, if it is not a whole number."""
    behind = delay / period
    if abs(behind - round(behind)) > _WHOLE:
        raise ScenarioError(f"{key} = {delay:g} s is not a whole number of periods of {period:g} s")
    return round(behind)


class JointSensor:
    """Joint sensors with noise, quantisation and delay, read every `period` [s]; seeded.

    Noise is added to a position, then it is rounded to the nearest step. With velocity =
    "differenced" the velocity is the backward difference of these positions after a first-order
    low-pass filter; the first one is the true velocity. Values arrive `delay` later, until then
    those of the start. Noise of a joint with more coordinates than velocities is a small motion
    from its true position, of which the base of a robot takes part. Raises ScenarioError if the
    delay is not a whole number of periods, or for steps or differences of such joints.
    """

    def __init__(self, section: MeasurementSection, period: float, robot: Robot) -> None:
        if robot.nq != robot.n and (section.quantisation or section.velocity == "differenced"):
            raise ScenarioError(f"plant.measurement: robot {robot.name!r} has joints with more "
                                "coordinates than velocities, which support no quantisation and no "
                                "differenced velocity")
        self._robot = robot
        behind = whole_periods(section.delay, period, "plant.measurement.delay")
        self._section, self._period = section, period
        self._random = np.random.default_rng(section.seed)
        self._behind: deque[tuple[Array, Array]] = deque(maxlen=behind + 1)
        self._last: tuple[Array, Array] | None = None  # position and filtered velocity

    def __call__(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the measurement (n,), (n,) when the joints are at q (n,), v (n,)."""
        position = self._position(q)
        velocity = (self._differenced(position, v) if self._section.velocity == "differenced"
                    else v + self._noise(self._section.velocity_noise, len(v)))
        self._last = position, velocity
        self._behind.append((position, velocity))
        return self._behind[0]

    def _position(self, q: Array) -> Array:
        if self._robot.nq != self._robot.n:
            moved = self._noise(self._section.position_noise, self._robot.n)
            return self._robot.integrate(q, moved)
        noisy = q + self._noise(self._section.position_noise, len(q))
        step = self._section.quantisation
        return noisy if step == 0.0 else np.round(noisy / step) * step

    def _noise(self, deviation: float, n: int) -> Array:
        return deviation * self._random.standard_normal(n)

    def _differenced(self, position: Array, v: Array) -> Array:
        if self._last is None:
            return v.copy()
        before, velocity = self._last
        share = self._period / (self._period + self._section.filter_time)
        return velocity + share * ((position - before) / self._period - velocity)
