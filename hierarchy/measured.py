"""Tasks whose error, Jacobian and drift one compiled function measures.

What a task measures is apart from what is asked of it: one kernel, here, makes rows of the measures
of all such tasks, for their gains and at each level.
"""

from abc import abstractmethod
from collections.abc import Callable
from types import FunctionType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import brief
from hierarchy.jit import bind, compiled, inlined
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import Kinematics
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, check_gains, derivative

Measure = tuple[Kernel, Any]  # the function, and what it reads; see `Measured.measure`
_NONE, _EXACT, _DIFFERENCE = 0, 1, 2  # the derivative of the Jacobian
FAINT = 1e-8  # norm of a row of a task over its largest: the default rank_tolerance


class Motion(NamedTuple):
    """What a measure writes beside the Jacobian, (m,) each and zero before.

    The error p_d - p, the rate J v, its drift dJ/dt v with the exact dJ/dt, and a `push` that is
    added to the reference at both levels.
    """

    error: Array
    rate: Array
    drift: Array
    push: Array


class _Asked(NamedTuple):
    """What is asked of a task, and room to measure it; few arrays, because each costs 15 ns a call.

    goal (3, k) is p_d, dp_d/dt and d2p_d/dt2. By row of the task, `settings` (5, m) has stiffness,
    damping and gain, what the upper side is above the lower, and the column of the goal, -1 for
    none. `motion` (8, m) has the `Motion` of this tick and of the one before.
    """

    goal: Array
    settings: Array
    derivative: int  # _NONE, _EXACT or _DIFFERENCE
    motion: Array
    J_before: Array


class Measured(Task):
    """A task that one compiled function measures, for all levels. Abstract.

    A new one needs `dimension` or `row_names`, and `measure`. A task with a `path` follows it: rows
    i of the task and of the path belong together, see `columns`.
    """

    path: Path | None = None
    exact: ClassVar[bool] = False  # derivatives, also where the state has differences

    @abstractmethod
    def measure(self, state: State) -> Measure:
        """Return the function, see `measured`, and what it reads beside the kinematics.

        That is a tuple of numbers and arrays; an array that moves with the state, such as
        `state.q`, is read anew each time.
        """

    @property
    def columns(self) -> NDArray[np.int64]:
        """The coordinate of the goal that each row follows (m,), -1 for a row that follows none."""
        columns = np.arange(self.dimension)
        if self.path is not None:
            columns[3:] = -1
        return columns

    def follow(self, state: State, goal: Array) -> Callable[[float], object] | None:
        """Return a function of t [s] that moves the goal; None where it rests.

        `goal` (3, k), zero before, is for p_d, dp_d/dt and d2p_d/dt2, k three or more `columns`.
        """
        return None if self.path is None else self.path.writer(goal)

    def error_reader(self, state: State) -> Callable[[], Array]:
        """See `Task.error_reader`; each call overwrites the array of the last."""
        read = self._reader(state)
        return lambda: read(state.kinematics)[1].error

    def jacobian(self, state: State) -> Array:
        """Jacobian J = dp/dq at a state: (m, n)."""
        return self._measured(state)[0]

    def jacobian_derivative(self, state: State) -> Array:
        """Time derivative of the Jacobian at a state: (m, n), by differences: to some 1e-9.

        With `State.period` it is a backward difference, unless the task is `exact`.
        """
        if state.period == 0.0 or self.exact:
            return derivative(self, state)
        now = state.kinematics
        before = now._replace(J=now.previous_J, placements=now.previous_placements)
        return np.asarray((self.jacobian(state) - self._measured(state, before)[0]) / state.period)

    def desired_velocity(self, state: State) -> Array:
        """Feedforward dp_d/dt: (m,)."""
        return np.asarray(self._measured(state)[2][1])

    def desired_acceleration(self, state: State) -> Array:
        """Feedforward d2p_d/dt2: (m,)."""
        return np.asarray(self._measured(state)[2][2])

    def reference_velocity(self, state: State) -> Array:
        """Closed loop and push (m,)."""
        return super().reference_velocity(state) + self._measured(state)[1].push

    def reference_acceleration(self, state: State) -> Array:
        """Closed loop and push (m,)."""
        return super().reference_acceleration(state) + self._measured(state)[1].push

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        (function, reads), asked, move_goal = self._asked(state, level)
        write_rows = bind(function, state.kinematics, reads, asked, *rows)
        if move_goal is None:
            return write_rows

        def write() -> None:
            move_goal(state.t)
            write_rows()

        return write

    def _asked(self, state: State, level: Level
               ) -> tuple[Measure, _Asked, Callable[[float], object] | None]:
        """Return what `measure` returns, what is asked, and what moves the goal."""
        found, m = self.measure(state), self.dimension
        function = found[0] if isinstance(found, tuple) and len(found) == 2 else None
        code = getattr(getattr(function, "py_func", function), "__code__", None)
        if code is not _rows.__code__:  # the text takes longer than the rest
            self.refuse(True, f"measure returned {brief(found)}; expected a function under "
                        "@measured or @plain, and a tuple of what it reads")
        settings, width = np.empty((5, m)), np.inf if self.kind == "inequality" else 0.0
        try:
            for row, value in zip(settings, (self.stiffness, self.damping, self.gain, width,
                                             self.columns), strict=True):
                row[:] = np.asarray(value)
        except ValueError:  # to look first takes longer than the rest
            check_gains(self, m)
            raise
        derivative = (_NONE if level == "velocity" else
                      _EXACT if self.exact or state.period == 0.0 else _DIFFERENCE)
        goal = np.zeros((3, 1 + int(max([2.0, *settings[4].tolist()]))))
        asked = _Asked(goal, settings, derivative, np.zeros((8, m)), np.zeros((m, state.n)))
        return found, asked, self.follow(state, goal)

    def _measured(self, state: State, kinematics: Kinematics | None = None
                  ) -> tuple[Array, Motion, Array]:
        """The Jacobian (m, n), the rest of what is measured, and the goal of each row (3, m)."""
        J, motion, goal = self._reader(state)(kinematics or state.kinematics)
        return J, motion, np.asarray(np.hstack([goal, np.zeros((3, 1))])[:, self.columns])

    def _reader(self, state: State) -> Callable[[Kinematics], tuple[Array, Motion, Array]]:
        """Return what `_measured` calls, for a state that moves; each call overwrites the last.

        It gives the goal as kernels read it.
        """
        (function, reads), asked, move_goal = self._asked(state, "velocity")
        J, sides = np.zeros_like(asked.J_before), np.zeros((2, self.dimension))

        def read(kinematics: Kinematics) -> tuple[Array, Motion, Array]:
            if move_goal is not None:
                move_goal(state.t)
            # Called, not bound: to bind takes longer than a call, and most read once.
            function(kinematics, reads, asked, J, *sides)
            return J, Motion(*asked.motion[:4]), asked.goal

        return read


