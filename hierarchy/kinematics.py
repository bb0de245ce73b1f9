"""Compiled kinematics of points and axes fixed to a body, from the arrays of a State.

J is the world-frame spatial Jacobian of all joints (linear part at the world origin), so a point p
on body j has the columns J_v + J_w x p of the joints that support j. Its time derivative is
dJ_v + dJ_w x p + J_w x dp/dt. `placements` rows are rotation (by columns) and translation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled, inlined
from hierarchy.problem import Array


class Kinematics(NamedTuple):
    """The arrays of a State that kernels read; `period` is 0 for exact derivatives."""

    v: Array
    J: Array
    dJ: Array  # noqa: N815
    placements: Array
    supports: NDArray[np.bool_]
    previous_J: Array  # noqa: N815
    previous_placements: Array
    period: float


class Readings(NamedTuple):
    """The arrays of a Measurement, for the kernels.

    It is here because every kernel that reads it calls one of this file, so that the cache of
    compiled kernels notices a change of its fields.
    """

    points: Array
    distance: Array
    direction: Array
    magnitude: Array
    nearest: NDArray[np.int64]
    active: NDArray[np.int64]  # (1,)


@inlined
def place(T, ox, oy, oz):
    """World position of an offset on the body whose placement is T (12,)."""
    return (T[9] + T[0] * ox + T[3] * oy + T[6] * oz, T[10] + T[1] * ox + T[4] * oy + T[7] * oz,
            T[11] + T[2] * ox + T[5] * oy + T[8] * oz)


@inlined
def point_at(placements, joint, offset, i):
    """Coordinate i of the world position of `offset` on body `joint`."""
    T = placements[joint]
    return T[9 + i] + T[i] * offset[0] + T[3 + i] * offset[1] + T[6 + i] * offset[2]


@inlined
def axis_at(placements, joint, axis, i):
    """Coordinate i of the world direction of `axis` on body `joint`."""
    T = placements[joint]
    return T[i] * axis[0] + T[3 + i] * axis[1] + T[6 + i] * axis[2]


@compiled
def write_point_jacobian(J, placements, supports, joint, offset, A, row):
    """Write dp/dq (3, n) of a point into A[row : row + 3]."""
    x = point_at(placements, joint, offset, 0)
    y = point_at(placements, joint, offset, 1)
    z = point_at(placements, joint, offset, 2)
    for c in range(A.shape[1]):
        if supports[joint, c]:
            A[row, c] = J[0, c] + J[4, c] * z - J[5, c] * y
            A[row + 1, c] = J[1, c] + J[5, c] * x - J[3, c] * z
            A[row + 2, c] = J[2, c] + J[3, c] * y - J[4, c] * x
        else:
            A[row, c] = 0.0
            A[row + 1, c] = 0.0
            A[row + 2, c] = 0.0


@inlined
def velocity_of_point(J, supports, joint, v, x, y, z):
    """Velocity of the material point at x, y, z, and the angular velocity of its body."""
    px = py = pz = wx = wy = wz = 0.0
    for c in range(v.size):
        if supports[joint, c]:
            px += J[0, c] * v[c]
            py += J[1, c] * v[c]
            pz += J[2, c] * v[c]
            wx += J[3, c] * v[c]
            wy += J[4, c] * v[c]
            wz += J[5, c] * v[c]
    return px + wy * z - wz * y, py + wz * x - wx * z, pz + wx * y - wy * x, wx, wy, wz


@inlined
def drift_of_point(kinematics, joint, ox, oy, oz):
    """Velocity J_c v and drift dJ_c/dt v of the point at offset ox, oy, oz on a body.

    The drift is exact, or with a period > 0 uses the backward difference of J_c. The angular
    velocity of the body comes last.
    """
    v, J, dJ, placements, supports, previous_J, previous_placements, period = kinematics
    x, y, z = place(placements[joint], ox, oy, oz)
    px, py, pz, wx, wy, wz = velocity_of_point(J, supports, joint, v, x, y, z)
    if period > 0.0:
        x, y, z = place(previous_placements[joint], ox, oy, oz)
        bx, by, bz, _, _, _ = velocity_of_point(previous_J, supports, joint, v, x, y, z)
        ax, ay, az = (px - bx) / period, (py - by) / period, (pz - bz) / period
    else:  # dJ_v v + dJ_w v x p + w x dp/dt
        ax, ay, az, _, _, _ = velocity_of_point(dJ, supports, joint, v, x, y, z)
        ax, ay, az = ax + wy * pz - wz * py, ay + wz * px - wx * pz, az + wx * py - wy * px
    return px, py, pz, ax, ay, az, wx, wy, wz


@inlined
def moving_point(kinematics, joint, o):
    """Velocity and drift of the point at offset o, and the angular velocity of its body."""
    vx, vy, vz, ax, ay, az, wx, wy, wz = drift_of_point(kinematics, joint, o[0], o[1], o[2])
    return (vx, vy, vz), (ax, ay, az), (wx, wy, wz)


@inlined
def add_row(J, supports, joint, point, r, A, row):
    """Add r^T J_c (n,) of the material point at `point` of a body to A[row]."""
    (x, y, z), (rx, ry, rz) = point, r
    mx, my, mz = y * rz - z * ry, z * rx - x * rz, x * ry - y * rx  # r . (w x p) = w . (p x r)
    for c in range(A.shape[1]):
        if supports[joint, c]:
            A[row, c] += (J[0, c] * rx + J[1, c] * ry + J[2, c] * rz
                          + J[3, c] * mx + J[4, c] * my + J[5, c] * mz)


@compiled
def write_rotation_jacobian(J, supports, joint, A, row):
    """Write the Jacobian (3, n) of a body's angular velocity into A[row : row + 3]."""
    for i in range(3):
        for c in range(A.shape[1]):
            A[row + i, c] = J[3 + i, c] if supports[joint, c] else 0.0


@compiled
def write_identity(A, row, count):
    """Write zeros and, right of them, the identity (count, count) into A[row : row + count]."""
    base = A.shape[1] - count
    for i in range(count):
        for j in range(A.shape[1]):
            A[row + i, j] = 0.0
        A[row + i, base + i] = 1.0


@inlined
def row_times(A, row, v):
    """A[row] v."""
    total = 0.0
    for c in range(A.shape[1]):
        total += A[row, c] * v[c]
    return total


@inlined
def write_equality(lower, upper, row, value):
    """Make a row an equality."""
    lower[row] = value
    upper[row] = value


@inlined
def triple(a, i):
    """Three entries of an array, from i on, as a tuple."""
    return a[i], a[i + 1], a[i + 2]


@inlined
def dot(a, b):
    """a . b of tuples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def crossed(a, b):
    """a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def less(a, b):
    """a - b of tuples."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def plus(a, b):
    """a + b of tuples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def times(factor, a):
    """A multiple of a tuple."""
    return factor * a[0], factor * a[1], factor * a[2]
