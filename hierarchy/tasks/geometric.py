"""Common parts of tasks of several frames: their Jacobians and motion, in numpy and in kernels."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from abc import abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled, inlined
from hierarchy.kinematics import (
    axis_at,
    drift_of_point,
    point_at,
    velocity_of_point,
    write_point_jacobian,
    write_point_jacobian_derivative,
    write_rotation_jacobian,
)
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Task


class View(NamedTuple):
    """The kinematics that a Jacobian is made of: those of this tick or of the one before."""

    J: Array
    placements: Array
    supports: NDArray[np.bool_]

    def frame(self, frame: Frame) -> Placed:
        """Return a frame as it is placed, with its Jacobians."""
        row = self.placements[frame.joint]
        body = row[:9].reshape(3, 3).T
        linear, angular = np.empty((2, 3, self.J.shape[1]))
        write_point_jacobian(self.J, self.placements, self.supports, frame.joint, frame.offset,
                             linear, 0)
        write_rotation_jacobian(self.J, self.supports, frame.joint, angular, 0)
        return Placed(row[9:] + body @ frame.offset, body @ frame.rotation, linear, angular)


class Placed(NamedTuple):
    """Position p (3,) [m], rotation R (3, 3), linear and angular Jacobian (3, n), world axes."""

    p: Array
    R: Array
    J: Array
    W: Array


class Rates(NamedTuple):
    """Velocity v and angular velocity w (3,), and time derivatives of the Jacobians (3, n)."""

    v: Array
    w: Array
    dJ: Array  # noqa: N815
    dW: Array  # noqa: N815


class Geometric(Task):
    """A task whose derivative is exact or, with `State.period`, a backward difference. Abstract."""

    @abstractmethod
    def rows(self, view: View) -> Array:
        """Jacobian (m, n) of a view."""

    @abstractmethod
    def rows_derivative(self, state: State) -> Array:
        """Exact time derivative of the Jacobian (m, n)."""

    def jacobian(self, state: State) -> Array:
        """Jacobian (m, n)."""
        return self.rows(view_of(state))

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (m, n) [1/s]."""
        if state.period == 0.0:
            return self.rows_derivative(state)
        before = View(state.previous_J, state.previous_placements, state.supports)
        return (self.jacobian(state) - self.rows(before)) / state.period


def view_of(state: State) -> View:
    """Return the kinematics of this tick."""
    return View(state.J, state.placements, state.supports)


def rates_of(state: State, frame: Frame, placed: Placed) -> Rates:
    """Return the motion of a frame; exact derivatives, for a state without differences."""
    dJ, dW = np.empty((2, 3, state.n))
    write_point_jacobian_derivative(state.kinematics, frame.joint, frame.offset, dJ)
    write_rotation_jacobian(state.dJ, state.supports, frame.joint, dW, 0)
    return Rates(placed.J @ state.v, placed.W @ state.v, dJ, dW)


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
def turned_back(R, a):
    """R^T a of a rotation (3, 3) and a tuple."""
    return (R[0, 0] * a[0] + R[1, 0] * a[1] + R[2, 0] * a[2],
            R[0, 1] * a[0] + R[1, 1] * a[1] + R[2, 1] * a[2],
            R[0, 2] * a[0] + R[1, 2] * a[1] + R[2, 2] * a[2])


@inlined
def position_of(placements, spot):
    """World position of a spot, as a tuple."""
    return (point_at(placements, spot.joint, spot.offset, 0),
            point_at(placements, spot.joint, spot.offset, 1),
            point_at(placements, spot.joint, spot.offset, 2))


@compiled
def rotation_of(placements, joint, rotation):
    """World rotation (3, 3) of a spot."""
    R = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            R[i, k] = axis_at(placements, joint, rotation[:, k], i)
    return R


@inlined
def motion_of(kinematics, spot):
    """Velocity, angular velocity, and their drifts dJ/dt v and dW/dt v, of a spot; exact ones."""
    vx, vy, vz, ax, ay, az, wx, wy, wz = drift_of_point(
        kinematics, spot.joint, spot.offset[0], spot.offset[1], spot.offset[2])
    _, _, _, bx, by, bz = velocity_of_point(kinematics.dJ, kinematics.supports, spot.joint,
                                            kinematics.v, 0.0, 0.0, 0.0)
    return (vx, vy, vz), (wx, wy, wz), (ax, ay, az), (bx, by, bz)


@inlined
def jacobians_of(J, placements, supports, spot):
    """Linear and angular Jacobian (3, n) of a spot."""
    linear, angular = np.empty((3, J.shape[1])), np.empty((3, J.shape[1]))
    write_point_jacobian(J, placements, supports, spot.joint, spot.offset, linear, 0)
    write_rotation_jacobian(J, supports, spot.joint, angular, 0)
    return linear, angular
