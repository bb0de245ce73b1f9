"""Distances of control points to what a depth image shows, evaluated in the image itself."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from hierarchy import HierarchyError
from hierarchy.avoidance import Capsule, ControlPoint, Measurement, Pairs, Repulsion
from hierarchy.avoidance.control_points import pack_points
from hierarchy.avoidance.repulsion import laws
from hierarchy.avoidance.self_collision import pack_capsules
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole
from scenarios.cell.sensors.errors import Image
from scenarios.cell.sensors.pixels import TILE, farthest, find_obstacles, measure_pixels
from scenarios.cell.sensors.rendering import draw_robot

NO_LAWS = np.array([[0.0, 1.0, 1.0, 1.0]] * 2)  # r_max = 0
_ON_ITS_WAY = 0.3  # [m]


class ObstacleImage:
    """Depths (h, w) [m] of the pixels that show an obstacle, 0 of all others."""

    __slots__ = ("depth", "tiles")

    def __init__(self, pinhole: Pinhole) -> None:
        self.depth = np.zeros((pinhole.height, pinhole.width), np.float32)
        self.tiles = np.full((-(-pinhole.height // TILE), -(-pinhole.width // TILE)), inf,
                             np.float32)


class DepthSpace:
    """Turns depth images into obstacle images, and measures points in those.

    `points` are the control points, the end effector last; `capsules` the robot, which is taken
    out: a pixel that shows the robot made thicker by `margin` [m], or what is behind it, is no
    obstacle. `region` [m] is rho, beyond which nothing is seen. An obstacle nearer to the camera
    than a point hides what is behind it, which may be occupied: it counts at the depth of the
    point. With `thin` [m] obstacles are known to reach no farther than that behind their surface,
    along the optical axis.

    With `support` > 1 a pixel counts only where so many of the 3 x 3 around it, itself included,
    agree within `band` [m] in depth; single outliers then have no effect. A surface that shows in
    fewer pixels is overlooked, and so is one so slanted that neighbours differ by more.

    With `mean` the direction of a point is the mean (25)-(26) over all pixels in the region, else
    that from the nearest pixel; where the nearest is that of the point itself, which lies in its
    shadow, the mean is taken in any case. `body` and `tip` are the laws of repulsion.

    The distance to a surface that is seen (inside the image and the camera's range, not hidden,
    turned from the ray by less than some 70 deg, nor taken out as the robot or for lack of support)
    is never overestimated by more than the error of its reading along its ray and one pixel, see
    `overestimate`; a pixel without a reading costs one more. Hidden space is taken as occupied, so
    underestimates have no such bound; that of the nearest of many noisy pixels is too small on
    average. What is outside the image is not seen.

    `measurement.nearest` is the nearest pixel v width + u, -1 for none.
    """

    def __init__(self, pinhole: Pinhole, points: Sequence[ControlPoint],
                 capsules: Sequence[Capsule], region: float, *, margin: float = 0.05,
                 thin: float = inf, support: int = 3, band: float = 0.05, mean: bool = True,
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
        self._thin, self._mean = thin, mean
        self._joints, self._offsets = pack_points(points)
        self._links, self._capsules = pack_capsules(capsules)
        self._laws = laws(body, tip) if body and tip else NO_LAWS
        self._robot = ObstacleImage(pinhole).depth

    def find_obstacles(self, reading: Image, placements: Array, into: ObstacleImage) -> float:
        """Fill an obstacle image from a reading (h, w) [m] and the robot's placements then.

        What is farther than any point of the robot can be interested in, also if it moves by
        _ON_ITS_WAY until the next frame, is left out. Returns the share of the pixels that have a
        reading: neither 0 nor NaN.
        """
        draw_robot(self._robot, self._eye, placements, self._links, self._capsules, self._margin)
        beyond = farthest(placements, self._joints, self._offsets, self._eye)
        return float(find_obstacles(reading, self._robot, self._support, self._band,
                                    beyond + self.region + _ON_ITS_WAY, into.depth, into.tiles))

    def measure(self, obstacles: ObstacleImage, placements: Array) -> Measurement:
        """Measure the points of the robot where it is now; valid until the next call."""
        seen = self.measurement
        seen.active = measure_pixels(
            placements, self._joints, self._offsets, self._eye, obstacles.depth, obstacles.tiles,
            self.region, self._thin, self._mean, self._laws, seen.points, seen.distance,
            seen.direction, seen.magnitude, seen.nearest, self._pairs.table)
        return seen

    def overestimate(self, point: Array, error: float) -> float:
        """The most [m] by which a distance to the surface at `point` (3,) [m] is overestimated.

        `error` [m] is that of its reading, see `DepthErrors.bound`.
        """
        depth = float(self.pinhole.project(point)[2])
        along = np.linalg.norm(point - np.asarray(self.pinhole.position, dtype=float)) / depth
        pixel = depth * float(np.hypot(1.0 / self.pinhole.fx, 1.0 / self.pinhole.fy))
        return float(along * (error + pixel))
