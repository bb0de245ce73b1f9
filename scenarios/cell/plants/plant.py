"""What a plant is, one that follows its commands exactly, how joints are measured, and [plant]."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hierarchy import Robot, State
from hierarchy.avoidance import Obstacles
from hierarchy.contacts import Contacts
from hierarchy.errors import brief, expect, finite_numbers, refuse
from hierarchy.jit import compiled, inlined
from hierarchy.problem import Array
from hierarchy.task import Level
from hierarchy.tasks.joints.mechanism import Mechanism
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections.plant import MeasurementSection

_WHOLE = 1e-6  # of a period: tolerance of a delay in whole periods
_MOST = 1_000_000  # periods of a delay: what is on its way is kept in memory


class Plant(Protocol):
    """A simulated robot that commands move.

    `q` (nq,) [rad] and `v` (n,) [rad/s] are measured values; `a` (n,) [rad/s^2] is the acceleration
    of the last command. `extra` has further signals of the last period to record, by name; its
    arrays stay the same objects. A plant may have a `fault`, which says why it cannot go on, such
    as a fall, and is None before.
    """

    q: Array
    v: Array
    a: Array
    extra: Mapping[str, NDArray[Any]]

    def act(self, command: Array) -> None:
        """Apply a command for one period: velocities or accelerations (n,), or joint torques."""


class KinematicArm:
    """Integrator: q += v T + a T^2 / 2, v += a T, or at velocity level q += x T, v = x.

    Joints that follow others, and closed chains, stay so: after a step q and v are moved back onto
    the robot's mechanism. `q` (nq,), `v` (n,) hold the state, `a` (n,) the acceleration of the last
    step [rad, s]; `extra` is empty.
    """

    def __init__(self, robot: Robot, q: Array, v: Array, period: float, level: Level) -> None:
        self.q, self.v, self.a = q.copy(), v.copy(), np.zeros(robot.n)
        self.extra: Mapping[str, NDArray[Any]] = {}
        self._robot, self._period = robot, period
        self._acceleration = int(level == "acceleration")
        self._step = np.zeros(robot.n)
        self._turning = robot.nq != robot.n  # joints with more coordinates than velocities
        self._q = np.zeros(robot.n) if self._turning else self.q
        self._mechanism = Mechanism(robot)

    def act(self, command: Array) -> None:
        """Apply a command (n,) for one period."""
        _integrate(command, self._period, self._acceleration, self.v, self.a, self._step,
                   self._q)
        if self._turning:
            self.q = self._robot.integrate(self.q, self._step)
        if self._mechanism:
            self.q[:] = self._mechanism.closed(self.q)
            self.v[:] = self._mechanism.moving(self.q, self.v)


class Apart:
    """A plant whose q and v are what `sensed` returns for the true ones, once per period.

    `true` is the plant; its state at the start of each period is recorded as `true_q`, `true_v`.
    """

    def __init__(self, plant: Plant,
                 sensed: Callable[[Array, Array], tuple[Array, Array]]) -> None:
        self.true, self._sensed = plant, sensed
        self._true_q, self._true_v = plant.q.copy(), plant.v.copy()
        self.extra: Mapping[str, NDArray[Any]] = {
            "true_q": self._true_q, "true_v": self._true_v, **plant.extra}
        self.a, (self.q, self.v) = plant.a, sensed(plant.q, plant.v)

    @property
    def fault(self) -> str | None:
        """Why the plant cannot go on, or None."""
        fault: str | None = getattr(self.true, "fault", None)
        return fault

    def act(self, command: Array) -> None:
        """Apply a command (n,) for one period, then measure."""
        plant = self.true
        self._true_q[:], self._true_v[:] = plant.q, plant.v
        plant.act(command)
        self.a, (self.q, self.v) = plant.a, self._sensed(plant.q, plant.v)


def whole_periods(delay: float, period: float, key: str) -> int:
    """Return a delay [s] in periods; ScenarioError, naming its key, if too many or not whole."""
    behind = delay / period
    if behind > _MOST:
        raise ScenarioError(f"{key} = {delay:g} s is more than {_MOST} periods of {period:g} s")
    if abs(behind - round(behind)) > _WHOLE:
        raise ScenarioError(f"{key} = {delay:g} s is not a whole number of periods of {period:g} s")
    return round(behind)


class JointSensor:
    """Joint sensors with noise, quantisation and delay, read every `period` [s]; seeded.

    Noise is added to a position, then it is rounded to the nearest step. With velocity =
    "differenced" the velocity is the backward difference of these positions after a first-order
    low-pass filter; the first one is the true velocity. Values arrive `delay` later, until then
    those of the start. Noise is a small motion from the true position, of which the base of a robot
    takes part; steps are those of joints only. Raises ScenarioError if the delay is not a whole
    number of periods.
    """

    def __init__(self, section: MeasurementSection, period: float, robot: Robot) -> None:
        self._robot = robot
        behind = whole_periods(section.delay, period, "plant.measurement.delay")
        self._section, self._period = section, period
        self._random = np.random.default_rng(section.seed)
        self._behind: deque[tuple[Array, Array]] = deque(maxlen=behind + 1)
        self._last: tuple[Array, Array] | None = None  # position and filtered velocity

    def __call__(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the measurement (n,), (n,) when the joints are at q (n,), v (n,)."""
        section, position = self._section, self._position(q)
        if section.velocity == "measured":
            velocity = v + self._noise(section.velocity_noise, len(v))
        elif self._last is None:
            velocity = v.copy()
        else:
            before, velocity = self._last
            share = self._period / (self._period + section.filter_time)
            moved = self._robot.difference(before, position)
            velocity = velocity + share * (moved / self._period - velocity)
        self._last = position, velocity
        self._behind.append(self._last)
        return self._behind[0]

    def _position(self, q: Array) -> Array:
        robot, step = self._robot, self._section.quantisation
        moved = self._noise(self._section.position_noise, robot.n)
        noisy = q + moved if robot.nq == robot.n else robot.integrate(q, moved)
        if step == 0.0:
            return noisy
        if robot.nq == robot.n:
            return np.round(noisy / step) * step
        joints = robot.vector(noisy)[robot.actuated:]
        return robot.configuration(np.round(joints / step) * step, noisy)

    def _noise(self, deviation: float, n: int) -> Array:
        return deviation * self._random.standard_normal(n)


