"""Rows that give: their sides, moved by what an x misses and by what they give."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.rows import length_of

_ROUNDING = 1e-10  # of a violation, relative to 1 + |a| |x|


@inlined
def _miss(a, lower, upper, x):
    """Return by how much a row is missed at x, zero where that is rounding."""
    value = inner_product(a, x)
    miss = max(value - upper, lower - value, 0.0)
    return miss if miss > _ROUNDING * (1.0 + length_of(a) * length_of(x)) else 0.0


@compiled
def misses(A, lower, upper, x, first, last):
    """Whether x misses one of the rows from `first` to before `last`."""
    missed = False
    for i in range(first, last):
        missed |= _miss(A[i], lower[i], upper[i], x) > 0.0
    return missed


@compiled
def relax(A, lower, upper, give, x, first, last):
    """Move the sides of these rows in place, as `Hierarchy.relaxed` does."""
    for i in range(first, last):
        room = _miss(A[i], lower[i], upper[i], x) + give[i]
        lower[i] -= room
        upper[i] += room
