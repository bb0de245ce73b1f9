"""Common parts of the pink and mink adapters: tasks and limits of the step made in one period.

Both packages define a task by J dq = -gain e and a limit by G dq <= h, with dq = x period. Here x
is the velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy

Level = tuple[Array, ...]
Limit = tuple[Array, Array]  # G (k, n), h (k,)


class Task(Protocol):
    """The part of a task of pink or mink that a level needs; `cost` is optional."""

    gain: float

    def compute_error(self, configuration: Any) -> Array:
        """Return e (k,)."""

    def compute_jacobian(self, configuration: Any) -> Array:
        """Return J (k, n)."""


def hierarchy(configuration: object, n: int, period: float, limits: Sequence[Limit],
              constraints: Sequence[Task], tasks: Iterable[Task | Sequence[Task]]) -> Hierarchy:
    """Pack limits, constraints and tasks into levels, without the empty ones.

    n unknowns [rad/s or m/s]; period [s]. An entry of `tasks` is a task, or a sequence of tasks
    that share a level, weighted by their costs. Constraints have no cost, as in pink and mink.
    """
    if not 0.0 < period < np.inf:
        raise HierarchyError(f"period {period} s must be positive and finite")
    levels: dict[str, Level] = {"limits": limit_level(limits, n, period)}
    held = list(constraints)
    levels["constraints"] = _packed([task_rows(task, configuration, period, weighted=False)
                                     for task in held], n)
    kept = [name for name, level in levels.items() if len(level[0])]
    packed = [levels[name] for name in kept]
    for entry in tasks:
        together = entry if isinstance(entry, Sequence) else [entry]
        packed.append(_packed([task_rows(task, configuration, period) for task in together], n))
        kept.append(" + ".join(map(label, together)))
    return Hierarchy.from_levels(packed, np.zeros(n), _apart(kept))


def _apart(names: Sequence[str]) -> list[str]:
    """Return names with a number where one occurs again: two tasks may be of one frame."""
    return [name if name not in names[:i] else f"{name} ({names[:i].count(name) + 1})"
            for i, name in enumerate(names)]


def task_rows(task: Task, configuration: object, period: float, weighted: bool = True
              ) -> tuple[Array, Array]:
    """Return the rows W J (k, n) and -gain W e / period (k,) of a task; see `residual`."""
    J, r = residual(task, configuration, weighted)
    return J, r * (float(task.gain) / period)


def residual(task: Task, configuration: object, weighted: bool = True) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal matrix of its costs.

    Rows with zero cost are left out. With `weighted` false, all rows are returned unweighted.

    Raises
    ------
    HierarchyError : the task is not of the form J dq = -gain e, or has lm_damping.
    """
    if not (hasattr(task, "compute_error") and hasattr(task, "compute_jacobian")):
        raise HierarchyError(f"{label(task)}: not a task with an error and a Jacobian, so it "
                             "cannot be a level")
    damping = getattr(task, "lm_damping", 0.0)
    if damping:
        raise HierarchyError(f"{label(task)}: lm_damping = {damping:g} weighs the task against its "
                             "own step, which a strict level cannot; set it to 0 and use the "
                             "damping of the resolver")
    J = np.asarray(task.compute_jacobian(configuration), dtype=float)
    e = np.asarray(task.compute_error(configuration), dtype=float)
    cost = costs(task, len(e)) if weighted else np.ones(len(e))
    asked = cost != 0.0
    return cost[asked, None] * J[asked], -cost[asked] * e[asked]


def costs(task: Task, rows: int) -> Array:
    """Return the cost of each row of a task: (rows,); ones for a task without a cost."""
    given = getattr(task, "cost", None)
    cost = np.asarray(1.0 if given is None else given, dtype=float)
    if cost.shape not in ((), (1,), (rows,)):
        raise HierarchyError(f"{label(task)}: {cost.size} costs for {rows} rows")
    return np.array(np.broadcast_to(cost, rows))


def limit_level(limits: Iterable[Limit], n: int, period: float) -> tuple[Array, Array, Array]:
    """Pack rows G x <= h / period into one level A (k, n), lower (k,), upper (k,).

    Rows on a single joint become bounds of that joint, unless they contradict each other. Rows
    with infinite h are left out.
    """
    pairs = [(np.asarray(G, dtype=float), np.asarray(h, dtype=float)) for G, h in limits]
    G = np.vstack([np.empty((0, n)), *(G for G, _ in pairs)])
    h = np.concatenate([np.empty(0), *(h for _, h in pairs)]) / period
    G, h = G[h != np.inf], h[h != np.inf]
    single = np.count_nonzero(G, axis=1) == 1
    joint = np.argmax(G[single] != 0.0, axis=1)
    factor = G[single, joint]
    side, up = h[single] / factor, factor > 0.0
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    np.minimum.at(upper, joint[up], side[up])
    np.maximum.at(lower, joint[~up], side[~up])
    bounds, rest = _bounds(lower, upper), G[~single]
    return _stacked(bounds, (rest, np.full(len(rest), -np.inf), h[~single]))


def _bounds(lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    """Return the rows of joint bounds; contradictory bounds become one row for each side."""
    empty = lower > upper
    boxed = ~empty & ((lower != -np.inf) | (upper != np.inf))
    none, identity = np.full(np.count_nonzero(empty), np.inf), np.eye(len(lower))
    return _stacked((identity[boxed], lower[boxed], upper[boxed]),
                    (identity[empty], lower[empty], none), (identity[empty], -none, upper[empty]))


def _stacked(*levels: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    A, lower, upper = zip(*levels, strict=True)
    return np.vstack(A), np.concatenate(lower), np.concatenate(upper)


def label(task: object) -> str:
    """Return the class and frame of a task, for messages."""
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return f"{type(task).__name__}" + (f" of {frame}" if isinstance(frame, str) else "")


def _packed(rows: Sequence[tuple[Array, Array]], n: int) -> tuple[Array, Array]:
    return (np.vstack([np.empty((0, n)), *(A for A, _ in rows)]),
            np.concatenate([np.empty(0), *(b for _, b in rows)]))
