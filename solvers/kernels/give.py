"""Rows that give: their sides, moved by what an x misses and by what they give; the exact solve.

`solvers.give` has the method, for any resolver; `solve_giving` is the same with one working set of
the exact kernel: rows are loaded once, and levels in which the same rows act are factored once.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import as_matrix, compiled, inlined, inner_product
from solvers.kernels.active_set.exact import (
    answer,
    exact_size,
    keep_staircase,
    open_working_set,
)
from solvers.kernels.active_set.working_set import (
    FACTORED,
    FIRST,
    LOWER,
    SCALE,
    UPPER,
    WorkingSet,
    neglect,
    restore,
    start_from,
)
from solvers.kernels.linalg.rows import finish, length_of
from solvers.kernels.linalg.space import assign, fill
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL

_ROUNDING = 1e-10  # of a violation, relative to |a| (1 + |x|)


@inlined
def _miss(a, lower, upper, x):
    """Return by how much a row is missed at x, zero where that is rounding."""
    value = inner_product(a, x)
    miss = max(value - upper, lower - value, 0.0)
    return miss if miss > _ROUNDING * length_of(a) * (1.0 + length_of(x)) else 0.0


@compiled
def misses(A, lower, upper, x, first, last):
    """Whether x misses one of the rows from `first` to before `last`."""
    missed = False
    for i in range(first, last):
        missed |= _miss(A[i], lower[i], upper[i], x) > 0.0
    return missed


@compiled
def relax(A, lower, upper, give, x, first, last):
    """Move the sides of these rows in place, as `Hierarchy.relaxed` does; by NaN if below zero."""
    for i in range(first, last):
        room = _miss(A[i], lower[i], upper[i], x) + (give[i] if give[i] >= 0.0 else np.nan)
        lower[i] -= room
        upper[i] += room

Giving = namedtuple("Giving", "A lower upper give witnesses")
"""Rows (m, n) and sides (m,) as they are; what rows give (m,); room for K witnesses (K, n)."""


@compiled
def solve_giving(A, lower, upper, sizes, x, record, settings, work):
    """Solve as `solvers.give` says, with the exact kernel.

    x (n + m + K n,): the reference, what the rows give, in K levels, and anything; on return the
    answer and, behind what rows give, the witnesses that were found. record: for each witness that
    of the levels down to the last that gives, zeros where none had to be looked for; then that of
    all levels, as it was if a witness was not found. settings, work, and the codes: as of
    `solve_hierarchy`.
    """
    (m, n), whole = A.shape, record.size - 3 * A.shape[0] - 3
    if exact_size(n, m, sizes.size) > work.size:
        return TOO_SMALL
    s, code, at = open_working_set(A, lower, upper, sizes, x[:n], record[whole:], settings, work)
    for i in range(m):
        code = code if x[n + i] >= 0.0 else NUMERICAL_FAILURE
    if code == SOLVED:
        g = Giving(A, lower, upper, x[n:n + m], as_matrix(x[n + m:], (x.size - n - m) // n, n))
        code = _find_witnesses(s, g, record[:whole], settings, work[at:])
    if code == NUMERICAL_FAILURE:
        keep_staircase(lower, upper, record[whole:])
        return finish(x[:n], code)
    if code not in (SOLVED, INACCURATE):
        return code
    _begin(s, record[whole:])
    found = answer(s, record[whole:], settings, work[at:])
    return code if found == SOLVED else found


@inlined
def _find_witnesses(s, g, record, settings, work):
    """Write the witnesses and move the sides; return a code."""
    code, count, found, at, room, accurate = SOLVED, 0, 0, 0, 0, True
    for k in range(s.multiplier.shape[0] - 1):
        count = k + 1 if _gives(s, g, k) else count
    size, rows = record.size // g.witnesses.shape[0], s.A[:s.index[FIRST, count]]
    part = WorkingSet(rows, s.x, s.number, s.index, s.count, s.scalar, s.multiplier[:count + 1],
                      s.W, s.basis, s.T, s.C)  # of the first levels, in the same memory
    for k in range(count):
        if code in (SOLVED, INACCURATE) and _gives(s, g, k):
            if at == 0 or misses(g.A, g.lower, g.upper, s.x, room, s.index[FIRST, k + 1]):
                _begin(part, record[at:at + size])
                code = answer(part, record[at:at + size], settings, work)
                accurate, at = accurate and code == SOLVED, at + size
            if code in (SOLVED, INACCURATE):
                assign(g.witnesses[found], s.x)
                _relax(s, g, k)
                found, room = found + 1, s.index[FIRST, k + 1]
    fill(record[at:], 0.0)
    return INACCURATE if code == SOLVED and not accurate else code


@inlined
def _gives(s, g, k):
    """Whether one of the rows of a level gives."""
    return g.give[s.index[FIRST, k]:s.index[FIRST, k + 1]].any()


@inlined
def _begin(s, record):
    """Begin with the rows that act in a record, as they were before any was cut or taken up."""
    restore(s)
    neglect(s)
    start_from(s, record)


@inlined
def _relax(s, g, k):
    """Move the sides of level k, which is then factored anew."""
    for i in range(s.index[FIRST, k], s.index[FIRST, k + 1]):
        room = s.scalar[SCALE] * (_miss(g.A[i], g.lower[i], g.upper[i], s.x) + g.give[i])
        s.number[LOWER, i] -= room
        s.number[UPPER, i] += room
    s.count[FACTORED] = min(s.count[FACTORED], k)
