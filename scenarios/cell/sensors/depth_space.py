"""Distances of control points to obstacles in a depth image, evaluated in image space."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from hierarchy.avoidance import Capsule, ControlPoint, Measurement, Pairs
from hierarchy.avoidance.control_points import pack_points
from hierarchy.avoidance.repulsion import laws
from hierarchy.avoidance.self_collision import pack_capsules
from hierarchy.jit import bind
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole
from scenarios.cell.sensors.errors import Image
from scenarios.cell.sensors.pixels import (
    ObstacleImage,
    Space,
    farthest,
    find_obstacles,
    measure_pixels,
)
from scenarios.cell.sensors.rendering import draw_robot
from scenarios.cell.sensors.sensor import Asked
from scenarios.config.kinds.camera import ImageSection

NO_LAWS = np.array([[0.0, 1.0, 1.0, 1.0]] * 2)  # r_max = 0
_ON_ITS_WAY = 0.3  # [m]


class DepthSpace:
    """Turns depth images into obstacle images, and measures distances of points in them.

    section : its `region` is rho [m], the largest distance that is measured. Space hidden by an
        obstacle counts as occupied up to `thin` [m] behind its surface. `support` removes
        outliers, but also surfaces that are smaller or steeper.
    points : control points, the end effector last.
    capsules : the robot; pixels that show it or anything behind it do not count as obstacles.
    asked : the direction is the mean (25)-(26) over all pixels of the region within `mean_within`
        [m]; with 0 it is that of the nearest pixel, except for a point in the shadow of its own.

    `measurement.nearest` is a pixel v width + u, -1 for none.
    """

    def __init__(self, section: ImageSection, pinhole: Pinhole, points: Sequence[ControlPoint],
                 capsules: Sequence[Capsule], asked: Asked, pairs: bool = False) -> None:
        self.pinhole, self.points = pinhole, tuple(points)
        self.region = section.region or asked.region
        self.measurement = Measurement(len(points) - 1)
        self._pairs = Pairs(len(points), 1)
        if pairs:
            self.measurement.pairs = self._pairs
        self._eye, self._section = pinhole.packed(), section
        self._links, self._capsules = pack_capsules(capsules)
        self._space = Space(*pack_points(points), self._eye, self.region,
                            inf if section.thin is None else section.thin,
                            np.array(asked.mean_within),
                            laws(asked.body, asked.tip) if asked.body and asked.tip else NO_LAWS)
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
        beyond = farthest(placements, self._space.joints, self._space.offsets, self._eye)
        return float(find_obstacles(reading, self._robot, section.support, section.band,
                                    beyond + self.region + _ON_ITS_WAY, into.depth, into.tiles))

    def measure(self, obstacles: ObstacleImage, placements: Array) -> Measurement:
        """Measure the points of the robot at its current placements; valid until the next call."""
        seen = self.measurement
        if obstacles is not self._image or placements is not self._placements:
            self._image, self._placements = obstacles, placements
            self._measure = bind(measure_pixels, placements, self._space, obstacles, seen.arrays,
                                 self._pairs.table)
        seen.active = self._measure()
        return seen
