"""Distances of every point to every obstacle, for tasks with one row per pair."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy.avoidance.obstacles import Obstacles, distance_to_obstacle, turning_off_obstacle
from hierarchy.jit import compiled
from hierarchy.problem import Array

# Columns of the table.
_DISTANCE, _DIRECTION, _VELOCITY, _ACCELERATION = 0, slice(1, 4), slice(4, 7), slice(7, 10)
_STRAIGHT, _RADIUS, _WIDTH = slice(10, 13), 13, 14


class Pairs:
    """P points of the robot against H obstacles.

    distance (P, H) [m], negative inside, infinite where nothing is measured; direction (P, H, 3)
    unit vector away from the obstacle; velocity, acceleration (P, H, 3) of the obstacle, zero where
    unknown. radius (P, H) [m] and straight (P, H, 3) describe how the direction turns when the
    point moves across it: at the speed divided by the radius, but not along the unit vector
    `straight`; where the radius is unknown, an infinite one (a flat face) is conservative.

    All are views of `table` (P, H, 14), which the kernels take. A sensor that measures surfaces and
    not obstacles has H = 1: the nearest point of a surface.
    """

    __slots__ = ("acceleration", "direction", "distance", "radius", "straight", "table", "velocity")

    def __init__(self, points: int, obstacles: int) -> None:
        self.table = np.zeros((points, obstacles, _WIDTH))
        self.distance, self.direction = self.table[..., _DISTANCE], self.table[..., _DIRECTION]
        self.velocity = self.table[..., _VELOCITY]
        self.acceleration = self.table[..., _ACCELERATION]
        self.radius, self.straight = self.table[..., _RADIUS], self.table[..., _STRAIGHT]
        self.distance[:] = self.radius[:] = inf


def measure_pairs(pairs: Pairs, points: Array, obstacles: Obstacles) -> None:
    """Fill Pairs from known geometry: points (P, 3) [m] against the current obstacles."""
    _measure(points, obstacles.table, obstacles.motion, pairs.table)


@compiled
def _measure(points, obstacles, motion, table):
    for k in range(table.shape[0]):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for j in range(table.shape[1]):
            pair = table[k, j]
            pair[0] = distance_to_obstacle(obstacles[j], x, y, z, pair[1:4])
            for i in range(6):
                pair[4 + i] = motion[j, i]
            pair[13] = turning_off_obstacle(obstacles[j], x, y, z, pair[0], pair[10:13])
