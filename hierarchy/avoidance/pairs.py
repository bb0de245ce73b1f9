"""Every point against every obstacle: what rows that hold for all of them need."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy.avoidance.obstacles import Obstacles, distance_to_obstacle
from hierarchy.compiled import compiled
from hierarchy.problem import Array

_WIDTH = 6  # distance, direction, speed, acceleration


class Pairs:
    """P points of the robot against H obstacles.

    distance (P, H) [m], negative inside, infinite where nothing is seen; direction (P, H, 3) unit
    vector away from the obstacle; speed (P, H) [m/s] and acceleration (P, H) [m/s^2] of the
    obstacle along that direction, zero where they are not known. All are views of `table`
    (P, H, 6), which kernels take. A sensor that sees surfaces and not obstacles has H = 1: what is
    nearest to each point.
    """

    __slots__ = ("acceleration", "direction", "distance", "speed", "table")

    def __init__(self, points: int, obstacles: int) -> None:
        self.table = np.zeros((points, obstacles, _WIDTH))
        self.distance, self.direction = self.table[..., 0], self.table[..., 1:4]
        self.speed, self.acceleration = self.table[..., 4], self.table[..., 5]
        self.distance[:] = inf


def measure_pairs(pairs: Pairs, points: Array, obstacles: Obstacles) -> None:
    """Fill Pairs from known geometry: points (P, 3) [m] against obstacles where they are now."""
    _measure(points, obstacles.table, obstacles.motion, pairs.table)


@compiled
def _measure(points, obstacles, motion, table):
    for k in range(table.shape[0]):
        for j in range(table.shape[1]):
            pair, moves = table[k, j], motion[j]
            r = pair[1:4]
            pair[0] = distance_to_obstacle(obstacles[j], points[k, 0], points[k, 1], points[k, 2],
                                           r)
            pair[4] = r[0] * moves[0] + r[1] * moves[1] + r[2] * moves[2]
            pair[5] = r[0] * moves[3] + r[1] * moves[4] + r[2] * moves[5]
