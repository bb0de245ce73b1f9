"""Tasks, limits and barriers of pink (pin-pink, extra `adapters`) as ours."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy, check_rows
from hierarchy.state import State
from hierarchy.task import Level, Task
from solvers.adapters import displacements


@dataclass(frozen=True)
class PinkTask(Task):
    """Any task of pink as an equality at velocity level: J v = -gain e / period.

    task : of pink, its target set; its rows are multiplied by its cost, those of cost zero are
        left out, as they weigh nothing in pink either.
    configuration : pink's, of the same joints as the stack's robot, such as
        `pink.Configuration(robot.model, robot.model.createData(), q)`. It follows the State; tasks
        may share it.
    period : [s] in which pink's gain of 1 reaches the target.

    In the words of `Task`: p is pink's error times the costs, p_d zero. Raises HierarchyError for
    lm_damping, which has no meaning in a strict level, for another robot, and at acceleration
    level, of which pink knows nothing.
    """

    task: Any
    configuration: Any
    period: float
    name: str = ""
    rows: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", displacements.label(self.task))
        if not 0.0 < self.period < np.inf:
            raise HierarchyError(f"task {self.name!r}: period {self.period} s must be positive "
                                 "and finite")
        object.__setattr__(self, "rows", len(self._residual()[1]))

    @property
    def gain(self) -> float:  # type: ignore[override]
        """Pink's gain in [1/s]."""
        return float(self.task.gain) / self.period

    @property
    def dimension(self) -> int:
        """Number of rows that cost something."""
        return self.rows

    def error(self, state: State) -> Array:
        """Minus pink's error, times the costs: (m,)."""
        self._follow(state)
        return self._residual()[1]

    def jacobian(self, state: State) -> Array:
        """Pink's Jacobian, times the costs: (m, n)."""
        self._follow(state)
        return self._residual()[0]

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`; a call asks pink once."""
        if level == "acceleration":
            self.jacobian_derivative(state)
        own = slice(row, row + self.rows)

        def write() -> None:
            self._follow(state)
            A[own], r = self._rows()
            lower[own] = upper[own] = self.gain * r
            check_rows(f"task {self.name!r}", A[own], lower[own], upper[own])

        return write

    def _rows(self) -> tuple[Array, Array]:
        J, r = self._residual()
        if len(r) != self.rows:
            raise HierarchyError(f"task {self.name!r}: {len(r)} of its rows cost something, "
                                 f"{self.rows} did when it was made; make it anew")
        return J, r

    def jacobian_derivative(self, state: State) -> Array:
        """Raise HierarchyError: pink has none."""
        raise HierarchyError(f"task {self.name!r}: pink knows nothing of accelerations; put it "
                             "into a stack of level 'velocity'")

    def _residual(self) -> tuple[Array, Array]:
        return displacements.residual(self.task, self.configuration)

    def _follow(self, state: State) -> None:
        """Bring pink's configuration to where the state is, unless it is there."""
        configuration, robot = self.configuration, state.robot
        theirs = tuple(configuration.model.names)[1:]
        if theirs != robot.joint_names or configuration.model.nq != robot.nq:
            raise HierarchyError(f"task {self.name!r}: its configuration has the joints "
                                 f"{', '.join(theirs)}; the robot has "
                                 f"{', '.join(robot.joint_names)}")
        if not np.array_equal(configuration.q, state.q):
            configuration.update(state.q)


def hierarchy(configuration: Any, tasks: Iterable[Any], dt: float,
              limits: Iterable[Any] | None = None, barriers: Iterable[Any] | None = None,
              constraints: Iterable[Any] | None = None) -> Hierarchy:
    """Return what `pink.build_ik` would weigh, as levels: limits, constraints, then the tasks.

    Unknown is the velocity (n,). The order of `tasks` is their priority; an entry may be a list of
    tasks, which share a level and are weighted by their costs. Without `limits` those of the model
    are taken, as in pink; barriers are rows of the same level.

    Raises
    ------
    HierarchyError : lm_damping, or a barrier's safe_displacement_gain, which are weights against
        all else and have no place in a strict order.
    """
    model = configuration.model
    if limits is None:
        of_model = (model.configuration_limit, model.velocity_limit,
                    getattr(model, "floating_base_velocity_limit", None))
        limits = [limit for limit in of_model if limit is not None]
    pairs = [limit.compute_qp_inequalities(configuration, dt) for limit in limits]
    for barrier in barriers or ():
        if barrier.safe_displacement_gain:
            raise HierarchyError(f"{type(barrier).__name__}: safe_displacement_gain = "
                                 f"{barrier.safe_displacement_gain:g} weighs a displacement "
                                 "against the tasks; set it to 0")
        pairs.append(barrier.compute_qp_inequalities(configuration, dt))
    return displacements.hierarchy(configuration, model.nv, dt,
                                   [pair for pair in pairs if pair is not None],
                                   list(constraints or ()), tasks)
