"""Make the depth sensors of [sensor]: from a simulated camera, or from recorded frames."""

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy import HierarchyError, Robot
from hierarchy.avoidance import Capsule
from scenarios.cell.sensors.camera import DepthCamera, Pinhole, looking_at
from scenarios.cell.sensors.depth_sensor import DepthSensor, Source
from scenarios.cell.sensors.depth_space import DepthSpace
from scenarios.cell.sensors.exact import ExactDistances
from scenarios.cell.sensors.frames import RecordedFrames
from scenarios.cell.sensors.sensor import Asked
from scenarios.config.kinds.camera import CameraSection, DepthErrors, FramesSection, ImageSection


def camera(section: CameraSection, robot: Robot, exact: ExactDistances,
           asked: Asked) -> DepthSensor:
    """Make the sensor of a simulated camera, for the points that `exact` measures."""
    rotation = (looking_at(section.position, section.look_at) if section.rotation is None
                else np.array(section.rotation))
    pinhole = Pinhole(section.width, section.height, section.fx, section.fy, section.cx,
                      section.cy, section.position, rotation)
    errors = DepthErrors.none(section.near, section.far) if section.ideal else section
    capsules = _capsules(robot, section.foot)
    source = DepthCamera(pinhole, exact.obstacles, capsules, errors, rate=section.rate,
                         jitter=section.jitter, latency=section.latency, seed=section.seed,
                         point_radius=section.point_radius, backdrop=section.backdrop or inf)
    return _sensor(section, source, capsules, exact, asked, exact)


def frames(section: FramesSection, robot: Robot, exact: ExactDistances,
           asked: Asked) -> DepthSensor:
    """Make the sensor of recorded frames, which cannot be checked for obstacles at the start."""
    capsules = _capsules(robot, section.foot)
    source = RecordedFrames(section.folder, robot, section.latency)
    return _sensor(section, source, capsules, exact, asked, None)


def _sensor(section: ImageSection, source: Source, capsules: tuple[Capsule, ...],
            exact: ExactDistances, asked: Asked, checked: ExactDistances | None) -> DepthSensor:
    space = DepthSpace(source.pinhole, exact.points, capsules, section.region or asked.region,
                       margin=section.margin, thin=inf if section.thin is None else section.thin,
                       support=section.support, band=section.band, mean_within=asked.mean_within,
                       body=asked.body, tip=asked.tip, pairs=exact.measurement.pairs is not None)
    return DepthSensor(source, space, section.stale_after, section.least_readings, checked)


def _capsules(robot: Robot, foot: float) -> tuple[Capsule, ...]:
    if not robot.capsules:
        raise HierarchyError(f"robot {robot.name!r} has no capsules, which are needed to remove "
                             "it from the image")
    if foot == 0.0 or robot.base == "floating":
        return robot.capsules
    column = Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), robot.capsules[0].radius)
    return (column, *robot.capsules)
