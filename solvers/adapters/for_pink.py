"""A `solve_ik` like that of pink, with strict priorities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from hierarchy.problem import Array, Hierarchy
from solvers.adapters.displacements import Task, Tasks
from solvers.adapters.drop_in import answer
from solvers.adapters.from_pink import packed
from solvers.resolver import Resolution, Resolver

if TYPE_CHECKING:
    from pink import Configuration
    from pink.barriers import Barrier
    from pink.limits import Limit


def solve_ik(configuration: Configuration, tasks: Tasks, dt: float,
             solver: str | Resolver = "hcod", damping: float = 1e-12,
             limits: Iterable[Limit] | None = None, barriers: Iterable[Barrier] | None = None,
             constraints: Iterable[Task] | None = None, safety_break: bool = True, *,
             tolerance: float = 1e-6, **of_the_solver: Any) -> Array:
    """Return the joint velocity (n,) [rad/s or m/s] that serves pink's tasks in strict order.

    Takes the arguments of `pink.solve_ik`, all nine in its order, and differs in one thing: the
    order of `tasks` is their priority. An entry may be a sequence of tasks that share a level,
    weighted by their costs as in pink.

    dt : period [s].
    solver : the name of a resolver of this package, or a resolver. The name of a solver of
        qpsolvers is accepted: `hcod` answers in its place, and a warning says so once.
    damping, and lm_damping of a task, and safe_displacement_gain of a barrier: as in pink, within
        the levels above. Up to 1e-12, pink's default, a level is exact and the shortest of equal
        steps is taken; a level above others with more keeps what it reaches: one solve more.
    limits, barriers, constraints : as in pink. They come first, and must hold to `tolerance`
        [rad/s, or the unit of the row].
    of_the_solver : settings of the resolver; those of a solver of qpsolvers have no effect.

    Raises
    ------
    pink.exceptions.NotWithinConfigurationLimits : as in pink, unless `safety_break` is false.
    pink.exceptions.NoSolutionFound : limits or constraints cannot hold, or the resolver failed;
        says which.
    HierarchyError : an unknown solver or setting, or rows that the resolver cannot handle.
    """
    configuration.check_limits(safety_break=safety_break)
    return answer(solver, of_the_solver, damping, tolerance, lambda solve: packed(
        configuration, tasks, dt, limits, barriers, constraints, damping, solve), _no_solution)


def _no_solution(h: Hierarchy | None, resolution: Resolution | None, text: str) -> Exception:
    from pink.exceptions import NoSolutionFound

    error: Exception = NoSolutionFound(h, resolution)
    error.args = (text,)
    return error
