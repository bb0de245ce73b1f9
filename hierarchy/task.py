"""Task: what is asked, as rows of Jacobian, drift and reference dynamics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, check_rows

if TYPE_CHECKING:
    from hierarchy.robot import State

Level = Literal["velocity", "acceleration"]
Kind = Literal["equality", "inequality"]


class Task(ABC):
    """m rows asked of the joints: J v = dp/dt, or J a + dJ/dt v = d2p/dt2.

    A task of one's own needs `dimension`, `error`, `jacobian` and `jacobian_derivative`; the rest
    follows. The closed loop is, with the error e = p_d - p (equations (7), (12) and reference
    [19] of the letter):

    - velocity level: dp/dt = dp_d/dt + gain e
    - acceleration level: d2p/dt2 = d2p_d/dt2 + damping (dp_d/dt - J v) + stiffness e

    An equality asks for this value, an inequality for at least this value (rows that ask for at
    most a value are written with the opposite sign).

    Attributes
    ----------
    name : the task's name in stacks and messages.
    dimension : number of rows m.
    kind : "equality" or "inequality".
    stiffness [1/s^2], damping [1/s], gain [1/s] : closed-loop gains.
    """

    name: str
    kind: Kind = "equality"
    stiffness: float = 0.0
    damping: float = 0.0
    gain: float = 0.0

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Number of rows m."""

    @abstractmethod
    def error(self, state: State) -> Array:
        """Error p_d - p at a state: (m,), in the task's unit."""

    @abstractmethod
    def jacobian(self, state: State) -> Array:
        """Jacobian J = dp/dq at a state: (m, n)."""

    @abstractmethod
    def jacobian_derivative(self, state: State) -> Array:
        """Time derivative of the Jacobian at a state: (m, n)."""

    def desired_velocity(self, state: State) -> Array:
        """Feedforward dp_d/dt: (m,), zero unless the task says otherwise."""
        return np.zeros(self.dimension)

    def desired_acceleration(self, state: State) -> Array:
        """Feedforward d2p_d/dt2: (m,), zero unless the task says otherwise."""
        return np.zeros(self.dimension)

    def reference_velocity(self, state: State) -> Array:
        """Task velocity asked for at velocity level: (m,)."""
        return self.desired_velocity(state) + self.gain * self.error(state)

    def reference_acceleration(self, state: State) -> Array:
        """Task acceleration asked for at acceleration level: (m,)."""
        rate = self.desired_velocity(state) - self.jacobian(state) @ state.v
        return (self.desired_acceleration(state) + self.damping * rate
                + self.stiffness * self.error(state))

    def write(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
              row: int) -> None:
        """Write this task's rows into A (m_all, n), lower, upper (m_all,) from `row` on.

        This general form calls the methods above; tasks override it by a compiled kernel. Raises
        HierarchyError, naming task and row, where a method returns the wrong shape or NaN.
        """
        rows = slice(row, row + self.dimension)
        A[rows] = _shaped(self, "jacobian", self.jacobian(state), (self.dimension, state.n))
        if level == "velocity":
            b = self.reference_velocity(state)
        else:
            drift = _shaped(self, "jacobian_derivative", self.jacobian_derivative(state),
                            (self.dimension, state.n)) @ state.v
            b = self.reference_acceleration(state) - drift
        lower[rows] = _shaped(self, "reference", b, (self.dimension,))
        upper[rows] = lower[rows] if self.kind == "equality" else np.inf
        check_rows(f"task {self.name!r}", A[rows], lower[rows], upper[rows])

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """Return what does `write` with these arguments, each time it is called.

        A stack keeps it for as long as the state, and the measurement that the state carries, are
        the same objects.
        """
        return partial(self.write, state, level, A, lower, upper, row)

    def reference_writer(self, state: State, level: Level, out: Array) -> Callable[[], object]:
        """Return what writes the value asked for (m,) into `out`, each time it is called."""
        asked = (self.reference_acceleration if level == "acceleration"
                 else self.reference_velocity)

        def write() -> None:
            out[:] = asked(state)

        return write


class BoundTask(Task):
    """A task whose rows are written by a kernel bound to all its arrays. Abstract."""

    @abstractmethod
    def bind_rows(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
                  row: int) -> Callable[[], object]:
        """Return what writes the rows there, each time it is called; see `Task.writer`."""

    def write(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
              row: int) -> None:
        """See `Task.write`; a single call takes long, for the kernel is bound first."""
        self.bind_rows(state, level, A, lower, upper, row)()

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; a subclass that overrides `write` is asked for that."""
        of_rows = (state, level, A, lower, upper, row)
        mine = type(self).write is BoundTask.write
        return self.bind_rows(*of_rows) if mine else super().writer(*of_rows)


def _shaped(task: Task, what: str, value: Array, shape: tuple[int, ...]) -> Array:
    array = np.asarray(value, dtype=float)
    if array.shape != shape:
        raise HierarchyError(f"task {task.name!r}: {what} has shape {array.shape}, "
                             f"expected {shape}")
    return array
