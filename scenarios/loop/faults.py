"""Injected faults, placed between plant, sensor, resolver and controller."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, ClassVar, final

import numpy as np

from hierarchy.avoidance import Measurement
from hierarchy.problem import Array, Hierarchy
from hierarchy.robot import Frame, Robot
from hierarchy.state import State
from scenarios.cell.build import Cell
from scenarios.cell.robot import point_of
from scenarios.cell.sensors import DepthSensor, Sensor
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections.avoidance import ObstacleSection
from scenarios.config.sections.control import FaultSection
from solvers import Resolution, Status
from solvers.resolver import Around, Handles

_AWAY = (1e3, 1e3, 1e3)  # [m] where an obstacle is until its fault starts


@final
class Faults:
    """The faults of a scenario around its cell, which is that of the scenario `with_room`.

    `cell` has them, and `clock` [s], which they may advance, is that of its controller. Call
    `measure` once before each command, in order of time. Raises ScenarioError where a fault does
    not fit the robot.
    """

    def __init__(self, cell: Cell) -> None:
        self._sections, self._now = cell.scenario.faults, 0.0
        self._period = cell.scenario.control.period
        self._skipped, self._skipped_at = 0.0, -1.0
        self._standing: set[int] = set()
        check(self._sections, cell.robot)
        self._last = cell.plant.q.copy(), cell.plant.v.copy(), 0.0
        self.cell = replace(cell, resolver=_FaultyResolver(inner=cell.resolver, faults=self),
                            sensor=cell.sensor and FaultySensor(cell.sensor, self))

    def clock(self) -> float:
        """Return the time [s], with what ticks took longer."""
        return perf_counter() + self._skipped

    def measure(self, t: float) -> tuple[Array, Array, float]:
        """Return q (nq,) and v (n,) as measured at time t [s], and when that was [s]."""
        self._now = t
        self._place_obstacles()
        if not any(self.now("stale")):
            q, v, robot = self.cell.plant.q.copy(), self.cell.plant.v.copy(), self.cell.robot
            base, positions = robot.actuated, robot.coordinates[robot.actuated:] + 1
            _spoil(q, [int(positions[fault.joint - 1]) if fault.joint else None
                       for fault in self.now("nan_position")])
            _spoil(v, [base + fault.joint if fault.joint else None
                       for fault in self.now("nan_velocity")])
            self._last = q, v, t
        return self._last

    def now(self, kind: str) -> Iterator[FaultSection]:
        """Yield the active faults of a kind."""
        return (fault for fault in self._sections if fault.kind == kind and self._on(fault))

    def overrun(self) -> None:
        """Let the present tick take as long as the active faults say."""
        if self._skipped_at != self._now:  # once a tick
            self._skipped_at = self._now
            self._skipped += sum(fault.takes or 0.0 for fault in self.now("overrun"))

    def _on(self, fault: FaultSection) -> bool:
        return bool(fault.acts(self._now, self._period))

    def _place_obstacles(self) -> None:
        """Place the obstacles of faults for this time."""
        spheres = [fault for fault in self._sections if fault.kind == "obstacle"]
        for i, fault in enumerate(spheres, -len(spheres)):
            if self._on(fault) != (i in self._standing):
                self._standing ^= {i}
                centre = np.array(fault.centre or _AWAY)
                if i not in self._standing:
                    centre[:] = _AWAY
                elif fault.place is not None:
                    point = point_of(self.cell.robot, fault.place, "place")
                    centre = State.at(self.cell.robot, self.cell.plant.q).position(
                        Frame("", point.joint, np.array(point.offset), np.eye(3)))
                assert self.cell.sensor is not None
                self.cell.sensor.obstacles.centres[i] = centre


class FaultySensor:
    """Wraps a sensor, sharing its measurement and obstacles."""

    def __init__(self, sensor: Sensor, faults: Faults) -> None:
        self._inner, self._faults = sensor, faults
        self.measurement, self.obstacles, self.outside = sensor.measurement, sensor.obstacles, 0.0

    def measure(self, state: State) -> Measurement:
        """Measure with the sensor and apply the active faults."""
        self.outside = 0.0
        if any(self._faults.now("stale")):
            return self.measurement
        if isinstance(self._inner, DepthSensor):
            self._inner.stopped = any(self._faults.now("no_frames"))
            self._inner.covered = any(self._faults.now("dark_frames"))
        seen = self._inner.measure(state)
        self.outside = self._inner.outside
        points = [fault.point for fault in self._faults.now("nan_distance")]
        _spoil(seen.distance, points)
        if seen.pairs is not None:
            _spoil(seen.pairs.table, points)
        return seen


@final
@dataclass(frozen=True, kw_only=True)
class _FaultyResolver(Around):
    """Wraps a resolver; its answers may be late or have another status."""

    name: ClassVar[str] = "faulty"
    handles: ClassVar[Handles] = "inequalities"
    faults: Faults

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Solve h with the inner resolver and apply the active faults."""
        resolution = self.inner.solve(h, memory)
        self.faults.overrun()
        fault = next(self.faults.now("status"), None)
        if fault is None:
            return resolution
        status = Status[str(fault.status).upper()]
        x = np.zeros(h.n) if status is Status.NUMERICAL_FAILURE else resolution.x
        found = Resolution(x, status, resolution.iterations, resolution.memory)
        found.witnesses = resolution.witnesses
        return found


def with_room(scenario: Scenario) -> Scenario:
    """Return a scenario with one distant obstacle added for each obstacle fault."""
    radii = [fault.radius for fault in scenario.faults if fault.kind == "obstacle"]
    if not radii or scenario.avoidance is None:
        return scenario
    waiting = (ObstacleSection(shape="sphere", centre=_AWAY, radius=radius) for radius in radii)
    avoidance = scenario.avoidance.model_copy(
        update={"obstacles": (*scenario.avoidance.obstacles, *waiting)})
    return scenario.model_copy(update={"avoidance": avoidance})


def check(faults: Iterable[FaultSection], robot: Robot) -> None:
    """Raise a ScenarioError for a fault that does not fit the robot, or return None."""
    joints, points = robot.n - robot.actuated, len(robot.control_points) + 1
    for i, fault in enumerate(faults):
        for key, value, most in (("joint", fault.joint, joints), ("point", fault.point, points)):
            if value is not None and value > most:
                raise ScenarioError(f"faults.{i}.{key} = {value}: robot {robot.name!r} has {most}")
        if fault.place is not None:
            point_of(robot, fault.place, f"faults.{i}.place")


def _spoil(values: Array, numbers: list[int | None]) -> None:
    """Write NaN into entry `number` (1, 2, ...) along the first axis, or into all for None."""
    for number in numbers:
        values[slice(None) if number is None else number - 1] = np.nan
