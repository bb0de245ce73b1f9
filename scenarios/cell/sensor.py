"""Make obstacles and the sensor of distances to them, from [avoidance] and [sensor]."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from hierarchy import HierarchyError, Robot
from hierarchy.avoidance import Capsule, Obstacle, Obstacles, Repulsion
from scenarios.cell.avoidance import repulsion_of
from scenarios.cell.sensors import ExactDistances, Sensor
from scenarios.cell.sensors.camera import DepthCamera, Pinhole, looking_at
from scenarios.cell.sensors.depth_sensor import DepthSensor, Source
from scenarios.cell.sensors.depth_space import DepthSpace
from scenarios.cell.sensors.frames import RecordedFrames
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection, ObstacleSection, SeparationSection
from scenarios.config.sensor import (
    CameraSection,
    DepthErrors,
    ExactSection,
    FramesSection,
    OwnSensor,
)


class _Asked(NamedTuple):
    """What a sensor must provide: `region` [m], where directions are means [m], repulsion laws."""

    region: float
    mean_within: tuple[float, float] = (0.0, 0.0)
    body: Repulsion | None = None
    tip: Repulsion | None = None


def sensor_of(scenario: Scenario, robot: Robot,
              obstacles: Obstacles | None = None) -> Sensor | None:
    """Return the sensor of distances to the obstacles, None without [avoidance].

    `obstacles` default to those of the scenario. Raises ScenarioError if the robot has no control
    points, or [sensor] does not fit it.
    """
    section = scenario.avoidance
    if section is None:
        return None
    if not robot.control_points:
        raise ScenarioError(f"[avoidance]: robot {robot.name!r} has no control points; list them "
                            "in robot.control_points")
    if obstacles is None:
        obstacles = make_obstacles(section.placed)
    if isinstance(section, SeparationSection):
        exact = ExactDistances(robot, obstacles, pairs=True)
        return _seen_by(scenario, robot, exact, _Asked(section.influence))
    asked = _Asked(max(section.far, section.end_effector), _mean_within(section),
                   repulsion_of(section.body), repulsion_of(section.tip))
    exact = ExactDistances(robot, obstacles, asked.body, asked.tip, asked.mean_within)
    return _seen_by(scenario, robot, exact, asked)


def _mean_within(section: AvoidanceSection) -> tuple[float, float]:
    """Return the distances [m] of body and end effector over which directions are means."""
    return (section.far, section.end_effector) if section.direction == "mean" else (0.0, 0.0)


def _seen_by(scenario: Scenario, robot: Robot, exact: ExactDistances, asked: _Asked) -> Sensor:
    """Return the sensor of the scenario's kind, given the exact one."""
    if isinstance(scenario.sensor, ExactSection):
        return exact
    if isinstance(scenario.sensor, OwnSensor):
        own: Sensor = scenario.sensor.made(robot, exact=exact, body=asked.body, tip=asked.tip)
        return own
    danger = scenario.limits.danger_reach if scenario.limits else None
    assert isinstance(scenario.sensor, CameraSection | FramesSection)
    try:
        return _depth_sensor(scenario.sensor, robot, exact,
                             asked._replace(region=max(asked.region, danger or 0.0)))
    except HierarchyError as error:
        raise ScenarioError(f"sensor: {error}") from error


def _depth_sensor(section: CameraSection | FramesSection, robot: Robot, exact: ExactDistances,
                  asked: _Asked) -> DepthSensor:
    """Make the depth sensor of a section for the points that `exact` measures."""
    capsules = _capsules(robot, section.foot)
    source: Source
    checked: ExactDistances | None = None
    if isinstance(section, CameraSection):
        source, checked = _camera(section, exact, capsules), exact
    else:
        source = RecordedFrames(section.folder, robot, section.latency)
    space = DepthSpace(source.pinhole, exact.points, capsules, section.region or asked.region,
                       margin=section.margin, thin=inf if section.thin is None else section.thin,
                       support=section.support, band=section.band, mean_within=asked.mean_within,
                       body=asked.body, tip=asked.tip, pairs=exact.measurement.pairs is not None)
    return DepthSensor(source, space, section.stale_after, section.least_readings, checked)


def _camera(section: CameraSection, exact: ExactDistances,
                capsules: tuple[Capsule, ...]) -> DepthCamera:
    """Make the simulated camera of a section."""
    rotation = (looking_at(section.position, section.look_at) if section.rotation is None
                else np.array(section.rotation))
    pinhole = Pinhole(section.width, section.height, section.fx, section.fy, section.cx,
                      section.cy, section.position, rotation)
    errors = DepthErrors.none(section.near, section.far) if section.ideal else section
    return DepthCamera(pinhole, exact.obstacles, capsules, errors, rate=section.rate,
                       jitter=section.jitter, latency=section.latency, seed=section.seed,
                       point_radius=section.point_radius, backdrop=section.backdrop or inf)


def _capsules(robot: Robot, foot: float) -> tuple[Capsule, ...]:
    if not robot.capsules:
        raise HierarchyError(f"robot {robot.name!r} has no capsules, which are needed to remove "
                             "it from the image")
    if foot == 0.0 or robot.base == "floating":
        return robot.capsules
    column = Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), robot.capsules[0].radius)
    return (column, *robot.capsules)


def make_obstacles(sections: tuple[ObstacleSection, ...]) -> Obstacles:
    """Make the scene's obstacles, numbered from 1 in messages."""
    return Obstacles([_obstacle(i, section) for i, section in enumerate(sections, 1)])


def _obstacle(number: int, section: ObstacleSection) -> Obstacle:
    path = None if section.path is None else section.path.make()
    size = {"point": (), "sphere": (section.radius,),
            "capsule": (section.radius, section.half_length),
            "box": section.half_lengths}[section.shape]
    return Obstacle(section.shape, section.centre or (0.0, 0.0, 0.0),
                    tuple(float(s) for s in size or () if s is not None),
                    np.array(section.rotation), path, f"obstacle {number}")
