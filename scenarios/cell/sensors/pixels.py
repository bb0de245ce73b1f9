"""Kernels of the depth space: which pixels are obstacles, and how far each point is from them.

`eye` (16,) is `Pinhole.packed`. In an obstacle image (h, w) a pixel is a depth [m] or 0; its
`tiles`, squares of TILE pixels, are the smallest depth in them, infinite where there is none.
Source: Flacco, Kroeger, De Luca, Khatib, "A depth space approach to human-robot collision
avoidance", ICRA 2012 (the letter's [8]); equation numbers are those of the letter.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance.laws import repulsion
from hierarchy.jit import compiled, internal
from hierarchy.kinematics import dot, place
from hierarchy.problem import Array
from scenarios.cell.sensors.rendering import in_camera, pixels_of_ball

TILE = 16  # pixels to a side


class ObstacleImage(NamedTuple):
    """Depths (h, w) [m] of the pixels that show an obstacle, 0 elsewhere; least depths of tiles."""

    depth: NDArray[np.float32]
    tiles: NDArray[np.float32]

    @staticmethod
    def empty(height: int, width: int) -> ObstacleImage:
        """Return an image without obstacles."""
        return ObstacleImage(np.zeros((height, width), np.float32),
                             np.full((-(-height // TILE), -(-width // TILE)), np.inf, np.float32))


class Space(NamedTuple):
    """What is measured, and how; see `DepthSpace`.

    joints (P,), offsets (P, 3) of the control points, the end effector last; region, thin [m]; mean
    (2,) is its mean_within; laws (2, 4) of `packed_laws`.
    """

    joints: NDArray[np.int64]
    offsets: Array
    eye: Array
    region: float
    thin: float
    mean: Array
    laws: Array


@compiled
def farthest(placements, joints, offsets, eye):
    """Return the depth [m] of the point that is farthest from the camera's plane."""
    most = 0.0
    for k in range(len(joints)):
        most = max(most, in_camera(eye, place(placements[joints[k]], offsets[k]))[2])
    return most


