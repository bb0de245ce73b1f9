"""Measurements of one tick: distances, directions and magnitudes of repulsion; and of all pairs."""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from hierarchy.avoidance.laws import repulsion
from hierarchy.avoidance.obstacles import Obstacles, distance_to_obstacle, turning_off_obstacle
from hierarchy.errors import expect, refuse, whole
from hierarchy.gate import shaped
from hierarchy.jit import compiled
from hierarchy.kinematics import Readings, dot, place, plus
from hierarchy.problem import Array
from hierarchy.records import NotNegative, check_fields


@dataclass(frozen=True)
class SurveillanceAreas:
    """Danger thresholds [m]: eps_1 = near, eps_2 = far of the body, eps_ee = end_effector."""

    near: NotNegative
    far: NotNegative
    end_effector: NotNegative

    def __post_init__(self) -> None:
        check_fields(self, "surveillance areas")
        refuse(self.near > self.far, "surveillance areas need near <= far, got near = "
               f"{self.near} m, far = {self.far} m")


class Measurement:
    """Distances of K control points, and of the end effector as entry K, to the obstacles.

    points (K + 1, 3) [m]; distance (K + 1,) [m] to the nearest obstacle, eq. (22), infinite when
    there is none; direction (K + 1, 3) unit vector away from it; magnitude (K + 1,) of the
    repulsion, eq. (23); nearest (K + 1,) index of that obstacle or -1; `arrays` has all of these
    and `active` for the kernels. `pairs` has every point against every obstacle, or is None if it
    is not measured; it remains the same object. `stamp` is the time [s] of the data, infinite for
    now. A sensor is `blind` when its last new data are too old to be used.
    """

    __slots__ = ("arrays", "blind", "direction", "distance", "magnitude", "nearest",
                 "pairs", "points", "stamp")

    def __init__(self, control_points: int) -> None:
        size = whole("Measurement: control_points", control_points) + 1
        self.points, self.direction = np.zeros((size, 3)), np.zeros((size, 3))
        self.distance, self.magnitude = np.full(size, inf), np.zeros(size)
        self.nearest = np.full(size, -1, dtype=np.int64)
        self.arrays = Readings(self.points, self.distance, self.direction, self.magnitude,
                           self.nearest, np.array([-1]))
        self.pairs: Pairs | None = None
        self.stamp, self.blind = inf, False

    @property
    def active(self) -> int:
        """The control point of eq. (31), the first with the smallest distance, or -1."""
        return self.arrays.active.item()

    @active.setter
    def active(self, index: int) -> None:
        self.arrays.active[0] = whole("Measurement: active", index, -1, len(self.distance) - 2)

    @property
    def minimal_distance(self) -> float:
        """D_minimal [m] of eq. (31): the smallest distance of a control point of the body."""
        active = self.active
        return float(self.distance.item(active)) if active >= 0 else inf

    @property
    def end_effector_distance(self) -> float:
        """D_min [m] of the end effector, eq. (22)."""
        return float(self.distance.item(-1))


@compiled
def measure_exactly(placements, joints, offsets, obstacles, laws, mean_within, seen):
    """Fill the arrays `seen` of a Measurement from known geometry.

    placements (joints + 1, 12) of a State; joints (K + 1,), offsets (K + 1, 3) of the control
    points and the end effector; obstacles (H, 16) a table of `Obstacles`; laws (2, 4) those of the
    body and of the end effector, see `Repulsion.packed`. The direction is that of the nearest
    obstacle, or the mean (25)-(26) over the obstacles nearer than `mean_within` (2,) [m], for
    control points and end effector, if there are any.
    """
    points, distance, direction, magnitude, nearest, chosen = seen
    count = len(joints)
    active, D_minimal = -1, np.inf
    for k in range(count):
        point = place(placements[joints[k]], offsets[k])
        points[k, 0], points[k, 1], points[k, 2] = point
        of = 1 if k == count - 1 else 0
        D_min, at, away, total = np.inf, -1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for j in range(obstacles.shape[0]):
            D, u = distance_to_obstacle(obstacles[j], point)
            if D < D_min:  # (22)
                D_min, at, away = D, j, u
            if D < mean_within[of]:  # (25); the factor 1/h cancels in (26)
                total = plus(total, u)
        distance[k], nearest[k], magnitude[k] = D_min, at, 0.0
        if at >= 0:
            magnitude[k] = repulsion(max(D_min, 0.0), laws[of, 0], laws[of, 1], laws[of, 2],
                                     laws[of, 3])  # (23)
        norm = sqrt(dot(total, total))
        if norm > 1e-6:  # else the unit vectors cancel, or none is within
            away = (total[0] / norm, total[1] / norm, total[2] / norm)  # (26)
        direction[k, 0], direction[k, 1], direction[k, 2] = away
        if k < count - 1 and D_min < D_minimal:  # (31)
            D_minimal, active = D_min, k
    chosen[0] = active


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
        self.__setstate__(np.zeros((whole("pairs: points", points),
                                    whole("pairs: obstacles", obstacles), 14)))
        self.distance[:] = self.radius[:] = inf

    def __getstate__(self) -> Array:
        return self.table

    def __setstate__(self, table: Array) -> None:
        self.table = table
        self.distance, self.radius = table[..., 0], table[..., 13]
        self.direction, self.velocity = table[..., 1:4], table[..., 4:7]
        self.acceleration, self.straight = table[..., 7:10], table[..., 10:13]


def measure_pairs(pairs: Pairs, points: Array, obstacles: Obstacles) -> None:
    """Fill Pairs from known geometry: points (P, 3) [m] against the current obstacles (H)."""
    expect("measure_pairs: pairs", pairs, Pairs, "make them with Pairs(points, obstacles)")
    expect("measure_pairs: obstacles", obstacles, Obstacles, "make them with Obstacles([...])")
    points = shaped("measure_pairs: points", points, (len(pairs.table), 3))
    refuse(len(obstacles) != pairs.table.shape[1], f"measure_pairs: {len(obstacles)} obstacles, "
           f"and pairs of {pairs.table.shape[1]}")
    _measure_pairs(points, obstacles.table, obstacles.motion, pairs.table)


@compiled
def _measure_pairs(points, obstacles, motion, table):
    for k in range(table.shape[0]):
        for j in range(table.shape[1]):
            pair = table[k, j]
            pair[0], r = distance_to_obstacle(obstacles[j], points[k])
            pair[1], pair[2], pair[3] = r
            for i in range(6):
                pair[4 + i] = motion[j, i]
            pair[13], straight = turning_off_obstacle(obstacles[j], points[k], pair[0])
            pair[10], pair[11], pair[12] = straight