def plant_of(scenario: Scenario, start: State, obstacles: Obstacles,
             contacts: Contacts | None = None) -> Plant:
    """Return the plant of a robot at its start; `contacts` as in a Cell.

    Raises ScenarioError if the requested measurement is not possible for the robot's joints.
    """
    section, control, robot = scenario.plant, scenario.control, start.robot
    sensor = JointSensor(section.measurement, control.period, robot)
    plant = section.made(robot, q=start.q, v=start.v, period=control.period, level=control.level,
                         obstacles=obstacles, contacts=contacts)
    _check(plant, f"plant of kind {section.kind!r}", robot)
    driven = hasattr(plant, "reference_q")
    if section.feedback == "commanded" and not (driven or section.follows):
        raise ScenarioError(f'plant.feedback = "commanded": a plant of kind {section.kind!r} has '
                            "no reference_q and reference_v")
    if section.feedback == "measured" and (driven or not section.measurement.ideal):
        return Apart(plant, sensor)
    if section.feedback == "commanded" and driven:  # the integral of the controller's commands
        return Apart(plant, lambda q, v: (plant.reference_q.copy(), plant.reference_v.copy()))
    found: Plant = plant
    return found


def _check(plant: Any, what: str, robot: Robot) -> None:
    """Raise a HierarchyError for what is no plant of a robot; a plug-in may return anything."""
    refuse(not callable(getattr(plant, "act", None)), f"{what}: {brief(plant)} has no method act")
    for name, size in (("q", robot.nq), ("v", robot.n), ("a", robot.n)):
        finite_numbers(f"{what}: {name}", getattr(plant, name, None), size)
    expect(f"{what}: extra", getattr(plant, "extra", None), Mapping, "give {} for no signals")


@compiled
def _integrate(x, T, acceleration, v, a, step, q):
    for i in range(len(v)):
        a[i], v[i], step[i] = after(x[i], T, acceleration, v[i])
        q[i] += step[i]


@inlined
def after(x, T, acceleration, v):
    """Acceleration, velocity in the end, and step of a joint of velocity v with a command x."""
    if acceleration:
        return x, v + x * T, v * T + x * T * T / 2
    return (x - v) / T, x, x * T
