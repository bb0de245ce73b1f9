"""The depth sensors of [sensor]: a camera or recorded frames in the loop, late or missing."""

from __future__ import annotations

from collections import deque
from math import inf
from time import perf_counter
from typing import Protocol

import numpy as np

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule, ControlPoint, Measurement, Obstacles
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import DepthCamera, Pinhole, looking_at
from scenarios.cell.sensors.depth_space import DepthSpace
from scenarios.cell.sensors.errors import Image
from scenarios.cell.sensors.frames import RecordedFrames
from scenarios.cell.sensors.pixels import ObstacleImage
from scenarios.cell.sensors.sensor import Asked, ExactDistances
from scenarios.config.kinds.camera import CameraSection, FramesSection, ImageSection

_ROUNDING = 1e-9  # [s] of times that are compared


class Source(Protocol):
    """A source of depth images: `DepthCamera` or `RecordedFrames`."""

    pinhole: Pinhole
    obstacles: Obstacles
    latency: float

    def newest(self, t: float) -> int:
        """Return the number of the last frame taken by time t [s], -1 before the first."""

    def image(self, frame: int, state: State) -> tuple[Image, Array]:
        """Return the image (h, w) [m] of a frame and the robot's placements when it was taken."""


class DepthSensor:
    """Measures control points and end effector in the latest available depth image.

    A frame is taken in the first tick at or after its time, with the robot's current state, and is
    used from `source.latency` [s] later until the next frame is available; meanwhile the points
    move with the robot. Frames with fewer valid pixels than the share `least_readings` are ignored.

    `measurement.stamp` is the time [s] at which the current image was taken, -inf before the first;
    `measurement.blind` is set if that is more than `stale_after` [s] ago, and the controller then
    treats the tick as stale. Distances are those of the last image, infinite without one. Faults
    set `stopped` (no frames are taken) and `covered` (frames have no readings). `outside` [s] is
    the time the source took to make the image, which is not part of the control loop.
    """

    def __init__(self, section: ImageSection, source: Source, space: DepthSpace,
                 exact: ExactDistances | None = None) -> None:
        self.source, self.space = source, space
        self.stale_after, self.least_readings = section.stale_after, section.least_readings
        self.points: tuple[ControlPoint, ...] = space.points
        self.measurement, self.obstacles = space.measurement, source.obstacles
        self.reading: Image | None = None
        self.stopped = self.covered = False
        self.outside = 0.0
        self._exact = exact
        self._nothing = self._current = self._empty()
        self._spare: list[ObstacleImage] = []
        self._coming: deque[tuple[float, ObstacleImage]] = deque()
        self._frame, self._now = -1, -inf
        self._forget()

    def measure(self, state: State) -> Measurement:
        """Measure at a state and attach the measurement to it; valid until the next call."""
        t, seen = state.t, self.measurement
        self.outside = 0.0
        if t < self._now:
            self._forget()
        self._now = t
        frame = self.source.newest(t)
        if frame > self._frame:
            self._frame = frame
            self._take(frame, state)
        while self._coming and t - self._coming[0][0] >= self.source.latency - _ROUNDING:
            self._keep(self._current)
            seen.stamp, self._current = self._coming.popleft()
        seen.blind = t - seen.stamp > self.stale_after + _ROUNDING
        self.space.measure(self._current, state.placements)
        state.measurement = seen
        return seen

    def check_start(self, state: State) -> None:
        """Raise a HierarchyError if an obstacle of a simulated scene touches a point."""
        if self._exact is not None:
            self._exact.check_start(state)

    def _take(self, frame: int, state: State) -> None:
        if self.stopped:
            return
        begin = perf_counter()
        self.reading, placements = self.source.image(frame, state)
        self.outside = perf_counter() - begin
        if self.covered:
            self.reading[:] = 0.0
        image = self._spare.pop() if self._spare else self._empty()
        read = self.space.find_obstacles(self.reading, placements, image)
        if read < self.least_readings or read == 0.0:
            self._keep(image)
        else:
            self._coming.append((state.t, image))

    def _empty(self) -> ObstacleImage:
        pinhole = self.space.pinhole
        return ObstacleImage.empty(pinhole.height, pinhole.width)

    def _keep(self, image: ObstacleImage) -> None:
        if image is not self._nothing:
            self._spare.append(image)

    def _forget(self) -> None:
        """Reset: no frame has been taken."""
        self._keep(self._current)
        for _, image in self._coming:
            self._keep(image)
        self._coming.clear()
        self._current, self._frame, self._now = self._nothing, -1, -inf
        self.measurement.stamp, self.measurement.blind = -inf, True


def camera(section: CameraSection, robot: Robot, exact: ExactDistances,
           asked: Asked) -> DepthSensor:
    """Make the sensor of a simulated camera, for the points that `exact` measures."""
    rotation = (looking_at(section.position, section.look_at) if section.rotation is None
                else np.array(section.rotation))
    pinhole = Pinhole(section.width, section.height, section.fx, section.fy, section.cx,
                      section.cy, section.position, rotation)
    capsules = _capsules(robot, section.foot)
    source = DepthCamera(section, pinhole, exact.obstacles, capsules)
    return _sensor(section, source, capsules, exact, asked, exact)


def frames(section: FramesSection, robot: Robot, exact: ExactDistances,
           asked: Asked) -> DepthSensor:
    """Make the sensor of recorded frames, which cannot be checked for obstacles at the start."""
    capsules = _capsules(robot, section.foot)
    source = RecordedFrames(section.folder, robot, section.latency)
    return _sensor(section, source, capsules, exact, asked, None)


def _sensor(section: ImageSection, source: Source, capsules: tuple[Capsule, ...],
            exact: ExactDistances, asked: Asked, checked: ExactDistances | None) -> DepthSensor:
    space = DepthSpace(section, source.pinhole, exact.points, capsules, asked,
                       exact.measurement.pairs is not None)
    return DepthSensor(section, source, space, checked)


def _capsules(robot: Robot, foot: float) -> tuple[Capsule, ...]:
    if not robot.capsules:
        raise HierarchyError(f"robot {robot.name!r} has no capsules, which are needed to remove "
                             "it from the image")
    if foot == 0.0 or robot.base == "floating":
        return robot.capsules
    column = Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), robot.capsules[0].radius)
    return (column, *robot.capsules)
