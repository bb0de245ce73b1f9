"""A `solve_ik` like that of pink, with strict priorities."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from functools import cache, partial
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.adapters.displacements import ContradictionError, Task
from solvers.adapters.from_pink import packed
from solvers.adapters.packing import largest_violation
from solvers.resolver import Resolution, Resolver, make
from solvers.resolvers.hcod import Hcod, solve_exactly
from solvers.status import SOLVED, Status

if TYPE_CHECKING:
    from pink import Configuration
    from pink.barriers import Barrier
    from pink.limits import Limit

_ALWAYS = ("limits", "constraints")
_noted: set[tuple[str, ...]] = set()


def solve_ik(configuration: Configuration, tasks: Iterable[Task | Sequence[Task]], dt: float,
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
        the levels above. A level above others is exact up to 1e-12, pink's default; if its weights
        are more it keeps what it reaches, which is one solve more.
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
    resolver = _resolver(solver, of_the_solver) if isinstance(solver, str) else solver
    configuration.check_limits(safety_break=safety_break)
    if not 0.0 <= damping < np.inf:
        raise HierarchyError(f"damping {damping} must not be negative")
    solve = partial(_solved, resolver, tolerance)
    try:
        levels = packed(configuration, tasks, dt, limits, barriers, constraints, damping, solve)
        x = _at_once(resolver, levels, tolerance) if type(resolver) is Hcod else None
        return solve(levels.hierarchy()) if x is None else x
    except ContradictionError as error:
        raise _no_solution(None, None, str(error)) from error


def _at_once(resolver: Hcod, levels: Any, tolerance: float) -> Array | None:
    """Return what `_solved` does without making a Hierarchy, or None where that has more to say."""
    x = np.zeros(levels.n)
    solved = solve_exactly(levels, x, np.zeros(3 * levels.count + 3), resolver._settings) == SOLVED
    always = sum([size for name, size in zip(levels.names, levels.sizes, strict=True)
                  if name in _ALWAYS])
    held = largest_violation(levels.A, *levels.sides, x, 0, always) <= tolerance
    return x if solved and held else None


def _solved(resolver: Resolver, tolerance: float, h: Hierarchy) -> Array:
    """Return x; raises NoSolutionFound unless limits and constraints hold."""
    resolution = resolver.solve(h)
    if resolution.status is not Status.SOLVED:
        raise _no_solution(h, resolution, f"{resolver.name}: {resolution.status}")
    _check_held(h, resolution, tolerance)
    return np.asarray(resolution.x)


def _resolver(solver: str, settings: dict[str, Any]) -> Resolver:
    """Return the resolver for a name, which may be that of a solver of qpsolvers."""
    if solver not in _qp_solvers():
        return make(solver, **settings) if settings else _made(solver)
    note = (solver, *sorted(settings))
    if note not in _noted:
        _noted.add(note)
        unused = f"; without effect: {', '.join(note[1:])}" if settings else ""
        warnings.warn(f"solver {solver!r} minimises one cost; the tasks are resolved in strict "
                      f"order by 'hcod'{unused}", stacklevel=3)
    return _made("hcod")


@cache
def _made(name: str) -> Resolver:
    return make(name)


@cache
def _qp_solvers() -> frozenset[str]:
    """Return the names that qpsolvers knows, installed or not: one module each."""
    from qpsolvers import solvers

    return frozenset(module.name.rstrip("_") for module in iter_modules(solvers.__path__))


def _check_held(h: Hierarchy, resolution: Resolution, tolerance: float) -> None:
    """Raise NoSolutionFound if limits or constraints do not hold."""
    A, lower, upper, sizes = h.rows
    first = 0
    for name, size in zip(h.names, sizes.tolist(), strict=True):
        if name not in _ALWAYS:
            return
        last = first + size
        if largest_violation(A, lower, upper, resolution.x, first, last) > tolerance:
            raise _no_solution(h, resolution, _conflict(h, resolution.x, name, first, last,
                                                        tolerance))
        first = last


def _conflict(h: Hierarchy, x: Array, name: str, first: int, last: int, tolerance: float) -> str:
    """Say which rows contradict each other: where |misses| is least, those that miss."""
    misses, names = np.abs(h.slacks(x)), h.named() if h.named else ()
    rows = [f"{names[i]} by {misses[i]:.3g}" for i in range(first, last) if misses[i] > tolerance]
    return f"the {name} cannot all hold; at best these are violated: {listed(rows)}"


def _no_solution(h: Hierarchy | None, resolution: Resolution | None, text: str) -> Exception:
    from pink.exceptions import NoSolutionFound

    error: Exception = NoSolutionFound(h, resolution)
    error.args = (text,)
    return error
