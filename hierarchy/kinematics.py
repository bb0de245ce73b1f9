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
def place(T, o):
    """World position of the offset o on the body whose placement is T (12,), as a tuple."""
    return (T[9] + T[0] * o[0] + T[3] * o[1] + T[6] * o[2],
            T[10] + T[1] * o[0] + T[4] * o[1] + T[7] * o[2],
            T[11] + T[2] * o[0] + T[5] * o[1] + T[8] * o[2])


@inlined
def turned(T, a):
    """World direction of a, which the body whose placement is T (12,) carries, as a tuple."""
    return (T[0] * a[0] + T[3] * a[1] + T[6] * a[2], T[1] * a[0] + T[4] * a[1] + T[7] * a[2],
            T[2] * a[0] + T[5] * a[1] + T[8] * a[2])


@compiled
def write_point_jacobian(kinematics, joint, offset, A):
    """Write dp/dq of a point into the first three rows of A."""
    J, supports = kinematics.J, kinematics.supports
    x, y, z = place(kinematics.placements[joint], offset)
    for c in range(A.shape[1]):
        if supports[joint, c]:
            A[0, c] = J[0, c] + J[4, c] * z - J[5, c] * y
            A[1, c] = J[1, c] + J[5, c] * x - J[3, c] * z
            A[2, c] = J[2, c] + J[3, c] * y - J[4, c] * x
        else:
            A[0, c], A[1, c], A[2, c] = 0.0, 0.0, 0.0


@inlined
def carried(v, w, p):
    """v + w x p of tuples: the velocity of p on a body."""
    return (v[0] + w[1] * p[2] - w[2] * p[1], v[1] + w[2] * p[0] - w[0] * p[2],
            v[2] + w[0] * p[1] - w[1] * p[0])


@inlined
def velocity_of_body(J, supports, joint, v):
    """Velocity of a body at the world's origin, and its angular velocity, as tuples."""
    px = py = pz = wx = wy = wz = 0.0
    for c in range(v.size):
        if supports[joint, c]:
            px += J[0, c] * v[c]
            py += J[1, c] * v[c]
            pz += J[2, c] * v[c]
            wx += J[3, c] * v[c]
            wy += J[4, c] * v[c]
            wz += J[5, c] * v[c]
    return (px, py, pz), (wx, wy, wz)


@inlined
def moving_point(kinematics, joint, offset):
    """Velocity J_c v and drift dJ_c/dt v of a point of a body, and the body's angular velocity.

    The drift is exact, or with a period > 0 uses the backward difference of J_c.
    """
    v, J, dJ, placements, supports, previous_J, previous_placements, period = kinematics
    point = place(placements[joint], offset)
    origin, w = velocity_of_body(J, supports, joint, v)
    velocity = carried(origin, w, point)
    if period > 0.0:
        origin, turn = velocity_of_body(previous_J, supports, joint, v)
        before = carried(origin, turn, place(previous_placements[joint], offset))
        apart = less(velocity, before)
        return velocity, (apart[0] / period, apart[1] / period, apart[2] / period), w
    origin, turn = velocity_of_body(dJ, supports, joint, v)  # dJ_v v + dJ_w v x p + w x dp/dt
    return velocity, carried(carried(origin, turn, point), w, velocity), w


@inlined
def add_row(kinematics, joint, point, r, row):
    """Add r^T J_c of the material point at `point` of a body to a row (n,)."""
    J, m = kinematics.J, crossed(point, r)  # r . (w x p) = w . (p x r)
    for c in range(len(row)):
        if kinematics.supports[joint, c]:
            row[c] += (J[0, c] * r[0] + J[1, c] * r[1] + J[2, c] * r[2]
                       + J[3, c] * m[0] + J[4, c] * m[1] + J[5, c] * m[2])


@compiled
def write_rotation_jacobian(kinematics, joint, A):
    """Write the Jacobian of a body's angular velocity into the first three rows of A."""
    for i in range(3):
        for c in range(A.shape[1]):
            A[i, c] = kinematics.J[3 + i, c] if kinematics.supports[joint, c] else 0.0


@compiled
def write_identity(A):
    """Write zeros and, right of them, the identity (m, m) into A (m, n)."""
    m, n = A.shape
    for i in range(m):
        for j in range(n):
            A[i, j] = 0.0
        A[i, n - m + i] = 1.0


@inlined
def row_times(A, row, v):
    """A[row] v."""
    total = 0.0
    for c in range(A.shape[1]):
        total += A[row, c] * v[c]
    return total


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
