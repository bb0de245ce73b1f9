"""Repulsion of all control points as one joint command, for the null space of the tasks."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance.control_points import ControlPoint, pack_points
from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import add_row, dot, moving_point, place, triple, write_identity
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Task, seen_by
from hierarchy.tasks.posture import JointTask


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

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        self.check_size(state)
        below = bind(write_identity, A, row, self.joints) if self.base is None else (
            self.base.writer(state, level, A, lower, upper, row))
        sides = lower[row:row + self.joints]
        parameters = _Parameters(*pack_points(self.points), self.within, self.lever,
                                 level == "acceleration", np.empty((1, state.n)))
        add = bind(_add, state.kinematics, parameters, seen_by(self, state).arrays, lower, upper,
                   row)

        def write() -> None:
            if self.base is None:
                sides.fill(0.0)
            below()
            add()

        return write


class _Parameters(NamedTuple):
    bodies: NDArray[np.int64]
    offsets: Array
    within: float
    lever: float
    acceleration: bool
    scratch: Array


@compiled
def _add(kinematics, parameters, seen, lower, upper, row):
    """Add each point's command to the n equalities from `row` on."""
    bodies, offsets, within, lever, acceleration, scratch = parameters
    n = scratch.shape[1]
    for k in range(len(bodies)):
        if not seen.distance[k] <= within:
            continue
        body, offset, r, asked = bodies[k], offsets[k], seen.direction[k], seen.magnitude[k]
        if acceleration:
            _, drift, _ = moving_point(kinematics, body, offset)
            asked -= dot(r, drift)
        point = place(kinematics.placements[body], offset[0], offset[1], offset[2])
        scratch[0, :] = 0.0
        add_row(kinematics.J, kinematics.supports, body, point, triple(r, 0), scratch, 0)
        square = 0.0
        for c in range(n):
            square += scratch[0, c] * scratch[0, c]
        for c in range(n):
            lower[row + c] += scratch[0, c] * asked / max(square, lever * lever)
    for c in range(n):
        upper[row + c] = lower[row + c]
