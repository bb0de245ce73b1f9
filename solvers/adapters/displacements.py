"""Common parts of the pink and mink adapters: tasks and limits of the step made in one period.

Both packages define a task by J dq = -gain e and a limit by G dq <= h, with dq = x period. Here x
is the velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np

from hierarchy.errors import HierarchyError, positive
from hierarchy.gate import Sizes, array_of, check_rows
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.adapters.packing import CONTRADICT, GIVEN, ODD, damp, write_limits, write_tasks

_AXES = ("x", "y", "z", "about x", "about y", "about z")
_FAINT = 1e-8  # singular value over the largest: less is no direction

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


Tasks = Iterable[Task | Sequence[Task]]


class Pull(NamedTuple):
    """A weight on the length of the step, as pink adds to its cost, and its centre.

    weight : of |x - centre|^2 next to |W (J x - b)|^2 of a level, in the unit of its rows squared.
    centre : (n,) the velocity to which it pulls.
    """

    weight: float
    centre: Array


class ContradictionError(HierarchyError):
    """Limits of one joint that no velocity meets."""


def _row_names(packed: Packed) -> tuple[str, ...]:
    """Name each row: by its joint if it is about a single one, else by its limit or task."""
    known, rows = list(packed.joints()), list[str]()
    of_limits = [f"{name}, row {i}" for name, i, row, side in packed.limit_rows()
                 if side < np.inf and np.count_nonzero(row) != 1]
    for k, (level, size) in enumerate(zip(packed.kept, packed.sizes, strict=True)):
        if level == "limits":
            own = [*of_limits, *[""] * (size - len(of_limits))]
        else:
            tasks = packed.read[0] if level == "constraints" else level
            own = [name for one in tasks for name in _names_of(*one)]
        if k in packed.mixed or len(own) != size:
            own = [f"{packed.names[k]}, row {i}" for i in range(size)]
        rows += own
    for i, (row, name) in enumerate(zip(packed.A, rows, strict=False)):
        of_row = [known[c] for c in np.flatnonzero(row)]
        if not name or (len(of_row) == 1 and name.startswith("row ")):
            rows[i] = listed(of_row) if of_row else "no joint"
    return tuple(rows)


def _names_of(task: Task, J: Array, e: Array) -> list[str]:
    """Name the rows of a task that cost something: axes of its frame, or their number."""
    frame = _frame_of(task)
    axes = _AXES[:len(e)] if frame and len(e) in (3, 6) else ()
    names = [f"{frame} {axis}" for axis in axes] or [f"row {i}" for i in range(len(e))]
    costs = np.broadcast_to(_costs(task, len(e)), len(e))
    return [name for name, cost in zip(names, costs, strict=True) if cost != 0.0]


class Packed:
    """Limits, constraints and tasks as levels, without the empty ones.

    n unknowns [rad/s or m/s], and a function that returns their names; period [s]. An entry of
    `tasks` is a task, or a sequence of tasks that share a level, weighted by their costs.
    Constraints have no cost, as in pink and mink.
    Without `pull` a task's lm_damping is refused. With it, a level minimises |A x - b|^2 +
    weight |x - centre|^2 within the levels above: the last one by n rows, the others by `solve`,
    after which they keep the A x that it reaches. Up to a weight of NO_DAMPING a level is exact.

    kept, sizes : what is in each level, and its rows. A (m, n), sides (2, m): the rows of all, m =
    `count`, and room for more; the first `always` are limits and constraints. What limits and tasks
    give stands in a table, see `packing`.

    Raises ContradictionError for limits of a joint that contradict each other.
    """

    def __init__(self, configuration: object, joints: Names, n: int, period: float,
                 limits: Sequence[Limit], constraints: Sequence[Task], tasks: Tasks,
                 pull: Pull | None = None, *, solve: Solve | None = None) -> None:
        positive("period [s]", period)
        self.n, self.joints, self.period, self.pull = n, joints, period, pull
        self.reference = np.zeros(n) if pull is None else pull.centre
        entries = [constraints, *(one if isinstance(one, Sequence) else (one,) for one in tasks)]
        self.limits, self.read = limits, [[
            _read(task, configuration, pull is not None) for task in entry] for entry in entries]
        given = sum([len(h) for _, _, h in limits])
        most = given + sum([len(e) for level in self.read for _, _, e in level])
        self.table = np.zeros((most, n + GIVEN))
        self.A, self.sides = np.empty((most + 2 * n, n)), np.empty((2, most + 2 * n))
        self.count = self.filled = 0
        self.weight = 0.0  # of the step in the last level, whose rows in the table are `last`
        self.mixed = set[int]()  # levels whose rows are no longer those of their tasks
        self.last = (0, 0)
        self.kept: list[str | Sequence[_Read]] = []
        self.sizes: list[int] = []
        self.keep("limits", self.limit())
        self.keep("constraints", self.write(self.read[0], weighted=False))
        self.always = self.count
        for level in self.read[1:]:
            if self.weight and any(np.any(_costs(task, len(e))) for task, _, e in level):
                self.hold(solve)
            self.level(level)

    def keep(self, what: str | Sequence[_Read], last: int) -> None:
        """Make the rows written up to `last` a level, unless there are none."""
        if last > self.count:
            self.kept.append(what)
            self.sizes.append(last - self.count)
            self.count = last

    @property
    def names(self) -> list[str]:
        """The names of the levels: of the classes and frames of their tasks, each once."""
        plain = [one if isinstance(one, str) else " + ".join([label(task) for task, _, _ in one])
                 for one in self.kept]
        again = [plain[:k].count(name) for k, name in enumerate(plain)]
        return [f"{name} ({k + 1})" if k else name for name, k in zip(plain, again, strict=True)]

    def limit(self) -> int:
        """Write the rows G x <= h / period from row 0 on: one for a joint, after all others.

        Returns their number. Raises HierarchyError for numbers that are not finite, or contradict.
        """
        for name, G, h in self.limits:
            self._give(name, G, h)
        last = int(write_limits(self.table, 0, self.filled, self.period, np.empty((2, self.n)),
                                self.A, self.sides))
        if last <= CONTRADICT:
            raise _contradiction(self, CONTRADICT - last)
        if last == ODD:
            for name, G, h in self.limits:
                check_rows(name, G, np.full(len(h), -np.inf), h)
        return last

    def limit_rows(self) -> Iterator[tuple[str, int, Array, float]]:
        """Yield of each row of the limits its limit, its number there, the row (n,) and its h."""
        places = [(name, i, side) for name, _, h in self.limits for i, side in enumerate(h)]
        for (name, i, side), row in zip(places, self.table[:, :self.n], strict=False):
            yield name, i, row, side

    def write(self, level: Sequence[_Read], weighted: bool = True) -> int:
        """Write the rows of tasks that share a level; return the row after them."""
        if not level:
            return self.count
        first = self.filled
        for task, J, e in level:
            own, n = self._give(task, J, e), self.n
            own[:, n + 1], own[:, n + 2] = _costs(task, len(e)) if weighted else 1.0, task.gain
            if damping := getattr(task, "lm_damping", 0.0):
                own[:, n + 3] = damping
        self.last = first, self.filled
        row = int(write_tasks(self.table, *self.last, self.period, self.A, self.sides, self.count))
        if row == ODD:
            for task, J, e in level:
                check_rows(label(task), J, e, e)
            raise HierarchyError(f"{' + '.join([label(one[0]) for one in level])}: its costs or "
                                 "gain are not finite")
        return row

    def _give(self, what: str | Task, rows: Array, sides: Array) -> Array:
        """Put rows (k, n) and sides (k,) into the table; return what it has of them."""
        n, first = self.n, self.filled
        self.filled = last = first + len(sides)
        if np.atleast_2d(rows).shape != (last - first, n):  # as pink and mink stack them
            name = what if isinstance(what, str) else label(what)
            raise HierarchyError(f"{name}: {rows.shape} rows for {sides.shape} values and {n} "
                                 "unknowns")
        own = self.table[first:last]
        own[:, :n], own[:, n] = rows, sides
        return own

    def level(self, level: Sequence[_Read]) -> None:
        """Write tasks as a level; if its step is weighed, n rows then stand for all of it."""
        last = self.write(level)
        if self.pull is not None and last > self.count:
            self.weight = damp(self.table, *self.last, self.pull, self.A, self.sides, self.count,
                               last)
            if self.weight > 0.0:
                last = self.count + self.n
                self.mixed.add(len(self.kept))
        self.keep(level, last)

    def hold(self, solve: Solve | None) -> None:
        """Make the last level, which weighs its step, hold what it then reaches.

        In orthonormal directions: rows of a singular task would be met, beside limits that act, by
        a rounding that no resolver can verify.
        """
        if solve is None:
            raise HierarchyError(f"{self.names[-1]}: damped, and not the last level: what it "
                                 "leaves to the levels below needs a resolver")
        x = solve(self.hierarchy())
        first = self.count = self.count - self.sizes.pop()
        last = int(write_tasks(self.table, *self.last, self.period, self.A, self.sides, first))
        _, values, directions = np.linalg.svd(self.A[first:last], full_matrices=False)
        held = directions[values > _FAINT * values.max(initial=0.0)]
        last, self.weight = first + len(held), 0.0
        self.A[first:last], self.sides[:, first:last] = held, held @ x
        self.keep(self.kept.pop(), last)

    @property
    def rows(self) -> tuple[Array, Array, Array, Sizes]:
        """A (m, n), lower and upper (m,), and sizes (L,), as kernels read them."""
        lower, upper = self.sides[:, :self.count]
        return self.A[:self.count], lower, upper, np.array(self.sizes, dtype=np.int64)

    def hierarchy(self) -> Hierarchy:
        """Return the levels as a Hierarchy of its own."""
        return Hierarchy.trusted(*self.rows, self.reference, self.names,
                                 named=partial(_row_names, self))


def _contradiction(packed: Packed, i: int) -> ContradictionError:
    """Return the error that names the two limits that leave unknown i no value."""
    bounds = [(side / packed.period / row[i], name, row[i] > 0.0)
              for name, _, row, side in packed.limit_rows()
              if row[i] != 0.0 and np.count_nonzero(row) == 1]
    low, demands, _ = max(one for one in bounds if not one[2])
    high, allows, _ = min(one for one in bounds if one[2])
    return ContradictionError(
        f"limits cannot all hold: joint {packed.joints()[i]} must move by at least {low:.4g} "
        f"({demands}) and at most {high:.4g} rad/s or m/s ({allows}); a joint outside its range "
        "needs a velocity limit that lets it come back within the period")


_Read = tuple[Task, Array, Array]  # a task, J (k, n), e (k,)


def _read(task: Task, configuration: object, damped: bool) -> _Read:
    if not (hasattr(task, "compute_error") and hasattr(task, "compute_jacobian")):
        if hasattr(task, "compute_qp_residual"):
            return _rows_of_cost(task, configuration)
        raise HierarchyError(f"{label(task)}: not a task with an error and a Jacobian, so it "
                             "cannot be a level")
    if not damped and (lm := getattr(task, "lm_damping", 0.0)):
        raise HierarchyError(f"{label(task)}: lm_damping = {lm:g} weighs the task against its "
                             "own step, which a strict level cannot; set it to 0 and use the "
                             "damping of the resolver")
    both = getattr(task, "_error_and_jacobian", None)  # of mink, where the frame is read once
    e, J = both(configuration) if both else (task.compute_error(configuration),
                                             task.compute_jacobian(configuration))
    if J.ndim == 1 and e.ndim == 1:
        J = J.reshape(-1, 1)  # as pinocchio returns the Jacobian of a single joint
    if J.shape[:1] != e.shape:
        raise HierarchyError(f"{label(task)}: {J.shape} rows for {e.shape} values")
    return task, J, e


def _rows_of_cost(task: Any, configuration: object) -> _Read:
    """Read a task of mink that has only a cost 1/2 dq^T H dq + c^T dq: H = J^T J, c = J^T e."""
    H, c = task.compute_qp_objective(configuration)
    try:
        J = np.linalg.cholesky(H).T
    except np.linalg.LinAlgError:
        raise HierarchyError(f"{label(task)}: its H is not positive definite, so it cannot be "
                             "rows of a level") from None
    rows = copy(task)
    rows.cost = rows.gain = 1.0  # its cost is within H
    return rows, J, np.linalg.solve(J.T, c)


def residual(task: Task, configuration: object) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal matrix of its costs.

    Rows with zero cost are left out.

    Raises HierarchyError: the task is not of the form J dq = -gain e, or has lm_damping.
    """
    _, J, e = _read(task, configuration, False)
    cost = np.broadcast_to(_costs(task, len(e)), e.shape)
    asked = cost != 0.0
    return cost[asked, None] * J[asked], -cost[asked] * e[asked]


def _costs(task: Task, rows: int) -> Array | float:
    """Return the cost of each row of a task, or of all; 1 for a task without a cost."""
    given = getattr(task, "cost", None)
    if given is None or type(given) is float:
        return 1.0 if given is None else given
    cost = given if type(given) is np.ndarray else array_of(f"{label(task)}: cost", given)
    if cost.size not in (1, rows):
        raise HierarchyError(f"{label(task)}: {cost.size} costs for {rows} rows")
    return cost


def label(task: object) -> str:
    """Return the class and frame of a task, for messages."""
    frame = _frame_of(task)
    return f"{type(task).__name__}" + (f" of {frame}" if frame else "")


def _frame_of(task: object) -> str:
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return frame if isinstance(frame, str) else ""
