"""Common parts of tasks of several frames: their Jacobians and motion, in numpy and in kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled, inlined
from hierarchy.kinematics import (
    Kinematics,
    moving_point,
    velocity_of_body,
    write_point_jacobian,
    write_rotation_jacobian,
)
from hierarchy.problem import Array
from hierarchy.robot import Frame


class Placed(NamedTuple):
    """A frame in world axes: position p (3,) [m], rotation R (3, 3), Jacobian and its derivative.

    The Jacobian is (6, n), linear part first, and its derivative is exact.
    """

    p: Array
    R: Array
    J: Array
    dJ: Array  # noqa: N815

    @classmethod
    def of(cls, kinematics: Kinematics, frame: Frame) -> Placed:
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
    def of(cls, frame: Frame) -> Spot:
        """Return the spot of a frame."""
        return cls(frame.joint, frame.offset, np.ascontiguousarray(frame.rotation))


@inlined
def column(A, c):
    """Column c of three rows, as a tuple."""
    return A[0, c], A[1, c], A[2, c]


@compiled
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
    return (R[0, 0] * a[0] + R[1, 0] * a[1] + R[2, 0] * a[2],
            R[0, 1] * a[0] + R[1, 1] * a[1] + R[2, 1] * a[2],
            R[0, 2] * a[0] + R[1, 2] * a[1] + R[2, 2] * a[2])


@compiled
def rotation_of(placements, joint, rotation):
    """World rotation (3, 3) of a spot."""
    R, T = np.empty((3, 3)), placements[joint]
    for i in range(3):
        for k in range(3):
            R[i, k] = (T[i] * rotation[0, k] + T[3 + i] * rotation[1, k]
                       + T[6 + i] * rotation[2, k])
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
