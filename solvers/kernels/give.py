"""Rows that give: their sides, moved by what an x misses and by what they give; the exact solve.

`solvers.give` has the method, for any resolver; `solve_giving` is the same around the exact kernel.
"""

from __future__ import annotations

from typing import NamedTuple

from hierarchy.jit import as_matrix, compiled, inlined, inner_product
from solvers.kernels.exact import DAMPING, solve, work_size
from solvers.kernels.rows import ZERO, length_of
from solvers.kernels.space import View, assign, fill, vector
from solvers.status import INACCURATE, SOLVED, TOO_SMALL

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


class Giving(NamedTuple):
    """A hierarchy, its sides (m,) a copy that moves; what rows give (m,); room for K witnesses."""

    A: View
    lower: View
    upper: View
    sizes: View
    reference: View
    give: View
    witnesses: View


@compiled
def solve_giving(A, lower, upper, sizes, x, record, settings, work):
    """Solve as `solvers.give` says, with the exact kernel.

    x (n + m + K n,): the reference, what the rows give, in K levels, and anything; on return the
    answer and, behind what rows give, the witnesses that were found. record: for each witness that
    of the levels down to the last that gives, zeros where none had to be looked for; then that of
    all levels. settings, work, and the codes: as of `solve_hierarchy`.
    """
    (m, n), levels, whole = A.shape, sizes.size, record.size - 3 * A.shape[0] - 3
    if 2 * m + n + work_size(n, m, levels, settings[DAMPING] > 0.0) > work.size:
        return ZERO + TOO_SMALL
    low, at = vector(work, ZERO, m)
    up, at = vector(work, at, m)
    reference, at = vector(work, at, n)
    assign(low, lower)
    assign(up, upper)
    assign(reference, x)
    witnesses = as_matrix(x[n + m:], (x.size - n - m) // n, n)
    g = Giving(A, low, up, sizes, reference, x[n:n + m], witnesses)
    code, last = _find_witnesses(g, x[:n], record[:whole], settings, work[at:])
    if code not in (SOLVED, INACCURATE):
        assign(record[record.size - 3:], record[last:])
        return code
    found = _solve(g, levels, x[:n], record[whole:], settings, work[at:])
    return code if found == SOLVED else found


@inlined
def _find_witnesses(g, x, record, settings, work):
    """Write the witnesses and move the sides; return a code, and where the last record ends."""
    code, first, count, found, at = ZERO + SOLVED, ZERO, ZERO, ZERO, ZERO
    for k in range(g.sizes.size):
        first += g.sizes[k]
        count = ZERO + k + 1 if _gives(g.give, first - g.sizes[k], first) else count
    size, first, accurate = record.size // g.witnesses.shape[0], ZERO, True
    for k in range(count):
        last = first + g.sizes[k]
        if code in (SOLVED, INACCURATE) and _gives(g.give, first, last):
            if at == 0 or misses(g.A, g.lower, g.upper, x, first, last):
                code = _solve(g, count, x, record[at:at + size], settings, work)
                accurate, at = accurate and code == SOLVED, at + size
            if code in (SOLVED, INACCURATE):
                assign(g.witnesses[found], x)
                relax(g.A, g.lower, g.upper, g.give, x, first, last)
                found += 1
        first = last
    fill(record[at:], 0.0)
    return INACCURATE if code == SOLVED and not accurate else code, at - 3


@inlined
def _gives(give, first, last):
    """Whether one of these rows gives."""
    gives = False
    for i in range(first, last):
        gives |= give[i] > 0.0
    return gives


@inlined
def _solve(g, count, x, record, settings, work):
    """Solve the first levels, from the reference."""
    rows = ZERO
    for k in range(count):
        rows += g.sizes[k]
    assign(x, g.reference)
    return solve(g.A[:rows], g.lower[:rows], g.upper[:rows], g.sizes[:count], x, record, settings,
                 work)
