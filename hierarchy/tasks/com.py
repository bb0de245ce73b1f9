"""Task that moves the centre of mass of the whole robot along a path."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled, inlined
from hierarchy.kinematics import (
    drift_of_point,
    place,
    row_times,
    subtract_over_period,
    write_equality,
    write_point_jacobian_derivative,
)
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Task, along


@dataclass(frozen=True)
class CentreOfMass(Task):
    """Move the robot's centre of mass along `path` in the chosen world axes [m].

    `axes` are some of 0, 1, 2 for x, y, z in increasing order, one row per axis: (0, 1) leaves the
    height free, which is enough for standing. p = sum m_i p_i / sum m_i over the bodies that joints
    move. Raises HierarchyError if the robot has no masses.
    """

    robot: Robot
    path: Path
    axes: tuple[int, ...] = (0, 1, 2)
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "centre of mass"
    shares: Array = field(init=False, repr=False, compare=False)  # of the mass, one per body

    def __post_init__(self) -> None:
        super().__post_init__()
        axes = tuple(self.axes)
        if not axes or any(axis not in (0, 1, 2) for axis in axes) or list(axes) != sorted(
                set(axes)):
            raise HierarchyError(f"task {self.name!r}: axes {list(axes)} must be some of 0, 1, 2, "
                                 "in this order")
        mass = float(self.robot.masses.sum())
        if not mass > 0.0:
            raise HierarchyError(f"task {self.name!r}: robot {self.robot.name!r} has no masses")
        set_frozen(self, shares=self.robot.masses / mass)

    @property
    def dimension(self) -> int:
        """One row per axis."""
        return len(self.axes)

    def error(self, state: State) -> Array:
        """p_d - p (m,) [m]."""
        return np.asarray((self.path(state.t)[0] - self.position(state))[list(self.axes)])

    def position(self, state: State) -> Array:
        """World position of the centre of mass (3,) [m]."""
        R = state.placements[:, :9].reshape(-1, 3, 3)  # column by column
        points = state.placements[:, 9:] + np.einsum("jki,jk->ji", R, self.robot.centres)
        return np.asarray(self.shares @ points)

    def jacobian(self, state: State) -> Array:
        """dp/dq (m, n) [m]."""
        return self._of(state.J, state.placements, state.supports)

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (m, n) [m/s]."""
        if state.period > 0.0:
            J = self.jacobian(state)
            subtract_over_period(J, self._of(state.previous_J, state.previous_placements,
                                             state.supports), state.period)
            return J
        dJ, of_body = np.zeros((3, state.n)), np.empty((3, state.n))
        for joint, (share, centre) in enumerate(zip(self.shares, self.robot.centres, strict=True)):
            if share > 0.0:
                write_point_jacobian_derivative(state.kinematics, joint, centre, of_body)
                dJ += share * of_body
        return np.asarray(dJ[list(self.axes)])

    def desired_velocity(self, state: State) -> Array:
        """dp_d/dt (m,) [m/s]."""
        return np.asarray(self.path(state.t)[1][list(self.axes)])

    def desired_acceleration(self, state: State) -> Array:
        """d2p_d/dt2 (m,) [m/s^2]."""
        return np.asarray(self.path(state.t)[2][list(self.axes)])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        target = np.empty((3, 3))  # p_d, dp_d/dt, d2p_d/dt2
        parameters = _Parameters(self.shares, self.robot.centres, self._axes(), target,
                                 self.stiffness, self.damping, self.gain, level == "acceleration")
        write_rows = bind(_write, state.kinematics, parameters, A, lower, upper, row)
        return along(self.path, target, state, write_rows)

    def _of(self, J: Array, placements: Array, supports: NDArray[np.bool_]) -> Array:
        out = np.empty((self.dimension, J.shape[1]))
        _write_jacobian(J, placements, supports, self.shares, self.robot.centres, self._axes(),
                        out, 0)
        return out

    def _axes(self) -> NDArray[np.int64]:
        return np.array(self.axes, dtype=np.int64)


class _Parameters(NamedTuple):
    shares: Array
    centres: Array
    axes: NDArray[np.int64]
    target: Array
    stiffness: float
    damping: float
    gain: float
    acceleration: bool


@compiled
def _write_jacobian(J, placements, supports, shares, centres, axes, A, row):
    """Column c is s J_v + J_w x m, with s and m the mass and moment (as shares) that c moves."""
    for c in range(A.shape[1]):
        s, mx, my, mz = _carried(placements, supports, shares, centres, c)
        for i in range(len(axes)):
            if axes[i] == 0:
                A[row + i, c] = s * J[0, c] + J[4, c] * mz - J[5, c] * my
            elif axes[i] == 1:
                A[row + i, c] = s * J[1, c] + J[5, c] * mx - J[3, c] * mz
            else:
                A[row + i, c] = s * J[2, c] + J[3, c] * my - J[4, c] * mx


@inlined
def _carried(placements, supports, shares, centres, c):
    s = mx = my = mz = 0.0
    for joint in range(1, len(shares)):
        if supports[joint, c] and shares[joint] > 0.0:
            x, y, z = place(placements[joint], centres[joint, 0], centres[joint, 1],
                            centres[joint, 2])
            s += shares[joint]
            mx += shares[joint] * x
            my += shares[joint] * y
            mz += shares[joint] * z
    return s, mx, my, mz


@compiled
def _write(kinematics, parameters, A, lower, upper, row):
    shares, centres, axes, target, stiffness, damping, gain, acceleration = parameters
    _write_jacobian(kinematics.J, kinematics.placements, kinematics.supports, shares, centres, axes,
                    A, row)
    p, drift = np.zeros(3), np.zeros(3)
    for joint in range(1, len(shares)):
        if shares[joint] > 0.0:
            cx, cy, cz = centres[joint, 0], centres[joint, 1], centres[joint, 2]
            x, y, z = place(kinematics.placements[joint], cx, cy, cz)
            p[0] += shares[joint] * x
            p[1] += shares[joint] * y
            p[2] += shares[joint] * z
            if acceleration:
                _, _, _, ax, ay, az, _, _, _ = drift_of_point(kinematics, joint, cx, cy, cz)
                drift[0] += shares[joint] * ax
                drift[1] += shares[joint] * ay
                drift[2] += shares[joint] * az
    for i in range(len(axes)):
        k = axes[i]
        error = target[0, k] - p[k]
        b = target[1, k] + gain * error
        if acceleration:
            rate = target[1, k] - row_times(A, row + i, kinematics.v)
            b = target[2, k] + damping * rate + stiffness * error - drift[k]
        write_equality(lower, upper, row + i, b)
