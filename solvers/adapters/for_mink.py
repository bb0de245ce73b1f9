"""A `solve_ik` like that of mink, with strict priorities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from hierarchy.problem import Array, Hierarchy
from solvers.adapters.displacements import Task, Tasks
from solvers.adapters.drop_in import answer
from solvers.adapters.from_mink import packed
from solvers.resolver import Resolution, Resolver

if TYPE_CHECKING:
    from mink import Configuration, Limit


def solve_ik(configuration: Configuration, tasks: Tasks, dt: float,
             solver: str | Resolver = "hcod", damping: float = 1e-12, safety_break: bool = False,
             limits: Iterable[Limit] | None = None, constraints: Iterable[Task] | None = None, *,
             tolerance: float = 1e-6, **of_the_solver: Any) -> Array:
    """Return the joint velocity (nv,) [rad/s or m/s] that serves mink's tasks in strict order.

    Takes the arguments of `mink.solve_ik` in its order; their meaning, and that of the others, is
    that of `solvers.adapters.for_pink.solve_ik`, with mink's exceptions. Without `safety_break` a
    joint outside its limits is not looked for: mink then writes a line at the level "debug".
    """
    if safety_break:
        configuration.check_limits()
    return answer(solver, of_the_solver, damping, tolerance, lambda solve: packed(
        configuration, tasks, dt, limits, constraints, damping, solve), _no_solution)


def _no_solution(h: Hierarchy | None, resolution: Resolution | None, text: str) -> Exception:
    from mink import NoSolutionFound

    error: Exception = NoSolutionFound("")
    error.args = (text,)
    return error
