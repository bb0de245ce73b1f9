"""Points and capsules fixed to the links of a robot, and the distances between capsules."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from math import sqrt
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import expect_each, finite_numbers
from hierarchy.jit import compiled, inlined
from hierarchy.kinematics import dot, less, place, plus, times, turned
from hierarchy.problem import Array
from hierarchy.records import NotNegative, check_fields, equal


@dataclass(frozen=True)
class ControlPoint:
    """A point fixed to the body that `joint` (an index) moves; offset (3,) [m] in its frame."""

    name: str
    joint: int
    offset: Annotated[Array, partial(finite_numbers, size=3), "m"]
    __eq__ = equal

    def __post_init__(self) -> None:
        check_fields(self, f"control point {self.name!r}")


class Points(NamedTuple):
    """Points fixed to bodies, for kernels: the joint (K,) of each, its offset (K, 3) [m] there."""

    joints: NDArray[np.int64]
    offsets: Array


def pack_points(points: Sequence[ControlPoint]) -> Points:
    """Return control points for the kernels."""
    expect_each("control points", points, ControlPoint, "make one with robot.control_point(...)")
    joints = np.array([point.joint for point in points], dtype=np.int64)
    offsets = np.array([point.offset for point in points], dtype=float).reshape(-1, 3)
    return Points(joints, offsets)


Vector = tuple[float, float, float]
_MAKE = "see robot.capsules"
_PARALLEL = 1e-12  # squared sine of the angle between two axes below which they count as parallel
ON_AXIS = 1e-12  # [m] axes that meet have no direction between them


@dataclass(frozen=True)
class Capsule:
    """All points within `radius` [m] of the segment from `start` to `end` (3,) [m].

    The segment is in the frame of the body that `joint` (an index, 0 for the fixed base) moves. A
    segment of length zero makes a ball.
    """

    name: str
    joint: int
    start: Annotated[Vector, partial(finite_numbers, size=3), "m"]
    end: Annotated[Vector, partial(finite_numbers, size=3), "m"]
    radius: Annotated[NotNegative, "m"]

    def __post_init__(self) -> None:
        check_fields(self, f"capsule {self.name!r}")


def pairs_of_chain(capsules: Sequence[Capsule]) -> tuple[tuple[int, int], ...]:
    """Every pair (i, j) of a chain of capsules, except neighbours, which share a joint."""
    expect_each("capsules", capsules, Capsule, _MAKE)
    return tuple((i, j) for i, j in combinations(range(len(capsules)), 2) if j > i + 1)


def pairs_of_tree(capsules: Sequence[Capsule], parents: Sequence[int]) -> list[tuple[int, int]]:
    """Every pair (i, j) of capsules on a tree of joints, except neighbours and those on one joint.

    `parents` has the joint that carries each joint. Neighbours of a capsule are those on the
    nearest joint toward the base that has any.
    """
    joints, carrier = {capsule.joint for capsule in capsules}, [-1]
    for above in parents[1:]:  # which come before the joints that they carry
        carrier.append(above if above in joints else carrier[above])
    return [(i, j) for i, j in combinations(range(len(capsules)), 2)
            for a, b in [(capsules[i].joint, capsules[j].joint)]
            if a != b and carrier[a] != b and carrier[b] != a]


def pack_capsules(capsules: Sequence[Capsule]) -> tuple[NDArray[np.int64], Array]:
    """Joints (K,), and start, end - start, radius (K, 7) [m] of capsules, for the kernels."""
    expect_each("capsules", capsules, Capsule, _MAKE)
    joints = np.array([capsule.joint for capsule in capsules], dtype=np.int64)
    rows = [[*c.start, *np.subtract(c.end, c.start), c.radius] for c in capsules]
    return joints, np.array(rows, dtype=float).reshape(len(rows), 7)


@compiled
def measure_capsules(placements, joints, capsules, pairs):
    """Return distance, direction and nearest points of each pair of capsules: (M, 6).

    A row is the distance [m], negative where the capsules overlap; the unit vector from the second
    to the first; and the positions of the nearest points on the two axes, 0 at the start and 1 at
    the end. placements as in a State; joints (K,) and capsules (K, 7) packed; pairs (M, 2).
    """
    seen = np.empty((len(pairs), 6))
    for m in range(len(pairs)):
        i, j = pairs[m, 0], pairs[m, 1]
        seen[m, 0], r, seen[m, 4], seen[m, 5] = nearest_of_capsules(
            placements[joints[i]], capsules[i], placements[joints[j]], capsules[j])
        seen[m, 1], seen[m, 2], seen[m, 3] = r
    return seen


@inlined
def nearest_of_capsules(T_a, a, T_b, b):
    """Distance, direction from b to a, and positions s, t on the axes; see `measure_capsules`."""
    u, w = turned(T_a, a[3:6]), turned(T_b, b[3:6])
    apart = less(place(T_a, a), place(T_b, b))
    s, t = nearest_shares(dot(u, u), dot(u, w), dot(w, w), dot(u, apart), dot(w, apart))
    x, y, z = less(plus(apart, times(s, u)), times(t, w))
    length = sqrt(x * x + y * y + z * z)
    D = length - a[6] - b[6]
    if length < ON_AXIS:
        return D, (0.0, 0.0, 1.0), s, t
    return D, (x / length, y / length, z / length), s, t


@inlined
def nearest_shares(uu, uw, ww, ux, wx):
    """The s, t in 0 .. 1 that minimise |x + s u - t w|^2, from the products of x, u and w.

    The function is convex in s and t: its minimum lies inside the square or on one of the four
    edges. For parallel axes side by side, which have many nearest points, one at an end is taken.
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
    """Second derivative of the distance of two axes, less r . acceleration.

    length [m] is the distance of the nearest points; r points from b to a; v is the velocity of a
    relative to b, both taken as fixed to their bodies. An axis is its vector (u or w), the time
    derivative of that vector, and the position (s or t) of the nearest point. Where the nearest
    points can slide (0 < s < 1) the distance is the minimum over s and t, and its second derivative
    follows from a Schur complement: less than that of fixed points.
    """
    (u, du, s), (w, dw, t) = a_axis, b_axis
    along = dot(r, v)
    bend = (dot(v, v) - along * along) / length
    H_ss, H_tt, H_st = dot(u, u) / length, dot(w, w) / length, -dot(u, w) / length
    g_s, g_t = dot(v, u) / length + dot(r, du), -dot(v, w) / length - dot(r, dw)
    if 0.0 < s < 1.0 and 0.0 < t < 1.0:
        determinant = H_ss * H_tt - H_st * H_st
        if determinant > _PARALLEL * H_ss * H_tt:
            return bend - (H_tt * g_s * g_s - 2.0 * H_st * g_s * g_t
                           + H_ss * g_t * g_t) / determinant
    if 0.0 < s < 1.0:
        return bend - g_s * g_s / H_ss
    return bend - g_t * g_t / H_tt if 0.0 < t < 1.0 else bend


@inlined
def on_axis(capsule, share):
    """The point of a capsule's axis at a share of its length, in the body."""
    return plus(capsule, times(share, capsule[3:6]))


@inlined
def _share(part, whole):
    return min(max(part / whole, 0.0), 1.0) if whole > 0.0 else 0.0
