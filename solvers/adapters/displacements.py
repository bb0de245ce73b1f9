"""Common parts of the pink and mink adapters: tasks and limits of the step made in one period.

Both packages define a task by J dq = -gain e and a limit by G dq <= h, with dq = x period. Here x
is the velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy, check_rows
from solvers.adapters.packing import ODD, narrow, write_bounds, write_several, write_task

_NO_DAMPING = 1e-12  # pink's default, a regularisation of its QP that ours does not need

Limit = tuple[Array, Array]  # G (k, n), h (k,)


class Task(Protocol):
    """The part of a task of pink or mink that a level needs; `cost` is optional."""

    gain: float

    def compute_error(self, configuration: Any) -> Array:
        """Return e (k,)."""

    def compute_jacobian(self, configuration: Any) -> Array:
        """Return J (k, n)."""


class Pull(NamedTuple):
    """A weight on the length of the step, as pink adds to its cost, and its centre.

    weight : of |x - centre|^2 next to |W (J x - b)|^2 of a level, in the unit of its rows squared.
    centre : (n,) the velocity to which it pulls.
    """

    weight: float
    centre: Array


def hierarchy(configuration: object, n: int, period: float, limits: Sequence[Limit],
              constraints: Sequence[Task], tasks: Iterable[Task | Sequence[Task]],
              pull: Pull | None = None) -> Hierarchy:
    """Pack limits, constraints and tasks into levels, without the empty ones.

    n unknowns [rad/s or m/s]; period [s]. An entry of `tasks` is a task, or a sequence of tasks
    that share a level, weighted by their costs. Constraints have no cost, as in pink and mink.
    Without `pull` a task's lm_damping is refused; with it, each level asks for no more than its
    own damped step would reach, see `_damped`.
    """
    if not 0.0 < period < np.inf:
        raise HierarchyError(f"period {period} s must be positive and finite")
    entries = [entry if isinstance(entry, Sequence) else [entry] for entry in tasks]
    packed = _Packed(configuration, n, period, pull)
    packed.add_limits([(_plain(G), _plain(h)) for G, h in limits])
    if constraints:
        packed.add("constraints", constraints, weighted=False)
    for together in entries:
        packed.add(" + ".join(map(label, together)), together)
    return packed.hierarchy()


class _Packed:
    """Rows of levels in the order in which they are added."""

    def __init__(self, configuration: object, n: int, period: float, pull: Pull | None) -> None:
        self.configuration, self.n, self.period, self.pull = configuration, n, period, pull
        self.reference = np.zeros(n)
        self.names: list[str] = []
        self.levels: list[tuple[Array, Array, Array]] = []

    def add_limits(self, limits: Sequence[Limit]) -> None:
        """Add the level of limits, if there is one."""
        A, lower, upper = limit_level(limits, self.n, self.period)
        self._keep("limits", A, lower, upper)

    def add(self, name: str, tasks: Sequence[Task], weighted: bool = True) -> None:
        """Add a level of tasks that share it; raises HierarchyError for one that is no rows."""
        read = [_read(task, self.configuration, self.pull is not None, weighted) for task in tasks]
        A = np.empty((sum(len(one.e) for one in read), self.n))
        b, row = np.empty((2, len(A))), 0
        for one, task in zip(read, tasks, strict=True):
            found = write_task(one.J, one.e, one.cost, one.gain / self.period, A, b[0], b[1], row)
            if found == ODD:
                check_rows(label(task), one.J, one.e, one.e)
                raise HierarchyError(f"{label(task)}: its costs {one.cost} or gain {one.gain} are "
                                     "not finite")
            row = found
        A, target = A[:row], b[0, :row]
        if weighted and self.pull is not None:
            target = self._damped(A, target, sum(one.damping for one in read))
        self._keep(name, A, target, target)

    def _damped(self, A: Array, b: Array, own: float) -> Array:
        """Return what A x is for the x that minimises |A x - b|^2 + own |x|^2 + the pull.

        A level that asks for this is met by that x alone, as in pink, and leaves its null space to
        the levels below; a strict level cannot weigh its own step against its target.
        """
        assert self.pull is not None
        weight = own + self.pull.weight
        if weight <= _NO_DAMPING or not len(A):
            return b
        centre = self.pull.weight / weight * self.pull.centre
        self.reference = centre
        there = A @ centre
        square = A @ A.T
        step = np.linalg.solve(square + weight * np.eye(len(A)), b - there)
        return np.asarray(there + square @ step)

    def _keep(self, name: str, A: Array, lower: Array, upper: Array) -> None:
        if len(A):
            again = self.names.count(name)
            self.names.append(f"{name} ({again + 1})" if again else name)
            self.levels.append((A, lower, upper))

    def hierarchy(self) -> Hierarchy:
        """Return the levels; a level is named like another one with a number."""
        if not self.levels:
            return Hierarchy.from_levels([], self.reference)
        A, lower, upper = (np.concatenate(parts) for parts in zip(*self.levels, strict=True))
        sizes = np.array([len(level[0]) for level in self.levels], dtype=np.int64)
        return Hierarchy(A, lower, upper, sizes, self.reference, tuple(self.names))


class _Read(NamedTuple):
    """What a task says: J (k, n), e (k,), cost (k,), gain, and the weight of its lm_damping."""

    J: Array
    e: Array
    cost: Array
    gain: float
    damping: float


def _read(task: Task, configuration: object, damped: bool, weighted: bool) -> _Read:
    if not (hasattr(task, "compute_error") and hasattr(task, "compute_jacobian")):
        raise HierarchyError(f"{label(task)}: not a task with an error and a Jacobian, so it "
                             "cannot be a level")
    lm = float(getattr(task, "lm_damping", 0.0) or 0.0)
    if lm and not damped:
        raise HierarchyError(f"{label(task)}: lm_damping = {lm:g} weighs the task against its "
                             "own step, which a strict level cannot; set it to 0 and use the "
                             "damping of the resolver")
    J, e = _plain(task.compute_jacobian(configuration)), _plain(task.compute_error(configuration))
    cost = costs(task, len(e)) if weighted else np.ones(len(e))
    gain = float(task.gain)
    weighed = cost * e * gain if lm else e
    return _Read(J, e, cost, gain, lm * float(weighed @ weighed) if lm else 0.0)


def _plain(values: Any) -> Array:
    """Return numbers as an array that kernels take without being compiled anew."""
    return np.array(values, dtype=np.float64, order="C")


def residual(task: Task, configuration: object, weighted: bool = True) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal matrix of its costs.

    Rows with zero cost are left out. With `weighted` false, all rows are returned unweighted.

    Raises
    ------
    HierarchyError : the task is not of the form J dq = -gain e, or has lm_damping.
    """
    J, e, cost, _, _ = _read(task, configuration, False, weighted)
    asked = cost != 0.0
    return cost[asked, None] * J[asked], -cost[asked] * e[asked]