@compiled
def find_obstacles(reading, robot, support, band, beyond, depth, tiles):
    """Write the obstacle image of a reading into depth (h, w) and tiles; return how much was read.

    robot (h, w) is the depth at which the robot begins, margin included, infinite beside it;
    it is used up. A pixel there or behind is no obstacle, nor is one with which less than `support`
    pixels of the 3 x 3 around it, itself included, agree within `band` [m], nor one farther than
    `beyond` [m]. The share of pixels with a reading is returned.
    """
    height, width = reading.shape
    read = 0
    for v in range(height):
        for u in range(width):
            z = reading[v, u]
            if not (0.0 < z < np.inf):
                robot[v, u] = 0.0
                continue
            read += 1
            robot[v, u] = z if z < robot[v, u] and z <= beyond else 0.0
    tiles[:, :] = np.inf
    for v in range(height):
        for u in range(width):
            z = robot[v, u]
            if z > 0.0 and support > 1 and not _supported(robot, v, u, support, band):
                z = np.float32(0.0)
            depth[v, u] = z
            if z > 0.0 and z < tiles[v // TILE, u // TILE]:
                tiles[v // TILE, u // TILE] = z
    return read / (height * width)


@internal
def _supported(depth, v, u, support, band):
    agree = 0
    for j in range(max(v - 1, 0), min(v + 2, depth.shape[0])):
        for i in range(max(u - 1, 0), min(u + 2, depth.shape[1])):
            if depth[j, i] > 0.0 and abs(depth[j, i] - depth[v, u]) <= band:
                agree += 1
                if agree >= support:
                    return True
    return False


@compiled
def measure_pixels(placements, space, image, seen, pairs):
    """Fill the readings of a Measurement, and pairs (P, 1, 14), from an obstacle image.

    Returns the active control point.
    """
    count = len(space.joints)
    active, D_minimal = -1, np.inf
    for k in range(count):
        point = place(placements[space.joints[k]], space.offsets[k])
        seen.points[k, 0], seen.points[k, 1], seen.points[k, 2] = point
        which = 1 if k == count - 1 else 0
        D_min, at = _nearest(space, image, space.mean[which], point, seen.direction[k], pairs[k, 0])
        seen.nearest[k], seen.distance[k], pairs[k, 0, 0] = at, D_min, D_min
        law = space.laws[which]
        seen.magnitude[k] = repulsion(D_min, law[0], law[1], law[2],
                                      law[3]) if D_min < np.inf else 0.0  # (23)
        if k < count - 1 and D_min < D_minimal:  # (31)
            D_minimal, active = D_min, k
    return active


@compiled
def _nearest(space, image, mean, point, direction, pair):
    """Return the distance of a point, infinite beyond the region, and its pixel, -1 if none.

    Writes the directions away from what is near and from the nearest into direction and pair.
    """
    eye = space.eye
    c = in_camera(eye, point)
    DD, at, nearest, total = _search(space, image, mean, c)
    if at < 0:
        direction[0] = direction[1] = direction[2] = 0.0
        pair[1] = pair[2] = pair[3] = 0.0
        return np.inf, at
    D = sqrt(DD)
    norm = sqrt(dot(total, total))
    if D < c[2] * max(1.0 / eye[0], 1.0 / eye[1]):  # in the shadow of a pixel: its centre is void
        nearest = total if norm > 1e-6 else (1.0, 0.0, 0.0)
    _turn_unit_back(eye, nearest, pair[1:4])
    if mean > 0.0 and norm > 1e-6:
        _turn_unit_back(eye, total, direction)  # (26)
    else:
        direction[0], direction[1], direction[2] = pair[1], pair[2], pair[3]
    return D, at


@compiled
def _search(space, image, mean, c):
    """Return the smallest squared distance to c and its pixel; the vector from it; their mean.

    c and vectors are in the camera's frame; the mean is a sum of unit vectors.
    """
    eye, region, depth = space.eye, space.region, image.depth
    cx, cy, cz = c
    height, width = depth.shape
    u0, u1 = pixels_of_ball(eye[0], eye[2], width, cx, cz, region)
    v0, v1 = pixels_of_ball(eye[1], eye[3], height, cy, cz, region)
    per_x, per_y, reach = 1.0 / eye[0], 1.0 / eye[1], region * region
    averaged = mean * mean if mean > 0.0 else reach
    DD, at = reach, -1
    nx = ny = nz = sx = sy = sz = 0.0
    for tv in range(v0 // TILE, (v1 + TILE - 1) // TILE):
        for tu in range(u0 // TILE, (u1 + TILE - 1) // TILE):
            if image.tiles[tv, tu] >= cz + region:
                continue
            for v in range(max(v0, tv * TILE), min(v1, tv * TILE + TILE)):
                ry = (v - eye[3]) * per_y
                for u in range(max(u0, tu * TILE), min(u1, tu * TILE + TILE)):
                    d = float(depth[v, u])
                    if d == 0.0:
                        continue
                    if d < cz:  # it shadows what is behind it
                        d = min(d + space.thin, cz)
                    ox, oy, oz = cx - (u - eye[2]) * per_x * d, cy - ry * d, cz - d
                    oo = ox * ox + oy * oy + oz * oz
                    if oo >= reach:
                        continue
                    if oo < DD:  # (22)
                        DD, at, nx, ny, nz = oo, v * width + u, ox, oy, oz
                    if 0.0 < oo < averaged:  # (25); the factor 1/h is lost in (26)
                        per = 1.0 / sqrt(oo)
                        sx, sy, sz = sx + per * ox, sy + per * oy, sz + per * oz
    return DD, at, (nx, ny, nz), (sx, sy, sz)


@internal
def _turn_unit_back(eye, vector, out):
    """Write the unit vector along one in the camera's frame into out (3,), in the world's."""
    length = sqrt(dot(vector, vector))
    for i in range(3):
        out[i] = dot(eye[7 + 3 * i:], vector) / length
