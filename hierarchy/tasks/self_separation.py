"""Self-separation: one-sided rows that keep links of the robot apart from each other.

With d the distance of a pair, r its direction, and a, b the nearest points, taken as fixed to their
bodies, a row is (see `Barrier` for the required dh/dt and d2h/dt2)

    velocity level       r^T (J_a - J_b) v >= required dh/dt
    acceleration level   r^T (J_a - J_b) a >= required d2h/dt2 - bend - r^T (dJ_a/dt - dJ_b/dt) v

where bend is the rest of d2d/dt2: r turns and the nearest points slide along the axes. Unlike that
of an obstacle it may be negative. Where two axes become parallel the nearest points jump, d has a
kink, and bend falls without bound; `barrier.limit` then limits the row, and d may fall below
`barrier.distance` by the motion of one period at velocity level, and by the braking distance with
`limit` at acceleration level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance.barrier import (
    Barrier,
    drop_rounding,
    least_acceleration,
    least_rate,
)
from hierarchy.avoidance.self_collision import (
    ON_AXIS,
    Capsule,
    bend_of_nearest,
    measure_capsules,
    nearest_of_capsules,
    on_axis,
    pack_capsules,
    pairs_of_chain,
)
from hierarchy.errors import HierarchyError, expect_each
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    add_row,
    crossed,
    dot,
    less,
    moving_point,
    place,
    times,
    turned,
)
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.state import State
from hierarchy.task import Kind, Level, NamedRows, Rows, Writer, Written


@dataclass(frozen=True)
class SelfSeparation(NamedRows, Written):
    """Keep pairs of capsules of the robot at `barrier.distance` or more (m = pairs).

    `pairs` are indices of `capsules`; None takes every pair of the chain except neighbours. No
    sensor is needed. See the module for the rows. Axes that cross (d is minus the two radii) have
    no direction; the row then uses z.

    Raises HierarchyError if there is no pair or an index is out of range.
    """

    capsules: Sequence[Capsule]
    barrier: Barrier
    pairs: Sequence[tuple[int, int]] | None = None
    name: str = "self-separation"
    kind: Kind = "inequality"
    indices: NDArray[np.int64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        expect_each("capsules", self.capsules, Capsule, "see robot.capsules")
        pairs = pairs_of_chain(self.capsules) if self.pairs is None else self.pairs
        count = len(self.capsules)
        if not pairs:
            raise HierarchyError(f"task {self.name!r}: no pair among {count} capsules")
        for i, j in pairs:
            if not (0 <= i < count and 0 <= j < count and i != j):
                raise HierarchyError(f"task {self.name!r}: pair ({i}, {j}) is no pair among "
                                     f"{count} capsules")
        set_frozen(self, indices=np.array(pairs, dtype=np.int64))

    @property
    def dimension(self) -> int:
        """One row per pair."""
        return len(self.indices)

    @property
    def row_names(self) -> tuple[str, ...]:
        """The two capsules of each row."""
        return tuple(f"{self.capsules[i].name} to {self.capsules[j].name}"
                     for i, j in self.indices)

    def distances(self, state: State) -> Array:
        """Distances d (m,) [m], negative where capsules overlap."""
        return measure_capsules(state.placements, *pack_capsules(self.capsules), self.indices)[:, 0]

    def error(self, state: State) -> Array:
        """distance - d (m,) [m], positive where two capsules are too close."""
        return self.barrier.distance - self.distances(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        parameters = (*pack_capsules(self.capsules), self.indices, self.barrier.packed(),
                      level == "acceleration")
        return bind(_write, state.kinematics, parameters, *rows)


@compiled
def _write(kinematics, parameters, A, lower, upper):
    joints, capsules, pairs, settings, acceleration = parameters
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        a, b = capsules[i], capsules[j]
        T_a, T_b = kinematics.placements[joints[i]], kinematics.placements[joints[j]]
        seen = nearest_of_capsules(T_a, a, T_b, b)
        D, r, s, t = seen
        A[row, :] = 0.0
        add_row(kinematics, joints[i], place(T_a, on_axis(a, s)), r, A[row])
        add_row(kinematics, joints[j], place(T_b, on_axis(b, t)), times(-1.0, r), A[row])
        drop_rounding(A[row])
        lower[row], upper[row] = -np.inf, np.inf
        if D <= settings[2]:
            if acceleration:
                rate, drift, bend = _motion(kinematics, joints, capsules, i, j, seen)
                lower[row] = least_acceleration(D - settings[0], rate, bend, settings) - drift
            else:
                lower[row] = least_rate(D - settings[0], settings)


@compiled
def _motion(kinematics, joints, capsules, i, j, seen):
    """dd/dt, r^T (dJ_a/dt - dJ_b/dt) v and bend of one pair."""
    D, r, s, t = seen
    a, b = capsules[i], capsules[j]
    v_a, drift_a, w_a = moving_point(kinematics, joints[i], on_axis(a, s))
    v_b, drift_b, w_b = moving_point(kinematics, joints[j], on_axis(b, t))
    v, length = less(v_a, v_b), D + a[6] + b[6]
    rate, drift = dot(r, v), dot(r, less(drift_a, drift_b))
    if length < ON_AXIS:
        return rate, drift, 0.0
    u = turned(kinematics.placements[joints[i]], a[3:6])
    w = turned(kinematics.placements[joints[j]], b[3:6])
    return rate, drift, bend_of_nearest(length, r, v, (u, crossed(w_a, u), s),
                                        (w, crossed(w_b, w), t))
