"""What pink and mink share: tasks and limits of the step that is made in one period.

Both ask a task for J dq = -gain e and a limit for G dq <= h, with dq = x period. Here x is the
velocity, and priorities are strict.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy

Level = tuple[Array, ...]


def hierarchy(configuration: Any, n: int, period: float, limits: Sequence[tuple[Any, Any]],
              constraints: Sequence[Any], tasks: Iterable[Any]) -> Hierarchy:
    """Pack limits, then constraints, then the tasks, each a level unless it is empty.

    n unknowns [rad/s or m/s]; limits as pairs G (k, n), h (k,); an entry of `tasks` is a task or a
    sequence of tasks, which share a level and are weighted against each other by their costs. As
    constraints, tasks have no cost, as in pink and mink.
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
        together = list(entry) if isinstance(entry, (list, tuple)) else [entry]
        packed.append(_packed([task_rows(task, configuration, period) for task in together], n))
        kept.append(" + ".join(map(label, together)))
    return Hierarchy.from_levels(packed, np.zeros(n), kept)


def task_rows(task: Any, configuration: Any, period: float, weighted: bool = True
              ) -> tuple[Array, Array]:
    """Return the rows W J (k, n) and -gain W e / period (k,) of a task, as in `residual`."""
    J, r = residual(task, configuration, weighted)
    return J, r * (float(task.gain) / period)


def residual(task: Any, configuration: Any, weighted: bool = True) -> tuple[Array, Array]:
    """Return W J (k, n) and -W e (k,) of a task, W the diagonal of its cost.

    Rows of cost zero are left out. With `weighted` false all rows are there, as they are.

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
                             "own step, which a strict level does not; set it to 0 and damp the "
                             "resolver instead")
    J = np.asarray(task.compute_jacobian(configuration), dtype=float)
    e = np.asarray(task.compute_error(configuration), dtype=float)
    cost = costs(task, len(e)) if weighted else np.ones(len(e))
    asked = cost != 0.0
    return cost[asked, None] * J[asked], -cost[asked] * e[asked]


def costs(task: Any, rows: int) -> Array:
    """Return what each row of a task is multiplied by: (rows,); ones where it has no cost."""
    given = getattr(task, "cost", None)
    cost = np.asarray(1.0 if given is None else given, dtype=float)
    if cost.shape not in ((), (1,), (rows,)):
        raise HierarchyError(f"{label(task)}: {cost.size} costs for {rows} rows")
    return np.array(np.broadcast_to(cost, rows))


def limit_level(limits: Iterable[tuple[Any, Any]], n: int, period: float
                ) -> tuple[Array, Array, Array]:
    """Pack rows G x <= h / period into one level A (k, n), lower (k,), upper (k,).

    Rows on one joint become its box, unless they leave no value; infinite h is left out.
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
    empty = lower > upper  # such a joint keeps a row for each side, one of which must be broken
    boxed = ~empty & ((lower != -np.inf) | (upper != np.inf))
    none = np.full(np.count_nonzero(empty), np.inf)
    identity, rest = np.eye(n), G[~single]
    return (np.vstack([identity[boxed], identity[empty], identity[empty], rest]),
            np.concatenate([lower[boxed], lower[empty], -none, np.full(len(rest), -np.inf)]),
            np.concatenate([upper[boxed], none, upper[empty], h[~single]]))


def label(task: Any) -> str:
    """Name a task by its kind and its frame, for messages."""
    frame = getattr(task, "frame", None) or getattr(task, "frame_name", None)
    return f"{type(task).__name__}" + (f" of {frame}" if isinstance(frame, str) else "")


def _packed(rows: Sequence[tuple[Array, Array]], n: int) -> tuple[Array, Array]:
    return (np.vstack([np.empty((0, n)), *(A for A, _ in rows)]),
            np.concatenate([np.empty(0), *(b for _, b in rows)]))
