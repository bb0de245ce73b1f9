"""The mechanism of a robot: joints that follow others, and chains that are closed.

A model of a robot is a tree. What its file says beyond that holds whatever the tasks ask for, so
these rows stand at the top of a stack.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import expect, positive
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, Written, in_turn
from hierarchy.tasks.joints.coupling import FollowedJoints
from hierarchy.tasks.pose import RelativePose
from hierarchy.tasks.together import Together

MECHANISM = "mechanism"  # the name of the rows in a stack
_FASTEST = 50.0          # [1/s] at which an error dies away
_PER_PERIOD = 0.25       # share of it in a period, at most
_INDEPENDENT = 1e-3      # singular value, relative to the largest, of rows that are no rounding
_MOST_STEPS = 100        # to close a mechanism; three take 1 mm to rounding
_EXACT = 1e-13           # [m, rad or their rates] what nothing is done about
_SHORTEST = 1e-12        # [rad or m] step that ends the closing
_LEAST_DAMPING = 1e-4


def model_rows(robot: Robot, period: float = 0.001) -> list[Task]:
    """Return the rows of `robot.coupled` and `robot.loops` as one task, or an empty list.

    A joint that is coupled has one row, a loop the three of a common origin, or six if it is rigid.
    They come first in a stack with commands every `period` [s], whose errors then die away at a
    rate of 50 / s, or a quarter of an error per period if that is slower. At level "torque" the
    accelerations keep the mechanism, and torques of all joints make them: the mechanism itself then
    transmits no force, and every joint needs a motor.
    """
    expect("model_rows: robot", robot, Robot, "give Robot.load(NAME)")
    rate = min(_FASTEST, _PER_PERIOD / positive("model_rows: period [s]", period))
    gains = rate**2, 2.0 * rate, rate
    parts: list[Task] = []
    if robot.coupled:
        parts.append(FollowedJoints(robot, robot.coupled, *gains))
    for loop in robot.loops:
        frame, to = map(robot.frame, loop.frames)
        parts.append(RelativePose(frame, to, (0.0, 0.0, 0.0), np.eye(3) if loop.rigid else None,
                                  *gains, loop.name))
    whole = Together(parts, MECHANISM) if parts else None
    return [] if whole is None else [ClosedChains(whole) if robot.loops else whole]


def bends(robot: Robot) -> bool:
    """Whether a mechanism leaves its tangent: it has a loop, or a polynomial that is no line."""
    return bool(robot.loops) or not all(one.straight for one in robot.coupled)


def above(rows: Sequence[Task], limits: Sequence[Task], anywhere: bool) -> list[Task]:
    """Return the rows of a mechanism above limits, or below them for a resolver of bounds alone.

    Such a one takes bounds in the first level only; `anywhere` says that bounds may be lower.
    """
    return [*rows, *limits] if anywhere else [*limits, *rows]


@final
@dataclass(frozen=True)
class ClosedChains(Written):
    """The rows of `whole` that are independent of each other.

    A chain in a plane closes out of it by itself, but for the rounding of its file. So of all rows,
    each kind of them at a common scale, only singular directions count whose singular value is more
    than 1e-3 of the largest; the other rows are zero. Error and Jacobian are those of `whole`.
    """

    whole: Together
    name: str = MECHANISM

    @property
    def row_names(self) -> tuple[str, ...]:
        """Numbers: a row is a mixture of those of `whole`."""
        return tuple(f"constraint {i + 1}" for i in range(self.whole.dimension))

    def error(self, state: State) -> Array:
        """How far the mechanism is from closed (m,) [m or rad]."""
        return self.whole.error(state)

    def jacobian(self, state: State) -> Array:
        """The derivatives of what is to be closed (m, n)."""
        return self.whole.jacobian(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        whole = Rows.empty(self.dimension, state.n)

        def reduce() -> None:
            V, sizes, c = self.parts(whole.A, whole.lower)
            rows.A[:], rows.lower[:] = 0.0, 0.0
            rows.A[:len(V)], rows.lower[:len(V)] = V, c / sizes
            rows.upper[:] = rows.lower

        return in_turn(self.whole.writer(state, level, whole), reduce)

    def parts(self, J: Array, side: Array) -> tuple[Array, Array, Array]:
        """Return the independent part of rows J x = side, (m, n) and (m,): V, sizes and c.

        It is V x = c / sizes, with V (r, n) orthonormal.
        """
        scale, at = np.ones(len(J)), 0
        for task in self.whole.tasks:
            size = 3 if isinstance(task, RelativePose) else 1  # of one unit: places, or turns
            for first in range(at, at + task.dimension, size):
                rows = slice(first, first + size)
                largest = np.sqrt((J[rows]**2).sum(axis=1).max())
                scale[rows] = 1.0 / largest if largest > _EXACT else 1.0
            at += task.dimension
        U, sizes, V = np.linalg.svd(J * scale[:, None], full_matrices=False)
        kept = sizes > _INDEPENDENT * sizes[0]
        return V[kept], sizes[kept], (U.T @ (scale * side))[kept]


@final
class Mechanism:
    """The mechanism of a robot, to close it at a configuration; for one without it does nothing."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._state = robot, State(robot)
        self._tasks = [task if isinstance(task, ClosedChains) else ClosedChains(task)
                       for task in model_rows(robot) if isinstance(task, ClosedChains | Together)]
        for task in self._tasks:
            # To bind what writes takes 1 ms, to write 1 us: closing a mechanism asks ten times.
            self._made = Rows.empty(task.dimension, robot.n)
            self._write = task.whole.writer(self._state, "velocity", self._made)

    def __bool__(self) -> bool:
        return bool(self._tasks)

    def closed(self, q: ArrayLike, held: Iterable[str] = ()) -> Array:
        """Return the configuration (nq,) near q that the mechanism allows.

        Joints of the names in `held` stay where they are. It is found by the method of Levenberg
        and Marquardt. One that cannot be closed is closed as far as that takes it, see `gap`.
        """
        here = self._robot.normalised(q)
        if not self:
            return here
        fixed = {self._robot.joint(name) for name in held}
        moved, damping = np.array([float(part.joint not in fixed) for part in self._robot.parts
                                   for _ in range(part.velocities)]), 0.0
        J, error = self._rows(here)
        for _ in range(_MOST_STEPS if np.abs(error).max() > _EXACT else 0):
            step = self._solved(J * moved, error, damping)
            if np.abs(step).max() < _SHORTEST:
                break
            there = self._robot.integrate(here, step)
            J_there, error_there = self._rows(there)
            if error_there @ error_there < error @ error:
                here, J, error, damping = there, J_there, error_there, damping / 10.0
            else:
                damping = max(10.0 * damping, _LEAST_DAMPING)
        return here

    def gap(self, q: ArrayLike) -> tuple[float, str]:
        """Return the largest opening at q [m or rad], and its row."""
        if not self:
            return 0.0, ""
        error = np.abs(self._rows(self._robot.normalised(q))[1])
        return float(error.max()), self._tasks[0].whole.row_names[int(error.argmax())]

    def moving(self, q: ArrayLike, v: Array, drives: Array | None = None) -> Array:
        """Return the velocity (n,) nearest to v that it allows at q.

        With the inertia of `drives` (n,) [kg m^2 or kg] it is nearest in kinetic energy, as forces
        of constraint make it: they do no work.
        """
        J = self._rows(self._robot.normalised(q))[0]
        beside = J @ v
        if np.abs(beside).max() <= _EXACT:
            return v
        if drives is None:
            return v - self._solved(J, beside, 0.0)
        V, _, _ = self._tasks[0].parts(J, beside)
        given = np.linalg.solve(self._state.mass_matrix() + np.diag(drives), V.T)
        return np.asarray(v - given @ np.linalg.solve(V @ given, V @ v))

    def bend(self, q: ArrayLike, v: Array, period: float) -> Array:
        """Return what to add to the sides of the first k rows of `model_rows` at q (k,).

        With that the mechanism, which leaves its tangent, is where the rows say after a `period`
        [s] of a velocity v (n,).
        """
        J, error = self._rows(self._robot.normalised(q))
        after = self._rows(self._robot.integrate(q, v * period))[1]
        side = (after - error) / period + J @ v
        _, sizes, c = self._tasks[0].parts(J, side)
        return c / sizes if self._robot.loops else side

    def _rows(self, q: Array) -> tuple[Array, Array]:
        """Jacobian (m, n) and error (m,) at q."""
        self._state.move(0.0, q, self._state.v)
        self._write()
        return self._made.A.copy(), self._made.lower / self._tasks[0].whole.tasks[0].gain

    def _solved(self, J: Array, side: Array, damping: float) -> Array:
        """Return the x (n,) that makes |J x - side|^2 + damping |x|^2 least, at the scales of J."""
        V, sizes, c = self._tasks[0].parts(J, side)
        return np.asarray((c * sizes / (sizes**2 + damping)) @ V)
