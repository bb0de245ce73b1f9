"""Obstacle avoidance: of the nearest control point (28), (29), of all of them, by joint bounds.

`DangerBounds` slows joints that move toward an obstacle. A control point at distance D [m] from its
nearest obstacle, r being the direction away from it, has the danger

    f(D) = g(D) / g(0),  g(D) = 1 / (1 + exp((2 D / reach - 1) shape))

which is 1 at contact and near 0 from `reach` on. For each joint with velocity limit V that supports
the point, one bound is tightened: the next velocity w satisfies w <= V (1 - f) where the joint's
column of r^T J_c is negative and w >= -V (1 - f) where it is positive; a column of at most `lever`
[m] tightens neither. The greatest danger of all points counts. At acceleration level w = v + a T,
with the horizon of the limits in place of T if it is longer; a joint beyond such a bound brakes as
hard as its limits allow, or gradually within the horizon. Braking is never forbidden.

Once the joints are within these bounds, a point approaches an obstacle at rest at most at (1 - f)
times the sum of V |r^T J_c| over the joints, which is zero at contact. The task does not push away
and does not retreat from an approaching obstacle. At acceleration level `reach` must leave room to
brake. A bound jumps where a column changes sign, and f considers only the nearest obstacle of each
point.

Source: Flacco, Kroeger, De Luca, Khatib, "A depth space approach to human-robot collision
avoidance", ICRA 2012, reference [10] of the letter; there f is g, which leaves exp(-shape) of the
velocity at contact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from hierarchy.avoidance.body import ControlPoint, pack_points
from hierarchy.avoidance.laws import repulsion
from hierarchy.errors import HierarchyError, expect
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    add_row,
    dot,
    moving_point,
    place,
    write_identity,
    write_point_jacobian,
)
from hierarchy.limits import clipped
from hierarchy.measured import Measure, Measured, measured
from hierarchy.problem import Array
from hierarchy.records import NotNegative, Positive
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, Written, in_turn, seen_by
from hierarchy.tasks.joints.joint_limits import JointLimits
from hierarchy.tasks.joints.posture import JointTask


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

    @property
    def dimension(self) -> int:
        """One row or three."""
        return self.rows

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`; the error is the repulsion [m/s^2 or m/s]."""
        return _avoidance, (*pack_points(self.points), seen_by(self, state, self.points).arrays)


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
    lever: Annotated[Positive, "m"] = 0.05
    name: str = "cumulated repulsion"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base is not None:
            expect(f"task {self.name!r}: base", self.base, Task, "give a task such as Posture")
            self.refuse(self.base.dimension != self.joints, f"{self.base.name!r} has "
                        f"{self.base.dimension} rows, expected {self.joints}")

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        self.check_size(state)
        below = bind(write_identity, rows.A) if self.base is None else (
            self.base.writer(state, level, rows))
        parameters = (*pack_points(self.points), self.within, self.lever, level == "acceleration",
                      np.empty(state.n))
        seen = seen_by(self, state, self.points)
        add = bind(_add, state.kinematics, parameters, seen.arrays, rows.lower, rows.upper)
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


@dataclass(frozen=True)
class DangerBounds(Written):
    """Keep every joint within `limits` and slow those that move a control point to an obstacle.

    n rows, those of `limits`, with a box that is at most as large and never empty; see the module
    for how danger tightens it.

    limits : the box without obstacles; every joint must have a velocity limit.
    points : the control points in the order of the measurement; with those of the sensor, the end
        effector is the last of them.
    reach : distance [m] from which on the danger is near 0.
    shape : steepness of the danger.
    lever : column of r^T J_c [m] below which a joint is not slowed.

    Raises HierarchyError if a joint has no velocity limit, there is no point, or a number is out
    of range.
    """

    limits: JointLimits
    points: Sequence[ControlPoint]
    reach: Annotated[Positive, "m"] = 0.4
    shape: Positive = 6.0
    lever: Annotated[NotNegative, "m"] = 1e-9
    name: str = "danger bounds"
    kind = "inequality"

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"task {self.name!r}: limits", self.limits, JointLimits, "give a JointLimits task")
        self.refuse(self.limits.robot.base == "floating", f"robot {self.limits.robot.name!r} has "
                    "a floating base, whose speed no joint bounds")
        for (i,) in np.argwhere(~np.isfinite(self.limits.robot.velocity_limit))[:1]:
            raise HierarchyError(f"task {self.name!r}: joint {self.limits.robot.velocity_names[i]} "
                                 "has no velocity limit to scale")

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return self.limits.row_names

    def box(self, state: State, level: Level) -> tuple[Array, Array]:
        """Return the least and greatest command (n,), (n,) at a state; the box is never empty."""
        return self.rows(state, level)[1:]

    def error(self, state: State) -> Array:
        """Distance of each joint from its range (n,) [rad or m], zero inside it."""
        return self.limits.error(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; the rows have two sides."""
        seen = seen_by(self, state, self.points)
        parameters = (*pack_points(self.points), self.reach, self.shape, self.lever,
                      self.limits.limits.packed[2], max(self.limits.period, self.limits.horizon),
                      level == "acceleration")
        return in_turn(self.limits.writer(state, level, rows), bind(
            _tighten, state.kinematics, parameters, seen.arrays, rows.lower, rows.upper))


@compiled
def _tighten(kinematics, parameters, seen, lower, upper):
    """Tighten the bounds of a box of n joints."""
    # V are the velocity limits, T the period, or the horizon.
    joints, offsets, reach, shape, lever, V, T, acceleration = parameters
    v, n = kinematics.v, len(kinematics.v)
    danger, away = np.zeros((2, n)), np.empty(n)  # of moving backward, and forward; r^T J_c
    contact = repulsion(0.0, 1.0, reach, shape, 2.0)
    for k in range(len(joints)):
        joint, r = joints[k], seen.direction[k]
        f = min(repulsion(max(seen.distance[k], 0.0), 1.0, reach, shape, 2.0) / contact, 1.0)
        away[:] = 0.0
        add_row(kinematics, joint, place(kinematics.placements[joint], offsets[k]), r, away)
        for c in range(n):
            if away[c] > lever:
                danger[0, c] = max(danger[0, c], f)
            elif away[c] < -lever:
                danger[1, c] = max(danger[1, c], f)
    for c in range(n):
        low, up = -V[c] * (1.0 - danger[0, c]), V[c] * (1.0 - danger[1, c])
        if acceleration:
            low, up = (low - v[c]) / T, (up - v[c]) / T
        least, most = lower[c], upper[c]
        lower[c], upper[c] = clipped(low, least, most), clipped(up, least, most)
