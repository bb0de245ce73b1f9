"""What the `solve_ik` of both packages share: the levels are packed, resolved and looked at."""

import warnings
from collections.abc import Callable
from functools import cache, partial
from itertools import pairwise
from pkgutil import iter_modules
from typing import Any

import numpy as np

from hierarchy.errors import expect, number
from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from solvers.adapters.displacements import ContradictionError, Packed, Solve
from solvers.adapters.packing import largest_violation
from solvers.resolver import Resolution, Resolver, make
from solvers.resolvers.hcod import Hcod, solve_exactly
from solvers.status import SOLVED, Status

Failed = Callable[[Hierarchy | None, Resolution | None, str], Exception]  # what is raised then

_ALWAYS = ("limits", "constraints")
_noted: set[tuple[str, ...]] = set()


def answer(solver: str | Resolver, settings: dict[str, Any], damping: float, tolerance: float,
           pack: Callable[[Solve], Packed], failed: Failed) -> Array:
    """Return the x (n,) of the levels that `pack` makes, given what solves those to be held.

    solver, settings, damping, tolerance : as `for_pink.solve_ik` takes them.
    """
    resolver = _resolver(solver, settings) if isinstance(solver, str) else solver
    expect("solver", resolver, Resolver, "give a name of solvers.names()")
    number("damping", damping, 0.0)
    number("tolerance", tolerance, 0.0)
    solve = partial(_solved, resolver, tolerance, failed)
    try:
        levels: Any = pack(solve)
        if type(resolver) is Hcod:  # without making a Hierarchy, which only says what is wrong
            x = levels.reference.copy()
            solved = solve_exactly(levels, x, np.zeros(3 * levels.count + 3), resolver) == SOLVED
            held = largest_violation(levels.A, *levels.sides, x, 0, levels.always) <= tolerance
            if solved and held:
                return np.asarray(x)
        return solve(levels.hierarchy())
    except ContradictionError as error:
        raise failed(None, None, str(error)) from error


def _solved(resolver: Resolver, tolerance: float, failed: Failed, h: Hierarchy) -> Array:
    """Return x; raises what `failed` makes unless limits and constraints hold."""
    resolution = resolver.solve(h)
    if resolution.status is not Status.SOLVED:
        raise failed(h, resolution, f"{resolver.name}: {resolution.status}")
    if conflict := _conflict(resolver, h, resolution.x, tolerance):
        raise failed(h, resolution, conflict)
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
                      f"order by 'hcod'{unused}", stacklevel=4)
    return _made("hcod")


@cache
def _made(name: str) -> Resolver:
    return make(name)


@cache
def _qp_solvers() -> frozenset[str]:
    """Return the names that qpsolvers knows, installed or not: one module each."""
    from qpsolvers import solvers

    return frozenset(module.name.rstrip("_") for module in iter_modules(solvers.__path__))


def _conflict(resolver: Resolver, h: Hierarchy, x: Array, tolerance: float) -> str:
    """Return which limits or constraints x misses, a strict resolver at best; "" if none."""
    A, lower, upper, _ = h.rows
    for name, (first, last) in zip(h.names, pairwise(h.offsets.tolist()), strict=True):
        if name not in _ALWAYS:
            break
        if largest_violation(A, lower, upper, x, first, last) > tolerance:
            misses, names = np.abs(h.slacks(x)), h.named() if h.named else ()
            rows = [f"{names[i]} by {misses[i]:.3g}" for i in range(first, last)
                    if misses[i] > tolerance]
            why = ("cannot all hold; at best" if resolver.strict
                   else f"do not hold with {resolver.label}, which is not strict;")
            return f"the {name} {why} these are violated: {listed(rows)}"
    return ""
