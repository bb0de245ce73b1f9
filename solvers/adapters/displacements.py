"""Common parts of the pink and mink adapters: tasks and limits of the step made in one period.

Both packages define a task by J dq = -gain e and a limit by G dq <= h, with dq = x period. Here x
is the velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.gate import check_rows
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.adapters.packing import (
    ODD,
    narrow,
    squared,
    write_bounds,
    write_pull,
    write_several,
    write_task,
)

_FLOAT = np.dtype(np.float64)
_AXES = ("x", "y", "z", "about x", "about y", "about z")
_NO_DAMPING = 1e-12  # pink's default, a regularisation of its QP that ours does not need

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
              solve: Solve | None = None) -> Hierarchy:
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
    found = _Limits.of(limits, n, period, joints)
    packed = _Packed(n, found.most + sum(len(one.e) for one in read) + n)
    packed.keep("limits", found.write(packed))
    packed.keep("constraints", packed.write(held, period))
    for level in levels:
        if not any(one.cost.any() for one in level):
            continue
        packed.hold(solve)
        last = packed.write(level, period)
        if pull is not None:
            last = packed.damp(last, sum(one.damping for one in level), pull)
        packed.keep(" + ".join(label(one.task) for one in level), last)
    h = packed.hierarchy()
    return h.changed(named=partial(_row_names, h, joints, read, packed.damped))


class ContradictionError(HierarchyError):
    """Limits of one joint that no velocity meets."""


def _row_names(h: Hierarchy, joints: Names, read: Sequence[_Read],
               damped: int) -> tuple[str, ...]:
    """Name each row: by its joint if it is about a single one, else by what its task says."""
    known = list(joints())
    of_tasks = [name for one in read for name in _names_of(one)] + [""] * damped
    rows = [""] * (h.m - len(of_tasks)) + of_tasks
    for i, (row, name) in enumerate(zip(h.A, rows, strict=True)):
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
        self.damped = 0  # rows that weigh the step, at the end of the last level
        self.names: list[str] = []
        self.sizes: list[int] = []

    def keep(self, name: str, last: int) -> None:
        """Make the rows written up to `last` a level, unless there are none."""
        if last > self.rows:
            again = self.names.count(name)
            self.names.append(f"{name} ({again + 1})" if again else name)
            self.sizes.append(last - self.rows)
            self.rows = last

    def write(self, read: Sequence[_Read], period: float) -> int:
        """Write the rows of tasks that share a level; return the row after them."""
        row = self.rows
        for one in read:
            _check_fit(label(one.task), one.J, one.e, self.A.shape[1])
            found = write_task(one.J, one.e, one.cost, one.gain / period, self.A, self.lower,
                               self.upper, row)
            if found == ODD:
                check_rows(label(one.task), one.J, one.e, one.e)
                raise HierarchyError(f"{label(one.task)}: its costs {one.cost} or gain {one.gain} "
                                     "are not finite")
            row = int(found)
        return row

    def damp(self, last: int, own: float, pull: Pull) -> int:
        """Weigh the step in the level that ends before row `last`; return the row after it."""
        weight = own + pull.weight
        if weight <= _NO_DAMPING:
            return last
        self.damped = len(self.reference)
        write_pull(self.A, self.lower, self.upper, weight,
                   pull.weight / weight * pull.centre, last)
        return last + self.damped

    def hold(self, solve: Solve | None) -> None:
        """Make the last level, if it weighs its step, ask for what it then reaches."""
        if not self.damped:
            return
        if solve is None:
            raise HierarchyError(f"{self.names[-1]}: damped, and not the last level: what it "
                                 "leaves to the levels below needs a resolver")
        x = solve(self.hierarchy())
        first, self.rows = self.rows - self.sizes[-1], self.rows - self.damped
        self.sizes[-1] -= self.damped
        self.damped = 0
        self.lower[first:self.rows] = self.A[first:self.rows] @ x
        self.upper[first:self.rows] = self.lower[first:self.rows]

    def hierarchy(self) -> Hierarchy:
        """Return the levels; a level is named like another one with a number."""
        m = self.rows
        return Hierarchy.trusted(self.A[:m], self.lower[:m], self.upper[:m], self.sizes,
                                 self.reference, self.names)


class _Limits(NamedTuple):
    """Rows G x <= h / period, sorted: bounds of single unknowns, and marks of the other rows."""

    lower: Array
    upper: Array
    given: list[Limit]
    several: list[NDArray[np.bool_]]
    left: int
    period: float

    @classmethod
    def of(cls, limits: Iterable[Limit], n: int, period: float,
           joints: Names) -> _Limits:
        """Sort rows; raises HierarchyError for numbers that are not finite, or contradict."""
        given = [(name, _plain(G), _plain(h)) for name, G, h in limits]
        lower, upper = _filled(n, -np.inf), _filled(n, np.inf)
        several, left = [np.empty(len(h), np.bool_) for _, _, h in given], 0
        for (name, G, h), mark in zip(given, several, strict=True):
            _check_fit(name, G, h, n)
            found = narrow(G, h, period, lower, upper, mark)
            if found == ODD:
                check_rows(name, G, np.full(len(h), -np.inf), h)
            left += int(found)
        for i in np.flatnonzero(lower > upper)[:1]:
            raise _contradiction(given, n, period, int(i), joints()[i])
        return cls(lower, upper, given, several, left, period)

    @property
    def most(self) -> int:
        """The largest number of rows that `write` may write."""
        return self.left + 2 * len(self.lower)

    def write(self, packed: _Packed) -> int:
        """Write all rows from row 0 on, and return how many."""
        row = write_bounds(self.lower, self.upper, packed.A, packed.lower, packed.upper)
        for (_, G, h), mark in zip(self.given, self.several, strict=True):
            if self.left:
                row = write_several(G, h, self.period, mark, packed.A, packed.lower, packed.upper,
                                    row)
        return int(row)


def _contradiction(limits: Sequence[Limit], n: int, period: float, i: int,
                   joint: str) -> ContradictionError:
    """Return the error that names the two limits that leave unknown i no value."""
    lows, highs = [], []
    for name, G, h in limits:
        lower, upper = _filled(n, -np.inf), _filled(n, np.inf)
        narrow(G, h, period, lower, upper, np.empty(len(h), np.bool_))
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
    cost = costs(task, len(e)) if weighted else _filled(len(e), 1.0)
    gain = float(task.gain)
    return _Read(task, J, e, cost, gain, lm * gain * gain * squared(cost, e) if lm else 0.0)


def _check_fit(what: str, rows: Array, sides: Array, n: int) -> None:
    """Raise a HierarchyError unless rows are (k, n) and their sides (k,): kernels do not look."""
    if (*sides.shape, n) != rows.shape:
        raise HierarchyError(f"{what}: {rows.shape} rows for {sides.shape} values and {n} unknowns")


def _plain(values: Any) -> Array:
    """Return numbers as an array that kernels take without being compiled anew."""
    if type(values) is np.ndarray and values.dtype == _FLOAT and values.flags.carray:
        return values
    return np.array(values, dtype=np.float64, order="C")


def residual(task: Task, configuration: object, weighted: bool = True) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal matrix of its costs.

    Rows with zero cost are left out. With `weighted` false, all rows are returned unweighted.

    Raises
    ------
    HierarchyError : the task is not of the form J dq = -gain e, or has lm_damping.
    """
    _, J, e, cost, _, _ = _read(task, configuration, False, weighted)
    asked = cost != 0.0
    return cost[asked, None] * J[asked], -cost[asked] * e[asked]


def costs(task: Task, rows: int) -> Array:
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


def limit_level(limits: Iterable[Limit], n: int, period: float) -> tuple[Array, Array, Array]:
    """Pack rows G x <= h / period into one level A (k, n), lower (k,), upper (k,).

    A limit is its name, G and h. Rows on a single joint become bounds of that joint;
    ContradictionError if no value meets them. Rows with infinite h are left out.
    """
    found = _Limits.of(limits, n, period, lambda: [str(i) for i in range(n)])
    packed = _Packed(n, found.most)
    row = found.write(packed)
    return packed.A[:row], packed.lower[:row], packed.upper[:row]


def label(task: object) -> str:
    """Return the class and frame of a task, for messages."""
    frame = _frame_of(task)
    return f"{type(task).__name__}" + (f" of {frame}" if frame else "")


def _frame_of(task: object) -> str:
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return frame if isinstance(frame, str) else ""
