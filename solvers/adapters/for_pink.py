"""`solve_ik` with the call of `pink.solve_ik`, under strict priorities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hierarchy.problem import Array
from solvers.adapters.from_pink import hierarchy
from solvers.resolver import Resolver, make
from solvers.status import Status

_ALWAYS = ("limits", "constraints")


def solve_ik(configuration: Any, tasks: Iterable[Any], dt: float, solver: str | Resolver = "hcod",
             limits: Iterable[Any] | None = None, barriers: Iterable[Any] | None = None,
             constraints: Iterable[Any] | None = None, safety_break: bool = True,
             tolerance: float = 1e-6) -> Array:
    """Return the joint velocity (n,) [rad/s or m/s] that serves pink's tasks in strict order.

    Called as `pink.solve_ik`, but for three things. The order of `tasks` is their priority, and an
    entry may be a list of tasks that share a level, weighted by their costs. `solver` names one of
    our resolvers, or is one with its settings. There is no `damping`: of all velocities that
    serve the tasks equally well the shortest is taken, which is what pink's tends to as its
    damping tends to zero.

    limits, barriers, constraints : as in pink. They come first, and must hold to `tolerance`
        [rad/s, or the unit of the row].

    Raises
    ------
    pink.exceptions.NotWithinConfigurationLimits : as in pink, unless `safety_break` is false.
    pink.exceptions.NoSolutionFound : limits or constraints cannot hold, or the resolver gave no
        answer; says which.
    HierarchyError : an unknown resolver, rows it does not resolve, or a weight that has no meaning
        in a strict order, see `solvers.adapters.from_pink.hierarchy`.
    """
    resolver = make(solver) if isinstance(solver, str) else solver
    configuration.check_limits(safety_break=safety_break)
    h = hierarchy(configuration, tasks, dt, limits, barriers, constraints)
    resolution = resolver.solve(h)
    if resolution.status is not Status.SOLVED:
        raise _no_solution(h, resolution, f"{resolver.name}: {resolution.status}")
    broken = dict(zip(h.names, h.violations(resolution.x), strict=True))
    for name in _ALWAYS:
        if broken.get(name, 0.0) > tolerance:
            raise _no_solution(h, resolution, f"the {name} cannot all hold: they are missed by "
                                              f"{broken[name]:.3g} at best")
    return np.asarray(resolution.x)


def _no_solution(h: Any, resolution: Any, text: str) -> Exception:
    from pink.exceptions import NoSolutionFound

    error: Exception = NoSolutionFound(h, resolution)
    error.args = (text,)
    return error
