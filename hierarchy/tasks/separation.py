"""Separation: one-sided rows that keep all points away from all obstacles.

With d the distance of a pair, r the direction and o the obstacle, a row is (see `Barrier` for the
required dh/dt and d2h/dt2)

    velocity level       r^T J_c v >= required dh/dt + r . v_o
    acceleration level   r^T J_c a >= required d2h/dt2 + r . a_o - r^T dJ_c/dt v - bend

where bend = |w|^2 / radius is what the turning of r adds to d2d/dt2, with w the relative velocity
across r, and the radius and the axis without turning from `Pairs`. It is never negative for a
convex obstacle that does not rotate, so a sensor that does not know the radius may omit it; but
then a point that swings around an obstacle at a constant distance has a row that no acceleration
can satisfy. The radius is taken as at least d_min. The derivative of J_c is exact or a backward
difference, as in the state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.avoidance.barrier import (
    Barrier,
    drop_rounding,
    least_acceleration,
    least_rate,
)
from hierarchy.avoidance.control_points import ControlPoint, pack_points
from hierarchy.avoidance.measurement import Pairs
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import add_row, dot, less, moving_point, place
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Kind, Level, NamedRows, Rows, Writer, Written

_SHARPEST = 1e-3  # [m] smallest radius of turning that is used


@dataclass(frozen=True)
class Separation(NamedRows, Written):
    """Keep every point at `barrier.distance` or more from every obstacle (m = points x obstacles).

    `points` are those of the sensor in its order, the end effector last; `obstacles` is how many
    the measurement has. With None there is one row per point, for the obstacle nearest to it: fewer
    rows, but when another obstacle becomes the nearest, nothing has slowed its approach before. A
    pair beyond `barrier.influence` has a row without bounds, which has no effect. See the module
    for the rows.
    """

    points: Sequence[ControlPoint]
    barrier: Barrier
    obstacles: int | None = None
    name: str = "separation"
    kind: Kind = "inequality"

    @property
    def row_names(self) -> tuple[str, ...]:
        """The point of each row, and its obstacle, numbered from 0 as in a scenario file."""
        if self.obstacles is None:
            return tuple(point.name for point in self.points)
        return tuple(f"{point.name} to obstacle {j}" for point in self.points
                     for j in range(self.obstacles))

    def error(self, state: State) -> Array:
        """distance - d (m,) [m], positive where a point is too close."""
        return np.asarray(self.barrier.distance - self._pairs(state)[:, 0])

    def desired_velocity(self, state: State) -> Array:
        """r . v_o (m,) [m/s]."""
        pairs = self._pairs(state)
        return np.asarray((pairs[:, 1:4] * pairs[:, 4:7]).sum(axis=1))

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        parameters = (*pack_points(self.points), self.barrier.packed(), self.obstacles is None,
                      level == "acceleration")
        return bind(_write, state.kinematics, parameters, self._seen(state).table, *rows)

    def _pairs(self, state: State) -> Array:
        """The pair of each row (m, 14)."""
        table = self._seen(state).table
        if self.obstacles is None:
            return np.asarray(table[np.arange(len(table)), table[..., 0].argmin(axis=1)])
        return table.reshape(-1, table.shape[2])

    def _seen(self, state: State) -> Pairs:
        seen = None if state.measurement is None else state.measurement.pairs
        if seen is None:
            raise HierarchyError(f"task {self.name!r}: the state carries no measurement of pairs")
        points, obstacles, _ = seen.table.shape
        fits = obstacles > 0 if self.obstacles is None else obstacles == self.obstacles
        if points != len(self.points) or not fits:
            raise HierarchyError(
                f"task {self.name!r}: {points} points are measured against {obstacles} obstacles, "
                f"expected {len(self.points)} against {self.obstacles or 'one at least'}")
        return seen


@compiled
def _write(kinematics, parameters, pairs, A, lower, upper):
    joints, offsets, settings, nearest, acceleration = parameters
    row, distance, influence = 0, settings[0], settings[2]
    for k in range(joints.size):
        joint = joints[k]
        point = place(kinematics.placements[joint], offsets[k])
        velocity, drift, _ = moving_point(kinematics, joint, offsets[k])
        first, end = 0, pairs.shape[1]
        if nearest:
            for j in range(1, end):
                if pairs[k, j, 0] < pairs[k, first, 0]:
                    first = j
            end = first + 1
        for j in range(first, end):
            pair = pairs[k, j]
            r = pair[1:4]
            A[row, :] = 0.0
            add_row(kinematics, joint, point, r, A[row])
            drop_rounding(A[row])
            lower[row], upper[row] = -np.inf, np.inf
            h = pair[0] - distance
            if pair[0] <= influence and acceleration:
                w = less(velocity, pair[4:7])
                rate, straight = dot(r, w), dot(pair[10:13], w)
                across = dot(w, w) - rate * rate - straight * straight
                bend = max(across, 0.0) / max(pair[13], distance, _SHARPEST)
                lower[row] = (least_acceleration(h, rate, bend, settings)
                              + dot(r, less(pair[7:10], drift)))
            elif pair[0] <= influence:
                lower[row] = least_rate(h, settings) + dot(r, pair[4:7])
            row += 1
