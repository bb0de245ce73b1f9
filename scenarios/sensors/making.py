"""From the section `[sensor]` of a scenario to a depth sensor."""

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy import HierarchyError, Robot
from hierarchy.avoidance import Capsule, Repulsion
from scenarios.config.sensor import SensorSection
from scenarios.sensors.camera import DepthCamera, Pinhole, looking_at
from scenarios.sensors.depth_sensor import DepthSensor, Source
from scenarios.sensors.depth_space import DepthSpace
from scenarios.sensors.errors import DepthErrors
from scenarios.sensors.exact import ExactDistances
from scenarios.sensors.frames import RecordedFrames


def make_depth_sensor(section: SensorSection, robot: Robot, exact: ExactDistances,
                      region: float, mean: bool = False, body: Repulsion | None = None,
                      tip: Repulsion | None = None) -> DepthSensor:
    """Make the sensor of a section for what `exact` would measure.

    `region` [m] is rho where the section has none; for the rest see `DepthSpace`. Raises
    HierarchyError where the section does not fit the robot.
    """
    capsules = _capsules(robot, section.foot)
    source: Source
    checked: ExactDistances | None = None
    if section.kind == "camera":
        source, checked = make_camera(section, exact, capsules), exact
    else:
        source = RecordedFrames(section.folder or "", robot, section.latency)
    space = DepthSpace(source.pinhole, exact.points, capsules, section.region or region,
                       section.margin, inf if section.thin is None else section.thin,
                       section.support, section.band, mean, body, tip,
                       exact.measurement.pairs is not None)
    return DepthSensor(source, space, section.stale_after, section.least_readings, checked)


def make_camera(section: SensorSection, exact: ExactDistances,
                capsules: tuple[Capsule, ...]) -> DepthCamera:
    """Make the simulated camera of a section."""
    rotation = (looking_at(section.position, section.look_at) if section.rotation is None
                else np.array(section.rotation))
    pinhole = Pinhole(section.width, section.height, section.fx, section.fy, section.cx,
                      section.cy, section.position, rotation)
    errors = DepthErrors.none(section.near, section.far) if section.ideal else DepthErrors(
        section.noise_floor, section.noise_growth, section.noise_from, section.rounding,
        section.step, section.near, section.far, section.missing, section.missing_at_edges,
        section.outliers, section.outlier_size)
    return DepthCamera(pinhole, exact.obstacles, capsules, errors, section.rate, section.jitter,
                       section.latency, section.seed, section.point_radius,
                       section.backdrop or inf)


def _capsules(robot: Robot, foot: float) -> tuple[Capsule, ...]:
    if not robot.capsules:
        raise HierarchyError(f"robot {robot.name!r} has no capsules, by which it is taken out of "
                             "the image")
    if foot == 0.0 or robot.base == "floating":
        return robot.capsules
    column = Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), robot.capsules[0].radius)
    return (column, *robot.capsules)