def costs(task: Task, rows: int) -> Array:
    """Return the cost of each row of a task: (rows,); ones for a task without a cost."""
    given = getattr(task, "cost", None)
    cost = np.asarray(1.0 if given is None else given, dtype=np.float64)
    if cost.shape == (rows,):
        return cost.copy()
    if cost.shape not in ((), (1,)):
        raise HierarchyError(f"{label(task)}: {cost.size} costs for {rows} rows")
    return np.full(rows, float(cost.item()))


def limit_level(limits: Iterable[Limit], n: int, period: float) -> tuple[Array, Array, Array]:
    """Pack rows G x <= h / period into one level A (k, n), lower (k,), upper (k,).

    Rows on a single joint become bounds of that joint, unless they contradict each other. Rows
    with infinite h are left out.
    """
    pairs = [(_plain(G), _plain(h)) for G, h in limits]
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    several = [np.empty(len(h), dtype=np.bool_) for _, h in pairs]
    left = 0
    for (G, h), mark in zip(pairs, several, strict=True):
        found = narrow(G, h, period, lower, upper, mark)
        if found == ODD:
            check_rows("limits", G, np.full(len(h), -np.inf), h)
        left += found
    rows = left + 2 * n
    A, low, up = np.empty((rows, n)), np.empty(rows), np.empty(rows)
    row = write_bounds(lower, upper, A, low, up)
    for (G, h), mark in zip(pairs, several, strict=True):
        if left:
            row = write_several(G, h, period, mark, A, low, up, row)
    return A[:row], low[:row], up[:row]


def label(task: object) -> str:
    """Return the class and frame of a task, for messages."""
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return f"{type(task).__name__}" + (f" of {frame}" if isinstance(frame, str) else "")
