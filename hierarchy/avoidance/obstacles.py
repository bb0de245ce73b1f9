"""Obstacles: points, spheres, capsules and boxes, at rest or moving on a path."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import check_name, expect, expect_each, finite_numbers, refuse, whole
from hierarchy.gate import Rotation, array_of
from hierarchy.jit import inlined, internal
from hierarchy.kinematics import dot, less, turned
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.records import Vector3, check_fields

# One obstacle is one row of the packed table: a box of half lengths, which may be zero, and thicker
# by a radius; its centre and rotation.
SHAPES = {"point": 0, "sphere": 1, "capsule": 2, "box": 3}  # how many sizes each has
_WIDTH = 1 + 3 + 3 + 9
_CENTRE = slice(4, 7)


@dataclass(frozen=True)
class Obstacle:
    """One convex obstacle.

    shape : "point", "sphere" (size = (radius,)), "capsule" (size = (radius, half length along its
        z axis)) or "box" (size = three half lengths), all [m].
    centre : (3,) [m] in the world; with `path`, the path's position is the centre instead.
    rotation : (3, 3) of its axes in the world.
    """

    shape: str
    centre: Vector3
    size: tuple[float, ...] = ()
    rotation: Rotation = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    path: Path | None = None
    name: str = "obstacle"

    def __post_init__(self) -> None:
        check_name("obstacle shape", self.shape, SHAPES)
        expected, size = SHAPES[self.shape], array_of(f"{self.name}: size", self.size)
        refuse(size.shape != (expected,) or not ((size > 0.0) & (size < inf)).all(),
               f"{self.name}: a {self.shape} takes {expected} positive size(s), got "
               f"{size.tolist()}")
        check_fields(self, self.name)
        if self.path is not None:
            expect(f"{self.name}: path", self.path, Path, "see hierarchy.paths")

    def packed(self) -> Array:
        """The obstacle as one row (16,) of the table for the kernels."""
        radius, half = (*self.size, 0.0, 0.0)[:2]
        size = (0.0, *self.size) if self.shape == "box" else (radius, 0.0, 0.0, half)
        return np.array([*size, *self.centre, *np.asarray(self.rotation, dtype=float).ravel()])


class Obstacles:
    """All obstacles of a scene as one table (H, 16) that is updated with time.

    `motion` (H, 6) has the velocity [m/s] and acceleration [m/s^2] of each centre; `offset` (H, 3)
    [m] is the displacement of each by `shift`.
    """

    def __init__(self, obstacles: Sequence[Obstacle] = ()) -> None:
        expect_each("obstacles", obstacles, Obstacle, "make one with Obstacle(shape, centre)")
        self.obstacles = tuple(obstacles)
        self.table = np.array([o.packed() for o in obstacles]).reshape(-1, _WIDTH)
        self.motion, self.offset = np.zeros((len(self.table), 6)), np.zeros((len(self.table), 3))
        self._moving = [(h, o.path) for h, o in enumerate(obstacles) if o.path is not None]
        self.at(0.0)

    def __len__(self) -> int:
        return len(self.obstacles)

    def at(self, t: float) -> Array:
        """Move the obstacles to time t [s] and return the table (H, 16)."""
        for h, path in self._moving:
            moved = path(t)
            self.table[h, _CENTRE] = moved[0] + self.offset[h]
            self.motion[h] = moved[1:].ravel()
        return self.table

    def shift(self, h: int, offset: ArrayLike) -> None:
        """Displace obstacle h by `offset` (3,) [m] from its centre or its path.

        Its `motion` remains that of its path: a sensor does not know about displacements by hand.
        """
        h = whole("shift: h", h, 0, len(self) - 1)
        moved = finite_numbers("shift: offset [m]", offset, 3)
        self.table[h, _CENTRE] += moved - self.offset[h]
        self.offset[h] = moved

    @property
    def centres(self) -> Array:
        """The current centres of the obstacles: (H, 3) [m], a view."""
        return self.table[:, _CENTRE]


@inlined
def _in_axes(obstacle, p):
    """A point in the axes of an obstacle, as a tuple."""
    return turned(obstacle[7:16], less(p, obstacle[4:7]))  # by the transposed rotation


@inlined
def distance_to_obstacle(obstacle, p):
    """Signed distance of a point (3,) to one obstacle, and the unit vector away from it, a tuple.

    The distance is negative inside. Where the direction is undefined (on a point, at a centre or
    on an axis) it is the obstacle's z axis.
    """
    (x, y, z), h, u = _in_axes(obstacle, p), obstacle[1:4], (0.0, 0.0, 1.0)
    dx, dy, dz = abs(x) - h[0], abs(y) - h[1], abs(z) - h[2]
    sx, sy, sz = (1.0 if x >= 0 else -1.0), (1.0 if y >= 0 else -1.0), (1.0 if z >= 0 else -1.0)
    ex, ey, ez = max(dx, 0.0), max(dy, 0.0), max(dz, 0.0)
    D = sqrt(ex * ex + ey * ey + ez * ez)
    if D > 1e-12:
        u = (sx * ex / D, sy * ey / D, sz * ez / D)
    elif h[0] > 0.0:  # inside a box: leave through the nearest face
        D = max(dx, dy, dz)
        u = (sx, 0.0, 0.0) if D == dx else (0.0, sy, 0.0) if D == dy else (0.0, 0.0, sz)
    return D - obstacle[0], (dot(obstacle[7:10], u), dot(obstacle[10:13], u),
                             dot(obstacle[13:16], u))


@internal
def turning_off_obstacle(obstacle, p, D):
    """Radius [m] about which the direction away from an obstacle turns, and a vector e, a tuple.

    The second derivative of the distance D with respect to the point is
    (I - r r^T - e e^T) / radius; e is the axis of a capsule beside its cylinder, the direction of
    an edge of a box beside that edge, and zero elsewhere. At a flat face the radius is infinite.
    """
    q, beyond, axis = _in_axes(obstacle, p), 0, -1
    for i in range(3):  # outside one pair of faces: flat; two: an edge; three: a corner
        if abs(q[i]) > obstacle[1 + i] or obstacle[1 + i] == 0.0:
            beyond += 1
        else:
            axis = i
    if beyond < 2:
        return np.inf, (0.0, 0.0, 0.0)
    if axis < 0:
        return D + obstacle[0], (0.0, 0.0, 0.0)
    return D + obstacle[0], (obstacle[7 + axis], obstacle[10 + axis], obstacle[13 + axis])
