"""Tasks, limits and barriers of pink (pin-pink, extra `adapters`) in a stack or a hierarchy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hierarchy.errors import HierarchyError, number, positive
from hierarchy.gate import check_rows
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer
from solvers.adapters import displacements
from solvers.adapters.displacements import Packed, Pull, Solve, Tasks

if TYPE_CHECKING:
    from pink import Configuration
    from pink.barriers import Barrier
    from pink.limits import Limit


@dataclass(frozen=True)
class PinkTask(Task):
    """A task of pink as an equality at velocity level: J v = -gain e / period.

    task : a task of pink with its target set; its rows are multiplied by its costs, and rows with
        zero cost are left out.
    configuration : a pink configuration with the joints of the stack's robot, such as
        `pink.Configuration(robot.model, robot.model.createData(), q)`. It follows the State; tasks
        may share it.
    period : time [s] in which a gain of 1 reaches the target in pink.

    In terms of `Task`: p is pink's error times the costs, p_d is zero. Raises HierarchyError for
    lm_damping, which has no meaning in a strict level, for another robot, and at acceleration
    level, which pink does not support.
    """

    task: displacements.Task
    configuration: Configuration
    period: float
    name: str = ""
    rows: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.name:
            set_frozen(self, name=displacements.label(self.task))
        positive(f"task {self.name!r}: period [s]", self.period)
        set_frozen(self, rows=len(displacements.residual(self.task, self.configuration)[1]))

    @property
    def gain(self) -> float:  # type: ignore[override]
        """Pink's gain in [1/s]."""
        return float(self.task.gain) / self.period

    @property
    def dimension(self) -> int:
        """Number of rows with a nonzero cost."""
        return self.rows

    def error(self, state: State) -> Array:
        """Return minus pink's error, times the costs: (m,)."""
        return self._residual(state)[1]

    def jacobian(self, state: State) -> Array:
        """Return pink's Jacobian, times the costs: (m, n)."""
        return self._residual(state)[0]

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; a call asks pink once."""
        if level == "acceleration":
            self.jacobian_derivative(state)

        def write() -> None:
            J, r = self._residual(state)
            if len(r) != self.rows:
                raise HierarchyError(f"task {self.name!r}: {len(r)} of its rows cost something, "
                                     f"{self.rows} did when it was created; create it again")
            rows.A[:] = J
            rows.lower[:] = rows.upper[:] = self.gain * r
            check_rows(f"task {self.name!r}", *rows)

        return write

    def jacobian_derivative(self, state: State) -> Array:
        """Raise a HierarchyError: pink does not provide it."""
        raise HierarchyError(f"task {self.name!r}: pink does not support accelerations; use "
                             "it in a stack of level 'velocity'")

    def _residual(self, state: State) -> tuple[Array, Array]:
        """Return the rows with pink's configuration at the joint angles of the state."""
        configuration, robot = self.configuration, state.robot
        theirs = tuple(configuration.model.names)[1:]
        if theirs != robot.joint_names or configuration.model.nq != robot.nq:
            raise HierarchyError(f"task {self.name!r}: its configuration has the joints "
                                 f"{', '.join(theirs)}; the robot has "
                                 f"{', '.join(robot.joint_names)}")
        if not np.array_equal(configuration.q, state.q):
            configuration.update(state.q)
        return displacements.residual(self.task, configuration)


def hierarchy(configuration: Configuration,
              tasks: Tasks, dt: float, limits: Iterable[Limit] | None = None,
              barriers: Iterable[Barrier] | None = None,
              constraints: Iterable[displacements.Task] | None = None,
              damping: float | None = None, solve: Solve | None = None) -> Hierarchy:
    """Return the problem of `pink.build_ik` as levels: limits, constraints, then the tasks.

    The unknown is the velocity (n,); dt [s]. The order of `tasks` is their priority; an entry may
    be a sequence of tasks that share a level, weighted by their costs. Without `limits` those of
    the model are used, as in pink. Barriers are rows of the level of limits.

    damping : None for exact levels. With a number, a level minimises pink's cost of its tasks
        within the levels above: damping, a task's lm_damping and a barrier's
        safe_displacement_gain weigh the step, and are n rows more in the last level.
    solve : returns the x (n,) of a hierarchy; needed if a level before the last one is damped,
        since it keeps what it reaches.

    Raises HierarchyError: limits of a joint that contradict each other (ContradictionError);
    without `damping`, for lm_damping and safe_displacement_gain: both are weights against all
    tasks, which exact levels have no place for.
    """
    return packed(configuration, tasks, dt, limits, barriers, constraints, damping,
                  solve).hierarchy()


def packed(configuration: Configuration, tasks: Tasks, dt: float, limits: Iterable[Limit] | None,
           barriers: Iterable[Barrier] | None, constraints: Iterable[displacements.Task] | None,
           damping: float | None, solve: Solve | None) -> Packed:
    """Return the levels of `hierarchy`, which takes the same arguments, as they were packed."""
    given, model = list(barriers or ()), configuration.model
    if limits is None:
        shipped = (model.configuration_limit, model.velocity_limit,
                   getattr(model, "floating_base_velocity_limit", None))
        limits = [limit for limit in shipped if limit is not None]
    found = [(type(one).__name__, one.compute_qp_inequalities(configuration, dt))
             for one in (*limits, *given)]
    pull = None if damping is None else Pull(damping, np.zeros(model.nv))
    for barrier in given:
        if not barrier.safe_displacement_gain:
            continue
        if pull is None:
            raise HierarchyError(f"{type(barrier).__name__}: safe_displacement_gain = "
                                 f"{barrier.safe_displacement_gain:g} weighs a displacement "
                                 "against the tasks; set it to 0")
        H, c = barrier.compute_qp_objective(configuration)  # H = weight I, c = -weight dq_safe
        weight = pull.weight + number(f"{type(barrier).__name__}: safe_displacement_gain / |J|^2",
                                      H[0, 0], 0.0)
        centre = pull.weight * pull.centre - c / dt
        pull = Pull(weight, centre / weight if weight > 0.0 else pull.centre)
    return Packed(configuration, partial(_joints, model), model.nv, dt,
                  [(name, *pair) for name, pair in found if pair is not None],
                  list(constraints or ()), tasks, pull, solve=solve)


def _joints(model: Any) -> list[str]:
    """Return the joint of each velocity (nv,), numbered where it has several."""
    return [f"{name} {i + 1}" if joint.nv > 1 else str(name)
            for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
            for i in range(joint.nv)]
