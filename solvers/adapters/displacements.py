"""Common parts of the pink and mink adapters: tasks and limits of the step made in one period.

Both packages define a task by J dq = -gain e and a limit by G dq <= h, with dq = x period. Here x
is the velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.gate import check_rows
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.adapters.packing import (
    CONTRADICT,
    ODD,
    make_triangular,
    squared,
    write_bounds,
    write_limits,
    write_pull,
    write_task,
)

_FLOAT = np.dtype(np.float64)
_AXES = ("x", "y", "z", "about x", "about y", "about z")
_NO_DAMPING = 1e-12  # pink's default: a level above others leaves it out

Names = Callable[[], Sequence[str]]
Solve = Callable[[Hierarchy], Array]
Limit = tuple[str, Array, Array]  # its class, G (k, n), h (k,)


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


def hierarchy(configuration: object, joints: Names, n: int, period: float,
              limits: Sequence[Limit], constraints: Sequence[Task],
              tasks: Iterable[Task | Sequence[Task]], pull: Pull | None = None,
              *, solve: Solve | None = None) -> Hierarchy:
    """Pack limits, constraints and tasks into levels, without the empty ones.

    n unknowns [rad/s or m/s], and a function that returns their names; period [s]. An entry of
    `tasks` is a task, or a sequence of tasks that share a level, weighted by their costs.
    Constraints have no cost, as in pink and mink.
    Without `pull` a task's lm_damping is refused. With it, a level minimises |A x - b|^2 +
    weight |x - centre|^2 within the levels above: the last one by n rows more, the others by
    `solve`, after which they keep the A x that it reaches.

    Raises ContradictionError for limits of a joint that contradict each other.
    """
    if not 0.0 < period < np.inf:
        raise HierarchyError(f"period {period} s must be positive and finite")
    entries = [entry if isinstance(entry, Sequence) else [entry] for entry in tasks]
    damped = pull is not None
    held = [_read(task, configuration, damped, weighted=False) for task in constraints]
    levels = [[_read(task, configuration, damped) for task in together] for together in entries]
    read = [*held, *(one for level in levels for one in level)]
    packed = _Packed(n, sum(len(one[2]) for one in limits) + sum(len(one.e) for one in read)
                     + 2 * n)
    packed.keep("limits", packed.limit(limits, period, joints))
    packed.keep("constraints", packed.write(held, period))
    for level in levels:
        if packed.damped and any(one.cost.any() for one in level):
            packed.hold(solve, period)
        last = packed.write(level, period)
        if pull is not None and last > packed.rows:
            last = packed.damp(last, level, pull)
        packed.keep(" + ".join([label(one.task) for one in level]), last)
    return packed.hierarchy(partial(_row_names, packed, joints, limits, read))


class ContradictionError(HierarchyError):
    """Limits of one joint that no velocity meets."""


def _row_names(packed: _Packed, joints: Names, limits: Sequence[Limit],
               read: Sequence[_Read]) -> tuple[str, ...]:
    """Name each row: by its joint if it is about a single one, else by its limit or task."""
    known = list(joints())
    above, free = (packed.sizes[0] if packed.names[:1] == ["limits"] else 0), packed.rows
    free -= packed.sizes[-1] if packed.damped else 0
    of_tasks = [name for one in read for name in _names_of(one)][:free - above]
    of_limits = [f"{name}, row {i}" for name, G, h in limits for i, side in enumerate(h)
                 if side < np.inf and np.count_nonzero(G[i]) != 1]
    rows = of_limits + [""] * (above - len(of_limits)) + of_tasks
    rows += [f"{packed.names[-1]}, row {i}" for i in range(packed.rows - free)]
    for i, (row, name) in enumerate(zip(packed.A, rows, strict=False)):
        of_row = [known[c] for c in np.flatnonzero(row)]
        if not name or (len(of_row) == 1 and name.startswith("row ")):
            rows[i] = listed(of_row) if of_row else "no joint"
    return tuple(rows)


def _names_of(one: _Read) -> list[str]:
    """Name the rows of a task that cost something: axes of its frame, or their number."""
    frame = _frame_of(one.task)
    axes = _AXES[:len(one.e)] if frame and len(one.e) in (3, 6) else ()
    names = [f"{frame} {axis}" for axis in axes] or [f"row {i}" for i in range(len(one.e))]
    return [name for name, cost in zip(names, one.cost, strict=True) if cost != 0.0]


class _Packed:
    """Arrays for at most `most` rows, and the levels written so far."""

    def __init__(self, n: int, most: int) -> None:
        self.A, (self.lower, self.upper) = np.empty((most, n)), np.empty((2, most))
        self.reference, self.rows = np.zeros(n), 0
        self.damped: Sequence[_Read] = ()  # the tasks of the last level, if it weighs the step
        self.weight = 0.0                  # that weight
        self.names: list[str] = []
        self.sizes: list[int] = []

    def keep(self, name: str, last: int) -> None:
        """Make the rows written up to `last` a level, unless there are none."""
        if last > self.rows:
            again = self.names.count(name)
            self.names.append(f"{name} ({again + 1})" if again else name)
            self.sizes.append(last - self.rows)
            self.rows = last

    def limit(self, limits: Sequence[Limit], period: float, joints: Names) -> int:
        """Write the rows G x <= h / period from row 0 on: one for a joint, after all others.

        Returns their number. Raises HierarchyError for numbers that are not finite, or contradict.
        """
        n, row = len(self.reference), 0
        lower, upper = _filled(n, -np.inf), _filled(n, np.inf)
        given = [(name, _plain(G), _plain(h)) for name, G, h in limits]
        for name, G, h in given:
            if (*h.shape, n) != G.shape:
                raise _unfit(name, G, h, n)
            row = int(write_limits(G, h, period, (lower, upper), self.A, self.lower, self.upper,
                                   row))
            if row == ODD:
                check_rows(name, G, _filled(len(h), -np.inf), h)
        last = int(write_bounds(lower, upper, self.A, self.lower, self.upper, row))
        if last == CONTRADICT:
            i = int(np.flatnonzero(lower > upper)[0])
            raise _contradiction(given, n, period, i, joints()[i])
        return last

    def write(self, read: Sequence[_Read], period: float) -> int:
        """Write the rows of tasks that share a level; return the row after them."""
        row = self.rows
        for one in read:
            if (*one.e.shape, self.A.shape[1]) != one.J.shape:
                raise _unfit(label(one.task), one.J, one.e, self.A.shape[1])
            found = write_task(one.J, one.e, one.cost, one.gain / period, self.A, self.lower,
                               self.upper, row)
            if found == ODD:
                check_rows(label(one.task), one.J, one.e, one.e)
                raise HierarchyError(f"{label(one.task)}: its costs {one.cost} or gain {one.gain} "
                                     "are not finite")
            row = int(found)
        return row

    def damp(self, last: int, level: Sequence[_Read], pull: Pull) -> int:
        """Weigh the step in the level that ends before row `last`; return the row after it.

        n rows then stand for all of the level: what its best x misses says nothing of that x.
        """
        weight = sum(one.damping for one in level) + pull.weight
        if weight == 0.0:
            return last
        n = len(self.reference)
        self.damped, self.weight = level, weight
        write_pull(self.A, self.lower, self.upper, weight, pull.weight / weight * pull.centre, last)
        make_triangular(self.A, self.lower, self.upper, self.rows, last + n)
        return self.rows + n

    def hold(self, solve: Solve | None, period: float) -> None:
        """Make the last level, which weighs its step, ask for what it then reaches."""
        x = None
        if self.weight > _NO_DAMPING:
            if solve is None:
                raise HierarchyError(f"{self.names[-1]}: damped, and not the last level: what it "
                                     "leaves to the levels below needs a resolver")
            x = solve(self.hierarchy())
        first = self.rows = self.rows - self.sizes.pop()
        name, last = self.names.pop(), self.write(self.damped, period)
        self.damped = ()
        if x is not None:
            self.lower[first:last] = self.upper[first:last] = self.A[first:last] @ x
        self.keep(name, last)

    def hierarchy(self, named: Callable[[], tuple[str, ...]] | None = None) -> Hierarchy:
        """Return the levels; a level is named like another one with a number."""
        m = self.rows
        return Hierarchy.trusted(self.A[:m], self.lower[:m], self.upper[:m], self.sizes,
                                 self.reference, self.names, named=named)


def _contradiction(limits: Sequence[Limit], n: int, period: float, i: int,
                   joint: str) -> ContradictionError:
    """Return the error that names the two limits that leave unknown i no value."""
    lows, highs = [], []
    for name, G, h in limits:
        lower, upper = _filled(n, -np.inf), _filled(n, np.inf)
        spare = np.empty((len(h), n)), np.empty(len(h)), np.empty(len(h))
        write_limits(G, h, period, (lower, upper), *spare, 0)
        lows.append((float(lower[i]), name))
        highs.append((float(upper[i]), name))
    (low, demands), (high, allows) = max(lows), min(highs)
    return ContradictionError(
        f"limits cannot all hold: joint {joint} must move by at least {low:.4g} ({demands}) and at "
        f"most {high:.4g} rad/s or m/s ({allows}); a joint outside its range needs a velocity "
        "limit that lets it come back within the period")


class _Read(NamedTuple):
    """What a task says: J (k, n), e (k,), cost (k,), gain, and the weight of its lm_damping."""

    task: Task
    J: Array
    e: Array
    cost: Array
    gain: float
    damping: float


def _read(task: Task, configuration: object, damped: bool, weighted: bool = True) -> _Read:
    if not (hasattr(task, "compute_error") and hasattr(task, "compute_jacobian")):
        raise HierarchyError(f"{label(task)}: not a task with an error and a Jacobian, so it "
                             "cannot be a level")
    lm = float(getattr(task, "lm_damping", 0.0) or 0.0)
    if lm and not damped:
        raise HierarchyError(f"{label(task)}: lm_damping = {lm:g} weighs the task against its "
                             "own step, which a strict level cannot; set it to 0 and use the "
                             "damping of the resolver")
    J, e = _plain(task.compute_jacobian(configuration)), _plain(task.compute_error(configuration))
    if J.ndim == 1 and e.ndim == 1 and J.size == e.size:
        J = J.reshape(-1, 1)  # as pinocchio returns the Jacobian of a single joint
    cost = _costs(task, len(e)) if weighted else _filled(len(e), 1.0)
    gain = float(task.gain)
    return _Read(task, J, e, cost, gain, lm * gain * gain * squared(cost, e) if lm else 0.0)


def _unfit(what: str, rows: Array, sides: Array, n: int) -> HierarchyError:
    """Return the error of rows that are not (k, n) with sides (k,): kernels do not look."""
    return HierarchyError(f"{what}: {rows.shape} rows for {sides.shape} values and {n} unknowns")


def _plain(values: Any) -> Array:
    """Return numbers as an array that kernels take without being compiled anew."""
    if type(values) is np.ndarray and values.dtype == _FLOAT and values.flags.carray:
        return values
    return np.array(values, dtype=np.float64, order="C")


def residual(task: Task, configuration: object) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal matrix of its costs.

    Rows with zero cost are left out.

    Raises
    ------
    HierarchyError : the task is not of the form J dq = -gain e, or has lm_damping.
    """
    one = _read(task, configuration, False)
    asked = one.cost != 0.0
    return one.cost[asked, None] * one.J[asked], -one.cost[asked] * one.e[asked]


def _costs(task: Task, rows: int) -> Array:
    """Return the cost of each row of a task: (rows,); ones for a task without a cost."""
    given = getattr(task, "cost", None)
    if given is None or type(given) is float:
        return _filled(rows, 1.0 if given is None else given)
    cost = _plain(given)
    if cost.shape == (rows,):
        return cost
    if cost.shape not in ((), (1,)):
        raise HierarchyError(f"{label(task)}: {cost.size} costs for {rows} rows")
    return _filled(rows, float(cost.item()))


def _filled(size: int, value: float) -> Array:
    """Return what `np.full` does, in a fifth of its time."""
    filled = np.empty(size)
    filled.fill(value)
    return filled


def label(task: object) -> str:
    """Return the class and frame of a task, for messages."""
    frame = _frame_of(task)
    return f"{type(task).__name__}" + (f" of {frame}" if frame else "")


def _frame_of(task: object) -> str:
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return frame if isinstance(frame, str) else ""
