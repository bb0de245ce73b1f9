"""A `solve_ik` like that of pink, with strict priorities."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.adapters.displacements import Task
from solvers.adapters.from_pink import hierarchy
from solvers.resolver import Resolution, Resolver, make
from solvers.status import Status

if TYPE_CHECKING:
    from pink import Configuration
    from pink.barriers import Barrier
    from pink.limits import Limit

_ALWAYS = ("limits", "constraints")


def solve_ik(configuration: Configuration, tasks: Iterable[Task | Sequence[Task]], dt: float,
             solver: str | Resolver = "hcod", *, limits: Iterable[Limit] | None = None,
             barriers: Iterable[Barrier] | None = None,
             constraints: Iterable[Task] | None = None, safety_break: bool = True,
             tolerance: float = 1e-6) -> Array:
    """Return the joint velocity (n,) [rad/s or m/s] that serves pink's tasks in strict order.

    Called like `pink.solve_ik`, with three differences. The order of `tasks` is their priority, and
    an entry may be a sequence of tasks that share a level, weighted by their costs. `solver` is the
    name of a resolver of this package, or a resolver. There is no `damping`: of all velocities that
    serve the tasks equally well the shortest is returned, the limit of pink's as its damping tends
    to zero.

    dt : period [s].
    limits, barriers, constraints : as in pink. They come first, and must hold to `tolerance`
        [rad/s, or the unit of the row].

    Raises
    ------
    pink.exceptions.NotWithinConfigurationLimits : as in pink, unless `safety_break` is false.
    pink.exceptions.NoSolutionFound : limits or constraints cannot hold, or the resolver failed;
        says which.
    HierarchyError : an unknown resolver, rows it cannot resolve, or a weight that has no meaning in
        a strict order; see `solvers.adapters.from_pink.hierarchy`.
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
            raise _no_solution(h, resolution, f"the {name} cannot all hold: they are violated by "
                                              f"at least {broken[name]:.3g}")
    return np.asarray(resolution.x)


def _no_solution(h: Hierarchy, resolution: Resolution, text: str) -> Exception:
    from pink.exceptions import NoSolutionFound

    error: Exception = NoSolutionFound(h, resolution)
    error.args = (text,)
    return error