def measured(function: Kernel) -> Kernel:
    """Make of a function that measures a kernel that writes rows, for `Measured.measure`.

    function(kinematics, reads, goal, J, motion) writes J (m, n), zero before, and `Motion`; see
    `Kinematics`. `goal` (3, 3) is p_d, dp_d/dt and d2p_d/dt2 of the path now.
    """
    return compiled(_copy_of_rows(function, _measure=inlined(function)))


def plain(function: Kernel) -> Kernel:
    """Do the same without compiling, for a function of numpy that writes all that it has each time.

    What it reads may be any objects.
    """
    return _copy_of_rows(function, _measure=function, clear=lambda *_: None,
                         close=getattr(close, "py_func", close))


def _copy_of_rows(function: Kernel, **known: Any) -> Kernel:
    """Return a copy of the kernel below with this function, so that both are compiled into one."""
    rows = FunctionType(_rows.__code__, {**globals(), **known, "__name__": function.__module__},
                        function.__name__)
    rows.__module__, rows.__qualname__ = function.__module__, function.__qualname__
    rows.__doc__ = function.__doc__
    return rows


_measure: Any = None  # what a copy of `_rows` calls


def _rows(kinematics, reads, asked, J, lower, upper):
    """Write the rows that a measure makes with what is asked."""
    goal, settings, derivative, room, J_before = asked
    motion = Motion(room[0], room[1], room[2], room[3])
    clear(J, motion)
    _measure(kinematics, reads, goal, J, motion)
    drop_faint(J, lower)
    if derivative == _DIFFERENCE:
        v, _, dJ, _, supports, previous, placements, period = kinematics
        before = Motion(room[4], room[5], room[6], room[7])
        clear(J_before, before)
        # Made here: what a function without reference counts returns, its caller would release.
        _measure(Kinematics(v, previous, dJ, placements, supports, previous, placements, period),
                 reads, goal, J_before, before)
        for i in range(len(lower)):
            motion.drift[i] = (motion.rate[i] - before.rate[i]) / period
    for i in range(len(lower)):
        close(motion, goal, settings, derivative, lower, upper, i)


@inlined
def clear(J, motion):
    """Write zeros."""
    for i in range(J.shape[0]):
        for c in range(J.shape[1]):
            J[i, c] = 0.0
        motion.error[i], motion.rate[i] = 0.0, 0.0
        motion.drift[i], motion.push[i] = 0.0, 0.0


@compiled
def drop_faint(J, square):
    """Write zeros in rows that are rounding beside the largest: what digits of a file leave.

    A resolver cannot tell: turned, such a row is one that depends on the others but for rounding.
    square (m,): scratch.
    """
    largest = 0.0
    for i in range(J.shape[0]):
        square[i] = 0.0
        for c in range(J.shape[1]):
            square[i] += J[i, c] * J[i, c]
        largest = max(largest, square[i])
    for i in range(J.shape[0]):
        if square[i] < FAINT * FAINT * largest:
            for c in range(J.shape[1]):
                J[i, c] = 0.0


@inlined
def close(motion, goal, settings, derivative, lower, upper, i):
    """Write the sides of row i: equations (7) and (12), and (21) for one side."""
    speed, acceleration, k = 0.0, 0.0, int(settings[4, i])
    if k >= 0:
        speed, acceleration = goal[1, k], goal[2, k]
    if derivative == _NONE:
        b = speed + settings[2, i] * motion.error[i]
    else:
        b = (acceleration + settings[1, i] * (speed - motion.rate[i])
             + settings[0, i] * motion.error[i] - motion.drift[i])
    lower[i] = b + motion.push[i]
    upper[i] = lower[i] + settings[3, i]
