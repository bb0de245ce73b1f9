"""Obstacle avoidance: of the nearest control point, 3-D (28) or one row (29), or of all at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hierarchy.avoidance.control_points import ControlPoint, pack_points
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    add_row,
    dot,
    moving_point,
    place,
    write_identity,
    write_point_jacobian,
)
from hierarchy.measured import Measure, Measured, measured
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, in_turn, seen_by
from hierarchy.tasks.posture import JointTask


@measured
def _avoidance(kinematics, reads, goal, J, motion):
    joints, offsets, seen = reads
    k = max(seen.active[0], 0)
    joint, offset, r, magnitude = joints[k], offsets[k], seen.direction[k], seen.magnitude[k]
    velocity, drift, _ = moving_point(kinematics, joint, offset)
    if len(motion.error) == 3:  # (28)
        write_point_jacobian(kinematics, joint, offset, J)
        for i in range(3):
            motion.error[i] = magnitude * r[i]
            motion.rate[i], motion.drift[i] = velocity[i], drift[i]
        return
    add_row(kinematics, joint, place(kinematics.placements[joint], offset), r, J[0])
    motion.error[0], motion.rate[0] = magnitude, dot(r, velocity)
    motion.drift[0] = dot(r, drift)  # (29)


@dataclass(frozen=True)
class Avoidance(Measured):
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
    stiffness = gain = 1.0  # the error is the command at both levels

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rows not in (1, 3):
            raise HierarchyError(f"task {self.name!r}: rows must be 1 or 3, got {self.rows}")

    @property
    def dimension(self) -> int:
        """One row or three."""
        return self.rows

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`; the error is the repulsion [m/s^2 or m/s]."""
        return _avoidance, (*pack_points(self.points), seen_by(self, state).arrays)


@dataclass(frozen=True)
class CumulatedRepulsion(JointTask):
    """Push every control point within a distance away, as the null-space reference of a stack.

    Each control point nearer than `within` asks for the joint command of its own avoidance task
    (29), J_n^T (r - dJ_n/dt v) / max(|J_n|^2, lever^2), and the commands are added up; `base` is
    the null-space term to which they are added. No point is certain to get what it asks for: the
    commands add up in any direction, and the tasks of the stack take what they need first.

    joints : number of joints n. points : the control points in the order of the measurement.
    within : distance [m]. lever : length of J_n [m] below which it no longer enlarges the command.

    Source: reference [5] of the letter, as the letter's introduction describes it; there the
    commands are velocities. At velocity level r is a velocity, without dJ_n/dt v.
    """

    joints: int
    points: Sequence[ControlPoint]
    within: float
    base: Task | None = None
    lever: float = 0.05
    name: str = "cumulated repulsion"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.lever > 0.0:
            raise HierarchyError(f"task {self.name!r}: lever {self.lever} m must be positive")
        if self.base is not None and self.base.dimension != self.joints:
            raise HierarchyError(f"task {self.name!r}: {self.base.name!r} has "
                                 f"{self.base.dimension} rows, expected {self.joints}")

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        self.check_size(state)
        below = bind(write_identity, rows.A) if self.base is None else (
            self.base.writer(state, level, rows))
        parameters = (*pack_points(self.points), self.within, self.lever, level == "acceleration",
                      np.empty(state.n))
        add = bind(_add, state.kinematics, parameters, seen_by(self, state).arrays, rows.lower,
                   rows.upper)
        return in_turn(lambda: rows.lower.fill(0.0), below, add)


@compiled
def _add(kinematics, parameters, seen, lower, upper):
    """Add each point's command to the n equalities."""
    bodies, offsets, within, lever, acceleration, row = parameters
    n = len(row)
    for k in range(len(bodies)):
        if not seen.distance[k] <= within:
            continue
        body, offset, r, asked = bodies[k], offsets[k], seen.direction[k], seen.magnitude[k]
        if acceleration:
            _, drift, _ = moving_point(kinematics, body, offset)
            asked -= dot(r, drift)
        row[:] = 0.0
        add_row(kinematics, body, place(kinematics.placements[body], offset), r, row)
        square = 0.0
        for c in range(n):
            square += row[c] * row[c]
        for c in range(n):
            lower[c] += row[c] * asked / max(square, lever * lever)
    for c in range(n):
        upper[c] = lower[c]
