"""The depth sensors of [sensor]: a camera or recorded frames in the loop, and their distances."""

from collections import deque
from collections.abc import Sequence
from math import inf
from time import perf_counter

import numpy as np

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule, Measurement, Pairs
from hierarchy.avoidance.body import pack_capsules, pack_points
from hierarchy.jit import bind
from hierarchy.problem import Array
from scenarios.cell.robot import on_column
from scenarios.cell.sensors import pixels
from scenarios.cell.sensors.camera import DepthCamera, Image, Pinhole, RecordedFrames, looking_at
from scenarios.cell.sensors.pixels import ObstacleImage, Space
from scenarios.cell.sensors.rendering import draw_robot
from scenarios.cell.sensors.sensor import ExactDistances
from scenarios.config.sections.sensor import CameraSection, FramesSection, ImageSection

_ON_ITS_WAY = 0.3  # [m]
_ROUNDING = 1e-9   # [s] of times that are compared


Source = DepthCamera | RecordedFrames


class DepthSpace:
    """Turns depth images into obstacle images, and measures distances of points in them.

    section : its `region` is rho [m], the largest distance that is measured, by default `reach`.
        Space hidden by an obstacle counts as occupied up to `thin` [m] behind its surface.
        `support` removes outliers, but also surfaces that are smaller or steeper.
    exact : measures the same points. The direction is the mean (25)-(26) over all pixels of the
        region within its `mean_within` [m]; with 0 it is that of the nearest pixel, except for a
        point in the shadow of its own.
    capsules : the robot; pixels that show it or anything behind it do not count as obstacles.

    `measurement.nearest` is a pixel v width + u, -1 for none.
    """

    def __init__(self, section: ImageSection, pinhole: Pinhole, exact: ExactDistances,
                 capsules: Sequence[Capsule], reach: float) -> None:
        self.pinhole = pinhole
        self.region = section.region or reach
        self.measurement = Measurement(len(exact.points) - 1)
        self._pairs = Pairs(len(exact.points), 1)
        if exact.measurement.pairs is not None:
            self.measurement.pairs = self._pairs
        self._eye, self._section = pinhole.packed(), section
        self._links, self._capsules = pack_capsules(capsules)
        self._space = Space(*pack_points(exact.points), self._eye, self.region,
                            inf if section.thin is None else section.thin,
                            exact.mean_within, exact.laws)
        self._image: ObstacleImage | None = None
        self._placements: Array | None = None
        self._robot = ObstacleImage.empty(pinhole.height, pinhole.width).depth

    def find_obstacles(self, reading: Image, placements: Array, into: ObstacleImage) -> float:
        """Fill an obstacle image from a reading (h, w) [m] and the robot's placements then.

        Pixels beyond the region of every point, even if the robot moves by _ON_ITS_WAY until the
        next frame, are ignored. Returns the share of valid pixels, which are neither 0 nor NaN.
        """
        section = self._section
        draw_robot(self._robot, self._eye, placements, self._links, self._capsules, section.margin)
        beyond = pixels.farthest(placements, self._space.joints, self._space.offsets, self._eye)
        return float(pixels.find_obstacles(
            reading, self._robot, section.support, section.band,
            beyond + self.region + _ON_ITS_WAY, into.depth, into.tiles))

    def measure(self, obstacles: ObstacleImage, placements: Array) -> Measurement:
        """Measure the points of the robot at its current placements; valid until the next call."""
        seen = self.measurement
        if obstacles is not self._image or placements is not self._placements:
            self._image, self._placements = obstacles, placements
            self._measure = bind(pixels.measure_pixels, placements, self._space, obstacles,
                                 seen.arrays, self._pairs.table)
        seen.active = self._measure()
        return seen


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

    _frame: int   # of the source, newest that was taken
    _now: float  # [s]

    def __init__(self, section: ImageSection, source: Source, space: DepthSpace) -> None:
        self.source, self.space = source, space
        self.stale_after, self.least_readings = section.stale_after, section.least_readings
        self.measurement, self.obstacles = space.measurement, source.obstacles
        self.reading: Image | None = None
        self.stopped = self.covered = False
        self.outside = 0.0
        self._coming: deque[tuple[float, ObstacleImage]] = deque()
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
            seen.stamp, self._current = self._coming.popleft()
        seen.blind = t - seen.stamp > self.stale_after + _ROUNDING
        self.space.measure(self._current, state.placements)
        state.measurement = seen
        return seen

    def follow(self, before: "DepthSensor") -> None:
        """Continue with the frames of another sensor with the same section."""
        self._coming, self._current = before._coming, before._current
        self._frame, self._now, self.reading = before._frame, before._now, before.reading
        self.measurement.stamp, self.measurement.blind = (
            before.measurement.stamp, before.measurement.blind)

    def _take(self, frame: int, state: State) -> None:
        if self.stopped:
            return
        begin = perf_counter()
        self.reading, placements = self.source.image(frame, state)
        self.outside = perf_counter() - begin
        if self.covered:
            self.reading[:] = 0.0
        image = self._empty()
        read = self.space.find_obstacles(self.reading, placements, image)
        if read >= self.least_readings and read > 0.0:
            self._coming.append((state.t, image))

    def _empty(self) -> ObstacleImage:
        pinhole = self.space.pinhole
        return ObstacleImage.empty(pinhole.height, pinhole.width)

    def _forget(self) -> None:
        """Reset: no frame has been taken."""
        self._coming.clear()
        self._current, self._frame, self._now = self._empty(), -1, -inf
        self.measurement.stamp, self.measurement.blind = -inf, True


def depth_sensor(section: CameraSection | FramesSection, robot: Robot, exact: ExactDistances,
                 reach: float) -> DepthSensor:
    """Make the sensor of a simulated camera or of recorded frames, for the points of `exact`."""
    if not robot.capsules:
        raise HierarchyError(f"robot {robot.name!r} has no capsules, which are needed to remove "
                             "it from the image")
    capsules = on_column(robot, robot.capsules, section.foot)
    source: Source
    if isinstance(section, CameraSection):
        rotation = (looking_at(section.position, section.look_at) if section.rotation is None
                    else np.array(section.rotation))
        pinhole = Pinhole(section.width, section.height, section.fx, section.fy, section.cx,
                          section.cy, section.position, rotation)
        source = DepthCamera(section, pinhole, exact.obstacles, capsules)
    else:
        source = RecordedFrames(section.folder, robot, section.latency)
    return DepthSensor(section, source, DepthSpace(section, source.pinhole, exact, capsules, reach))
