"""Distances of control points to obstacles in a depth image, evaluated in image space."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from hierarchy import HierarchyError
from hierarchy.avoidance import Capsule, ControlPoint, Measurement, Pairs, Repulsion
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

NO_LAWS = np.array([[0.0, 1.0, 1.0, 1.0]] * 2)  # r_max = 0
_ON_ITS_WAY = 0.3  # [m]


class DepthSpace:
    """Turns depth images into obstacle images, and measures distances of points in them.

    points : control points, the end effector last.
    capsules : the robot, enlarged by `margin` [m]; pixels that show it or anything behind it do not
        count as obstacles.
    region : rho [m], the largest distance that is measured.
    thin : how far obstacles extend behind their surface along the optical axis [m]. Space hidden by
        an obstacle counts as occupied up to that depth.
    support, band : a pixel counts if `support` of the 3 x 3 around it agree within `band` [m] in
        depth, which removes outliers, but also surfaces that are smaller or steeper.
    mean_within : distances [m], for control points and end effector, within which the direction is
        the mean (25)-(26) over all pixels of the region; with 0 it is that of the nearest pixel,
        except for a point in the shadow of its own pixel.
    body, tip : repulsion laws. `measurement.nearest` is a pixel v width + u, -1 for none.
    """

    def __init__(self, pinhole: Pinhole, points: Sequence[ControlPoint],
                 capsules: Sequence[Capsule], region: float, *, margin: float = 0.05,
                 thin: float = inf, support: int = 3, band: float = 0.05,
                 mean_within: tuple[float, float] = (inf, inf),
                 body: Repulsion | None = None, tip: Repulsion | None = None,
                 pairs: bool = False) -> None:
        for name, value, least in (("region", region, 1e-9), ("margin", margin, 0.0),
                                   ("thin", thin, 0.0), ("band", band, 0.0)):
            if not value >= least or (name != "thin" and value == inf):
                raise HierarchyError(f"depth space: {name} = {value} m is out of range")
        if not 1 <= support <= 9:
            raise HierarchyError(f"depth space: support = {support} is not in 1 .. 9 pixels")
        self.pinhole, self.points, self.region = pinhole, tuple(points), region
        self.measurement = Measurement(len(points) - 1)
        self._pairs = Pairs(len(points), 1)
        if pairs:
            self.measurement.pairs = self._pairs
        self._eye, self._margin = pinhole.packed(), margin
        self._support, self._band = support, band
        self._links, self._capsules = pack_capsules(capsules)
        self._space = Space(*pack_points(points), self._eye, region, thin, np.array(mean_within),
                            laws(body, tip) if body and tip else NO_LAWS)
        self._image: ObstacleImage | None = None
        self._placements: Array | None = None
        self._robot = ObstacleImage.empty(pinhole.height, pinhole.width).depth

    def find_obstacles(self, reading: Image, placements: Array, into: ObstacleImage) -> float:
        """Fill an obstacle image from a reading (h, w) [m] and the robot's placements then.

        Pixels beyond the region of every point, even if the robot moves by _ON_ITS_WAY until the
        next frame, are ignored. Returns the share of valid pixels, which are neither 0 nor NaN.
        """
        draw_robot(self._robot, self._eye, placements, self._links, self._capsules, self._margin)
        beyond = farthest(placements, self._space.joints, self._space.offsets, self._eye)
        return float(find_obstacles(reading, self._robot, self._support, self._band,
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
