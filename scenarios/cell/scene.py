"""Make obstacles and the sensor of distances to them, from [avoidance] and [sensor]."""

from __future__ import annotations

from hierarchy import HierarchyError, State
from hierarchy.avoidance import Obstacles
from scenarios.cell.sensors import ExactDistances, Sensor
from scenarios.cell.sensors.sensor import Asked
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceKind, AvoidanceSection, ObstacleSection


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
    asked = _asked(section, (scenario.limits and scenario.limits.danger_reach) or 0.0)
    exact = ExactDistances(robot, sensor.obstacles if sensor else make_obstacles(section.placed),
                           asked.body, asked.tip, asked.mean_within,
                           pairs=not isinstance(section, AvoidanceSection))
    try:
        made: Sensor = scenario.sensor.made(robot, exact=exact, asked=asked, body=asked.body,
                                            tip=asked.tip)
    except ScenarioError:
        raise
    except HierarchyError as error:
        raise ScenarioError(f"sensor: {error}") from error
    if sensor is None:
        made.check_start(start)
    return made


def _asked(section: AvoidanceKind, danger: float) -> Asked:
    if not isinstance(section, AvoidanceSection):
        return Asked(max(section.influence, danger))
    mean = (section.far, section.end_effector) if section.direction == "mean" else (0.0, 0.0)
    return Asked(max(section.far, section.end_effector, danger), mean, section.body.make(),
                 section.tip.make())


def make_obstacles(sections: tuple[ObstacleSection, ...]) -> Obstacles:
    """Make the scene's obstacles, numbered from 1 in messages."""
    return Obstacles([section.make(f"obstacle {i}") for i, section in enumerate(sections, 1)])
