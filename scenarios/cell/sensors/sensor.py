"""What a sensor is, exact distances, and the sensor that [avoidance] and [sensor] ask for."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Measurement, Obstacles, Pairs, Repulsion, measure_pairs
from hierarchy.avoidance.body import pack_points
from hierarchy.avoidance.measurement import measure_exactly
from hierarchy.errors import brief, expect, number, refuse
from hierarchy.jit import bind
from hierarchy.problem import Array
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections import naming
from scenarios.config.sections.avoidance import AvoidanceSection, ObstacleSection


class Sensor(Protocol):
    """Measures distances of a robot's points to obstacles; see `ExactDistances`, `DepthSensor`."""

    measurement: Measurement  #: The last measurement, always the same object.
    obstacles: Obstacles  #: The obstacles, as they are now.
    outside: float  #: Time [s] of the last measurement that the control loop would not spend.

    def measure(self, state: State) -> Measurement:
        """Measure at a state and attach the measurement to it; valid until the next call."""


_TOUCHING = 1e-9  # [m] a control point this close to an obstacle has no direction away from it


def packed_laws(body: Repulsion | None = None, tip: Repulsion | None = None) -> Array:
    """Return the laws (2, 4) of both for kernels; without both there is no repulsion."""
    return np.array([body.packed(), tip.packed()] if body and tip else [(0.0, 1.0, 1.0, 1.0)] * 2)


class ExactDistances:
    """Measures a robot's control points and end effector against obstacles.

    `body` and `tip` are the magnitudes of the repulsion of the control points and of the end
    effector; without both there is no repulsion. Directions are the mean (25)-(26) over the
    obstacles nearer than `mean_within` [m], for control points and end effector, where there are
    any; with 0 those of the nearest obstacle. With `pairs`, every point is also measured against
    every obstacle, as `Separation` needs. `points` are what is measured, `laws` as `packed_laws`.
    """

    outside = 0.0  # [s] of a measurement that is not part of the control loop

    def __init__(self, robot: Robot, obstacles: Obstacles, body: Repulsion | None = None,
                 tip: Repulsion | None = None,
                 mean_within: tuple[float, float] = (0.0, 0.0), pairs: bool = False) -> None:
        self._robot, self.points = robot, sensed_points(robot)
        self._obstacles, self.mean_within = obstacles, np.array(mean_within)
        self._joints, self._offsets = pack_points(self.points)
        self.laws = packed_laws(body, tip)
        self.measurement = Measurement(len(robot.control_points))
        self._followed: State | None = None
        self._measure: Callable[[], object]
        if pairs:
            self.measurement.pairs = Pairs(len(self.points), len(obstacles))

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles, as they are now; setting others raises a HierarchyError."""
        return self._obstacles

    @obstacles.setter
    def obstacles(self, _: object) -> None:
        raise HierarchyError("ExactDistances: obstacles cannot be set, as tasks have rows for these"
                             "; make another sensor, or move them by a path or obstacles.shift")

    def measure(self, state: State) -> Measurement:
        """Measure at a state and attach the measurement to it; valid until the next call."""
        if state is not self._followed:
            self._robot.check_same("ExactDistances: state", state.robot)
            self._followed = state
            self._measure = bind(measure_exactly, state.placements, self._joints, self._offsets,
                                 self._obstacles.table, self.laws, self.mean_within,
                                 self.measurement.arrays)
        self._obstacles.at(state.t)
        self._measure()
        if self.measurement.pairs is not None:
            measure_pairs(self.measurement.pairs, self.measurement.points, self._obstacles)
        state.measurement = self.measurement
        return self.measurement

    def check_start(self, state: State) -> None:
        """Raise a HierarchyError if an obstacle lies at a control point, or a point inside one."""
        seen = self.measure(state)
        for k in np.flatnonzero(seen.distance < _TOUCHING)[:1]:
            obstacle = self.obstacles.obstacles[seen.nearest[k]]
            what = "end effector" if k == len(self.points) - 1 else f"control point {k + 1}"
            raise HierarchyError(
                f"{obstacle.name} at {self.obstacles.centres[seen.nearest[k]].tolist()} m "
                f"touches {what} ({self.points[k].name}) at the start: distance "
                f"{seen.distance[k]:.3g} m")


def sensor_of(scenario: Scenario, start: State,
              kept: tuple[Scenario, Sensor | None] | None = None) -> Sensor | None:
    """Return the sensor of distances to the obstacles, None without [avoidance].

    `kept` is another scenario and its sensor, which stays if all settings of it are the same; else
    its obstacles stay. New ones must not touch the robot at the start. Raises ScenarioError if the
    robot has no control points, or [sensor] does not fit it.
    """
    section, robot = scenario.avoidance, start.robot
    before, sensor = kept or (None, None)
    if before and (sensor is None or (section, scenario.sensor, scenario.limits) == (
            before.avoidance, before.sensor, before.limits)):
        return sensor
    if section is None:
        return None
    if not robot.control_points:
        raise ScenarioError(f"[avoidance]: robot {robot.name!r} has no control points; list them "
                            "in robot.control_points")
    obstacles = sensor.obstacles if sensor else make_obstacles(section.placed)
    danger = (scenario.limits and scenario.limits.danger_reach) or 0.0
    body = tip = None
    if isinstance(section, AvoidanceSection):
        reach = section.far, section.end_effector
        body, tip = section.body.make(), section.tip.make()
        exact = ExactDistances(robot, obstacles, body, tip,
                               reach if section.direction == "mean" else (0.0, 0.0))
    else:
        reach = section.influence, section.influence
        exact = ExactDistances(robot, obstacles, pairs=True)
    with naming("sensor"):
        made: Sensor = scenario.sensor.made(robot, exact=exact, reach=max(*reach, danger),
                                            body=body, tip=tip)
    _check(made, f"sensor of kind {scenario.sensor.kind!r}")
    if sensor is None and not scenario.sensor.is_recorded:
        exact.check_start(start)
    return made


def _check(sensor: Any, what: str) -> None:
    """Raise a HierarchyError for what is no sensor; a plug-in may return anything."""
    refuse(not callable(getattr(sensor, "measure", None)),
           f"{what}: {brief(sensor)} has no method measure")
    for name, kind in (("measurement", Measurement), ("obstacles", Obstacles)):
        expect(f"{what}: {name}", getattr(sensor, name, None), kind, "give that of `exact`")
    number(f"{what}: outside", getattr(sensor, "outside", None), least=0.0)


def make_obstacles(sections: tuple[ObstacleSection, ...]) -> Obstacles:
    """Make the scene's obstacles, numbered from 1 in messages."""
    return Obstacles([section.make(f"obstacle {i}") for i, section in enumerate(sections, 1)])
