"""Kinematics of points, axes and frames fixed to a body, compiled, from the arrays of a State.

J is the world-frame spatial Jacobian of all joints (linear part at the world origin), so a point p
on body j has the columns J_v + J_w x p of the joints that support j. Its time derivative is
dJ_v + dJ_w x p + J_w x dp/dt. `placements` rows are rotation (by columns) and translation.
"""

from __future__ import annotations

from math import atan2, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled, inlined, internal
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


@inlined
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


@inlined
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


@compiled
def rotation_vector(R):
    """Rotation vector (3,) [rad] of a rotation matrix (3, 3), angle in 0 .. pi."""
    twist = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    sine = sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    cosine = (R[0, 0] + R[1, 1] + R[2, 2] - 1.0) / 2
    angle = atan2(sine, cosine)
    if sine > 1e-7:
        return twist * (angle / sine)
    if cosine > 0.0:
        return twist
    # Half a turn: the axis is the column of R + I with the largest diagonal entry.
    i = 0
    for k in range(1, 3):
        if R[k, k] > R[i, i]:
            i = k
    axis = R[:, i].copy()
    axis[i] += 1.0
    return axis * (angle / sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2))


class Placed(NamedTuple):
    """A frame in world axes: position p (3,) [m], rotation R (3, 3), Jacobian and its derivative.

    The Jacobian is (6, n), linear part first, and its derivative is exact.
    """

    p: Array
    R: Array
    J: Array
    dJ: Array  # noqa: N815

    @classmethod
    def of(cls, kinematics: Kinematics, frame: Any) -> Placed:
        """Return a frame as it is placed and moves."""
        T, moves = kinematics.placements[frame.joint], kinematics.supports[frame.joint]
        body = T[:9].reshape(3, 3).T
        p = T[9:] + body @ frame.offset
        J, dJ = kinematics.J * moves, kinematics.dJ * moves
        J[:3] -= cross(p) @ J[3:]
        dJ[:3] -= cross(p) @ dJ[3:] + cross(J[:3] @ kinematics.v) @ J[3:]
        return cls(p, body @ frame.rotation, J, dJ)


def cross(a: NDArray[Any]) -> NDArray[Any]:
    """Return the matrix (3, 3) with which a x b is a product."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


class Spot(NamedTuple):
    """A frame for kernels: its joint, offset (3,) and rotation (3, 3) in the joint's frame."""

    joint: int
    offset: Array
    rotation: Array

    @classmethod
    def of(cls, frame: Any) -> Spot:
        """Return the spot of a frame."""
        return cls(frame.joint, frame.offset, frame.rotation)


@inlined
def column(A, c):
    """Column c of three rows, as a tuple."""
    return A[0, c], A[1, c], A[2, c]


@internal
def times_transposed(A, B):
    """A B^T (3, 3) of two matrices (3, 3)."""
    product = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                product[i, j] += A[i, k] * B[j, k]
    return product


@inlined
def turned_back(R, a):
    """R^T a of a rotation (3, 3) and a tuple."""
    return dot(column(R, 0), a), dot(column(R, 1), a), dot(column(R, 2), a)


@internal
def rotation_of(placements, spot):
    """World rotation (3, 3) of a spot."""
    R, T = np.empty((3, 3)), placements[spot.joint]
    for k in range(3):
        R[0, k], R[1, k], R[2, k] = turned(T, column(spot.rotation, k))
    return R


@inlined
def motion_of(kinematics, spot):
    """Velocity, angular velocity, and their drifts dJ/dt v and dW/dt v, of a spot; exact ones."""
    v, a, w = moving_point(kinematics, spot.joint, spot.offset)
    _, b = velocity_of_body(kinematics.dJ, kinematics.supports, spot.joint, kinematics.v)
    return v, w, a, b


@inlined
def jacobians_of(kinematics, spot):
    """Linear and angular Jacobian (3, n) of a spot."""
    linear, angular = np.empty((3, len(kinematics.v))), np.empty((3, len(kinematics.v)))
    write_point_jacobian(kinematics, spot.joint, spot.offset, linear)
    write_rotation_jacobian(kinematics, spot.joint, angular)
    return linear, angular
