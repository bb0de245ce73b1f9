"""Capsules fixed to the links of a robot, and how near two of them are."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.jit import compiled, inlined
from hierarchy.kinematics import place
from hierarchy.problem import Array

Vector = tuple[float, float, float]
_PARALLEL = 1e-12  # squared sine of the angle between two axes below which they count as parallel
ON_AXIS = 1e-12  # [m] axes that meet have no direction between them


@dataclass(frozen=True)
class Capsule:
    """All within `radius` [m] of the segment from `start` to `end` (3,) [m].

    It is fixed to the body that `joint` (an index, 0 for what does not move) moves, in its frame.
    A segment of length zero is a ball.
    """

    name: str
    joint: int
    start: Vector
    end: Vector
    radius: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.radius < inf:
            raise HierarchyError(f"capsule {self.name!r}: radius {self.radius} m is out of range")
        for name in ("start", "end"):
            point = np.asarray(getattr(self, name), dtype=float)
            if point.shape != (3,) or not np.isfinite(point).all():
                raise HierarchyError(f"capsule {self.name!r}: {name} {getattr(self, name)} must be "
                                     "three finite numbers [m]")


def pairs_of_chain(capsules: Sequence[Capsule]) -> tuple[tuple[int, int], ...]:
    """Every pair (i, j) of a chain of capsules but neighbours, which share a joint."""
    return tuple((i, j) for i, j in combinations(range(len(capsules)), 2) if j > i + 1)


def pairs_of_tree(capsules: Sequence[Capsule], parents: Sequence[int]) -> list[tuple[int, int]]:
    """Every pair (i, j) of capsules on a tree of joints, but those on one joint and neighbours.

    `parents` has the joint that carries each joint. Neighbours are a capsule and those on the
    nearest joint below that has any, down to the base.
    """
    joints = {capsule.joint for capsule in capsules}

    def carrier(joint: int) -> int:
        while joint > 0:
            joint = parents[joint]
            if joint in joints:
                return joint
        return -1

    return [(i, j) for i, j in combinations(range(len(capsules)), 2)
            for a, b in [(capsules[i].joint, capsules[j].joint)]
            if a != b and carrier(a) != b and carrier(b) != a]


def pack_capsules(capsules: Sequence[Capsule]) -> tuple[NDArray[np.int64], Array]:
    """Joints (K,), and start, start to end, radius (K, 7) [m] of capsules, for the kernels."""
    joints = np.array([capsule.joint for capsule in capsules], dtype=np.int64)
    rows = [[*c.start, *np.subtract(c.end, c.start), c.radius] for c in capsules]
    return joints, np.array(rows, dtype=float).reshape(-1, 7)


def measure_capsules(placements: Array, joints: NDArray[np.int64], capsules: Array,
                     pairs: NDArray[np.int64]) -> Array:
    """How near the capsules of each pair are: (M, 6).

    A row is the distance [m], negative where they overlap; the unit direction from the second to
    the first; and the shares of their axes, 0 at the start and 1 at the end, at which the nearest
    points lie. placements as in a State; joints (K,), capsules (K, 7) packed; pairs (M, 2).
    """
    seen = np.empty((len(pairs), 6))
    _measure(placements, joints, capsules, pairs, seen)
    return seen


@compiled
def _measure(placements, joints, capsules, pairs, seen):
    for m in range(pairs.shape[0]):
        i, j = pairs[m, 0], pairs[m, 1]
        D, rx, ry, rz, s, t = nearest_of_capsules(placements[joints[i]], capsules[i],
                                                  placements[joints[j]], capsules[j])
        seen[m, 0], seen[m, 1], seen[m, 2], seen[m, 3] = D, rx, ry, rz
        seen[m, 4], seen[m, 5] = s, t


@inlined
def nearest_of_capsules(T_a, a, T_b, b):
    """Distance, direction from b to a, and shares s, t of the axes; see `measure_capsules`."""
    ux, uy, uz = turned(T_a, a)
    wx, wy, wz = turned(T_b, b)
    ax, ay, az = place(T_a, a[0], a[1], a[2])
    bx, by, bz = place(T_b, b[0], b[1], b[2])
    x, y, z = ax - bx, ay - by, az - bz
    s, t = nearest_shares(dot(ux, uy, uz, ux, uy, uz), dot(ux, uy, uz, wx, wy, wz),
                          dot(wx, wy, wz, wx, wy, wz), dot(ux, uy, uz, x, y, z),
                          dot(wx, wy, wz, x, y, z))
    x, y, z = x + s * ux - t * wx, y + s * uy - t * wy, z + s * uz - t * wz
    length = sqrt(x * x + y * y + z * z)
    D = length - a[6] - b[6]
    if length < ON_AXIS:
        return D, 0.0, 0.0, 1.0, s, t
    return D, x / length, y / length, z / length, s, t


@inlined
def nearest_shares(uu, uw, ww, ux, wx):
    """The s, t in 0 .. 1 that make |x + s u - t w|^2 least, from the products of x, u and w.

    That is convex in s and t: its least value lies inside the square, or else on one of the four
    edges. Of parallel axes side by side, which have many nearest points, one at an end is taken.
    """
    determinant = uu * ww - uw * uw
    if determinant > _PARALLEL * uu * ww:
        s, t = (uw * wx - ww * ux) / determinant, (uu * wx - uw * ux) / determinant
        if 0.0 < s < 1.0 and 0.0 < t < 1.0:
            return s, t
    s, t, least = 0.0, 0.0, np.inf
    for k in range(4):
        end = float(k % 2)
        if k < 2:
            s_k, t_k = end, _share(wx + end * uw, ww)
        else:
            s_k, t_k = _share(end * uw - ux, uu), end
        value = s_k * (s_k * uu + 2.0 * ux) + t_k * (t_k * ww - 2.0 * wx) - 2.0 * s_k * t_k * uw
        if value < least:
            s, t, least = s_k, t_k, value
    return s, t


@inlined
def bend_of_nearest(length, r, v, a_axis, b_axis):
    """What is left of the second derivative of the distance of two axes, beside r . acceleration.

    length [m] between the nearest points; r from b to a; v the velocity of the one relative to the
    other, both fixed to their bodies; an axis is its vector (u, w), the time derivative of that and
    the share (s, t) at which the nearest point lies. Where the
    nearest points are free to slide (0 < s < 1) the distance is the least over s and t, and its
    second derivative by a Schur complement: less than that of fixed points.
    """
    (rx, ry, rz), (vx, vy, vz) = r, v
    (ux, uy, uz), (dux, duy, duz), s = a_axis
    (wx, wy, wz), (dwx, dwy, dwz), t = b_axis
    along = dot(rx, ry, rz, vx, vy, vz)
    bend = (dot(vx, vy, vz, vx, vy, vz) - along * along) / length
    H_ss = dot(ux, uy, uz, ux, uy, uz) / length
    H_tt = dot(wx, wy, wz, wx, wy, wz) / length
    H_st = -dot(ux, uy, uz, wx, wy, wz) / length
    g_s = dot(vx, vy, vz, ux, uy, uz) / length + dot(rx, ry, rz, dux, duy, duz)
    g_t = -dot(vx, vy, vz, wx, wy, wz) / length - dot(rx, ry, rz, dwx, dwy, dwz)
    if 0.0 < s < 1.0 and 0.0 < t < 1.0:
        determinant = H_ss * H_tt - H_st * H_st
        if determinant > _PARALLEL * H_ss * H_tt:
            return bend - (H_tt * g_s * g_s - 2.0 * H_st * g_s * g_t
                           + H_ss * g_t * g_t) / determinant
    if 0.0 < s < 1.0:
        return bend - g_s * g_s / H_ss
    return bend - g_t * g_t / H_tt if 0.0 < t < 1.0 else bend


@inlined
def turned(T, capsule):
    """Start to end of a capsule (7,) in the world, on the body whose placement is T (12,)."""
    x, y, z = capsule[3], capsule[4], capsule[5]
    return (T[0] * x + T[3] * y + T[6] * z, T[1] * x + T[4] * y + T[7] * z,
            T[2] * x + T[5] * y + T[8] * z)


@inlined
def dot(ax, ay, az, bx, by, bz):
    """Product of two vectors."""
    return ax * bx + ay * by + az * bz


@inlined
def _share(part, whole):
    return min(max(part / whole, 0.0), 1.0) if whole > 0.0 else 0.0
