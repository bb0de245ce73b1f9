"""Obstacle avoidance by a control point of the body: 3-D (28), or relaxed to one row (29)."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance.control_points import ControlPoint, pack_points
from hierarchy.avoidance.measurement import Measurement
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    add_row,
    drift_of_point,
    place,
    write_equality,
    write_point_jacobian,
    write_point_jacobian_derivative,
)
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.state import State
from hierarchy.task import Level, Task


@dataclass(frozen=True)
class Avoidance(Task):
    """Push the active control point of the measurement away from the nearest obstacle.

    With rows = 3 the acceleration of the point equals the repulsive vector, eqs. (27)-(28). With
    rows = 1 its component along the direction of repulsion equals the magnitude, eq. (29). At
    velocity level the vector is a velocity. With one row the derivative is r^T dJ_c/dt, with the
    direction held constant, because (29) projects an acceleration and does not differentiate a
    distance.

    `points` are the control points in the order of the measurement; the task acts on
    `measurement.active`, or on the first point while that is -1.
    """

    points: Sequence[ControlPoint]
    rows: Literal[1, 3] = 1
    name: str = "avoidance"
    joints: NDArray[np.int64] = field(init=False, repr=False, compare=False)
    offsets: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rows not in (1, 3):
            raise HierarchyError(f"task {self.name!r}: rows must be 1 or 3, got {self.rows}")
        if not self.points:
            raise HierarchyError(f"task {self.name!r}: needs at least one control point")
        joints, offsets = pack_points(self.points)
        set_frozen(self, joints=joints, offsets=offsets)

    @property
    def dimension(self) -> int:
        """One row or three."""
        return self.rows

    def error(self, state: State) -> Array:
        """The repulsion (rows,) [m/s^2 or m/s]; this task has no target position."""
        seen, k = self._seen(state)
        r = seen.magnitude[k]
        return np.array([r]) if self.rows == 1 else np.asarray(r * seen.direction[k])

    def jacobian(self, state: State) -> Array:
        """J_c (3, n) of the active point, or r^T J_c (1, n)."""
        seen, k = self._seen(state)
        J = np.empty((3, state.n))
        write_point_jacobian(state.J, state.placements, state.supports, int(self.joints[k]),
                             self.offsets[k], J, 0)
        return J if self.rows == 3 else seen.direction[k][None] @ J

    def jacobian_derivative(self, state: State) -> Array:
        """dJ_c/dt (3, n) of the active point, or r^T dJ_c/dt (1, n)."""
        seen, k = self._seen(state)
        dJ = np.empty((3, state.n))
        write_point_jacobian_derivative(state.kinematics, int(self.joints[k]), self.offsets[k], dJ)
        return dJ if self.rows == 3 else seen.direction[k][None] @ dJ

    def reference_velocity(self, state: State) -> Array:
        """The repulsion as a velocity (rows,) [m/s]."""
        return self.error(state)

    def reference_acceleration(self, state: State) -> Array:
        """The repulsion as an acceleration (rows,) [m/s^2], eqs. (28)-(29)."""
        return self.error(state)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        seen, k = self._seen(state)
        parameters = _Parameters(self.joints, self.offsets, level == "acceleration", self.rows)
        write_rows = bind(_write, state.kinematics, parameters, seen.arrays, A, lower, upper, row,
                          then=(k,))
        return lambda: write_rows(seen.active)

    def _seen(self, state: State) -> tuple[Measurement, int]:
        if state.measurement is None:
            raise HierarchyError(f"task {self.name!r}: the state carries no measurement")
        return state.measurement, max(state.measurement.active, 0)


class _Parameters(NamedTuple):
    joints: NDArray[np.int64]
    offsets: Array
    acceleration: bool
    rows: int


@compiled
def _write(kinematics, parameters, seen, A, lower, upper, row, active):
    k = max(active, 0)
    joint, offset = parameters.joints[k], parameters.offsets[k]
    r, magnitude = seen.direction[k], seen.magnitude[k]
    J, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    ax = ay = az = 0.0
    if parameters.acceleration:
        _, _, _, ax, ay, az, _, _, _ = drift_of_point(kinematics, joint, offset[0], offset[1],
                                                      offset[2])
    if parameters.rows == 3:
        write_point_jacobian(J, placements, supports, joint, offset, A, row)
        write_equality(lower, upper, row, magnitude * r[0] - ax)  # (28)
        write_equality(lower, upper, row + 1, magnitude * r[1] - ay)
        write_equality(lower, upper, row + 2, magnitude * r[2] - az)
        return
    point = place(placements[joint], offset[0], offset[1], offset[2])
    for c in range(A.shape[1]):
        A[row, c] = 0.0
    add_row(J, supports, joint, point, (r[0], r[1], r[2]), A, row)
    write_equality(lower, upper, row,
                   magnitude - (r[0] * ax + r[1] * ay + r[2] * az))  # (29)
