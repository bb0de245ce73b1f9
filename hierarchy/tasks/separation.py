"""Separation: one-sided rows that keep points from obstacles, and links of the robot apart.

With d the distance of a pair and r its direction, a row is (see `Barrier` for the required dh/dt
and d2h/dt2), of a point and an obstacle o

    velocity level       r^T J_c v >= required dh/dt + r . v_o
    acceleration level   r^T J_c a >= required d2h/dt2 + r . a_o - r^T dJ_c/dt v - bend

where bend = |w|^2 / radius is what the turning of r adds to d2d/dt2, with w the relative velocity
across r, and the radius and the axis without turning from `Pairs`. It is never negative for a
convex obstacle that does not rotate, so a sensor that does not know the radius may omit it; but
then a point that swings around an obstacle at a constant distance has a row that no acceleration
can satisfy. The radius is taken as at least d_min. The derivative of J_c is exact or a backward
difference, as in the state.

Of two links with the nearest points a and b, taken as fixed to their bodies, J_a - J_b is in place
of J_c, and nothing moves by itself. Then r turns and the nearest points slide along the axes, so
that bend may be negative. Where two axes become parallel the nearest points jump, d has a kink, and
bend falls without bound; `barrier.limit` then limits the row, and d may fall below
`barrier.distance` by the motion of one period at velocity level, and by the braking distance with
`limit` at acceleration level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance.body import (
    ON_AXIS,
    Capsule,
    ControlPoint,
    bend_of_nearest,
    measure_capsules,
    nearest_of_capsules,
    on_axis,
    pack_capsules,
    pack_points,
    pairs_of_chain,
    pairs_of_tree,
)
from hierarchy.avoidance.laws import Barrier, drop_rounding, least_acceleration, least_rate
from hierarchy.avoidance.measurement import Pairs
from hierarchy.errors import HierarchyError, expect_each
from hierarchy.gate import array_of
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import add_row, crossed, dot, less, moving_point, place, times, turned
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, Written

_SHARPEST = 1e-3  # [m] smallest radius of turning that is used
_POSTURES = 200   # in which proposed capsules are looked at


@dataclass(frozen=True)
class Separation(Written):
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
    kind = "inequality"

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
        return bind(_write_points, state.kinematics, parameters, self._seen(state).table, *rows)

    def _pairs(self, state: State) -> Array:
        """The pair of each row (m, 14)."""
        table = self._seen(state).table
        if self.obstacles is None:
            return np.asarray(table[np.arange(len(table)), table[..., 0].argmin(axis=1)])
        return table.reshape(-1, table.shape[2])

    def _seen(self, state: State) -> Pairs:
        seen = None if state.measurement is None else state.measurement.pairs
        if seen is None:
            raise HierarchyError(f"task {self.name!r}: the state carries no measurement of pairs; "
                                 "let a sensor measure it first, see docs/loop.md")
        points, obstacles, _ = seen.table.shape
        fits = obstacles > 0 if self.obstacles is None else obstacles == self.obstacles
        self.refuse(points != len(self.points) or not fits, f"{points} points are measured "
                    f"against {obstacles} obstacles, expected {len(self.points)} against "
                    f"{self.obstacles or 'one at least'}")
        return seen


@compiled
def _write_points(kinematics, parameters, pairs, A, lower, upper):
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


@dataclass(frozen=True)
class SelfSeparation(Written):
    """Keep pairs of capsules of the robot at `barrier.distance` or more (m = pairs).

    `pairs` are indices of `capsules`; None takes every pair of a chain except neighbours, and
    `SelfSeparation.of` those of a robot, which may have several arms. No sensor is needed. See the
    module for the rows. Axes that cross (d is minus the two radii) have no direction; the row then
    uses z.

    Raises HierarchyError if there is no pair or an index is out of range.
    """

    capsules: Sequence[Capsule]
    barrier: Barrier
    pairs: Sequence[tuple[int, int]] | None = None
    name: str = "self-separation"
    kind = "inequality"
    indices: NDArray[np.int64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        expect_each("capsules", self.capsules, Capsule, "see robot.capsules")
        pairs = array_of(f"task {self.name!r}: pairs", pairs_of_chain(self.capsules)
                         if self.pairs is None else self.pairs)
        count = len(self.capsules)
        self.refuse(not pairs.size, f"no pair among {count} capsules")
        self.refuse(pairs.shape[1:] != (2,), f"pairs have the shape {pairs.shape}, not (m, 2)")
        for i, j in pairs:
            self.refuse(not (i in range(count) and j in range(count) and i != j),
                        f"pair ({i:g}, {j:g}) is no pair among {count} capsules")
        set_frozen(self, indices=np.array(pairs, dtype=np.int64))

    @classmethod
    def of(cls, robot: Robot, barrier: Barrier) -> SelfSeparation:
        """Return the task of the capsules of a robot that can be that far apart.

        See `separable_pairs` for which are left out.
        """
        return cls(robot.capsules, barrier, tuple(separable_pairs(robot, barrier.distance)))

    @property
    def dimension(self) -> int:
        """Number of pairs m."""
        return len(self.indices)

    @property
    def row_names(self) -> tuple[str, ...]:
        """The two capsules of each row."""
        return tuple(f"{self.capsules[i].name} to {self.capsules[j].name}"
                     for i, j in self.indices)

    def distances(self, state: State) -> Array:
        """Distances d (m,) [m], negative where capsules overlap."""
        packed = pack_capsules(self.capsules)
        return np.asarray(measure_capsules(state.placements, *packed, self.indices)[:, 0])

    def error(self, state: State) -> Array:
        """distance - d (m,) [m], positive where two capsules are too close."""
        return self.barrier.distance - self.distances(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        parameters = (*pack_capsules(self.capsules), self.indices, self.barrier.packed(),
                      level == "acceleration")
        return bind(_write_capsules, state.kinematics, parameters, *rows)


@compiled
def _write_capsules(kinematics, parameters, A, lower, upper):
    joints, capsules, pairs, settings, acceleration = parameters
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        a, b = capsules[i], capsules[j]
        T_a, T_b = kinematics.placements[joints[i]], kinematics.placements[joints[j]]
        D, r, s, t = nearest_of_capsules(T_a, a, T_b, b)
        on_a, on_b = on_axis(a, s), on_axis(b, t)
        A[row, :] = 0.0
        add_row(kinematics, joints[i], place(T_a, on_a), r, A[row])
        add_row(kinematics, joints[j], place(T_b, on_b), times(-1.0, r), A[row])
        drop_rounding(A[row])
        lower[row], upper[row] = -np.inf, np.inf
        if D <= settings[2] and acceleration:
            v_a, drift_a, w_a = moving_point(kinematics, joints[i], on_a)
            v_b, drift_b, w_b = moving_point(kinematics, joints[j], on_b)
            v, length, bend = less(v_a, v_b), D + a[6] + b[6], 0.0
            if length >= ON_AXIS:
                u, w = turned(T_a, a[3:6]), turned(T_b, b[3:6])
                bend = bend_of_nearest(length, r, v, (u, crossed(w_a, u), s),
                                       (w, crossed(w_b, w), t))
            lower[row] = (least_acceleration(D - settings[0], dot(r, v), bend, settings)
                          - dot(r, less(drift_a, drift_b)))
        elif D <= settings[2]:
            lower[row] = least_rate(D - settings[0], settings)


def separable_pairs(robot: Robot, distance: float) -> list[tuple[int, int]]:
    """Return the pairs of capsules that can be kept at a distance [m], as indices.

    Neighbours in the tree share a joint and are excluded, and so are pairs that the file excludes.
    Capsules proposed from a file may be too large: of them, pairs that overlap in the robot's own
    posture are excluded too, and those that are nearer than `distance` in every one of 200 sampled
    postures.
    """
    pairs = _watched(robot)
    if robot.table is not None or not pairs:
        return pairs
    packed, at = pack_capsules(robot.capsules), State(robot)
    lower, upper = (np.where(np.isfinite(side), side, turn) for side, turn in
                    zip(robot.position_limits(), (-np.pi, np.pi), strict=True))
    postures = np.random.default_rng(0).uniform(lower, upper, (_POSTURES, robot.n))
    steps = (np.zeros(robot.n), *(postures - robot.vector(robot.rest)))
    seen = np.array([measure_capsules(at.placements, *packed, np.array(pairs))[:, 0]
                     for step in steps
                     if at.move(0.0, robot.integrate(robot.rest, step), np.zeros(robot.n))])
    apart = (seen[0] > 0.0) & (seen.max(axis=0) >= distance)
    return [pair for pair, kept in zip(pairs, apart.tolist(), strict=True) if kept]


def inseparable_pairs(robot: Robot, distance: float) -> list[str]:
    """Return the names of the pairs that `separable_pairs` excludes for their proposed capsules."""
    kept = set(separable_pairs(robot, distance))
    return [f"{robot.capsules[i].name} to {robot.capsules[j].name}"
            for i, j in _watched(robot) if (i, j) not in kept]


def _watched(robot: Robot) -> list[tuple[int, int]]:
    """Return the pairs of capsules on joints that are no neighbours and may not touch."""
    names = ("", *robot.joint_names)
    apart = {frozenset(pair) for pair in robot.apart}
    return [(i, j) for i, j in pairs_of_tree(robot.capsules, robot.parents)
            if frozenset(names[robot.capsules[k].joint] for k in (i, j)) not in apart]
