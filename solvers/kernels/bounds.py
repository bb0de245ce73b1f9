"""Bounds in a first level, equalities below.

Where no bound is active the staircase solves them, else the exact resolver, in whose tableau bounds
cost nothing. This file also finds the saturation of each unknown and the scaling of each level.
"""

import numpy as np

from hierarchy.jit import compiled, inlined, internal
from solvers.kernels.active_set.exact import DAMPING, solve, work_size
from solvers.kernels.box import first_level, narrow, refused
from solvers.kernels.linalg.rows import all_equal, finish, only_entry
from solvers.kernels.linalg.space import assign, fill
from solvers.kernels.staircase import solve_by_staircase
from solvers.kernels.tolerances import LEVEL_MET
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL, UNPROVED

NONE, CONFLICT = 0.0, 2.0  # besides -1 and 1: an unknown at no bound, or at both


@compiled
def solve_within_bounds(A, lower, upper, sizes, x, record, settings, work):
    """Solve like `Tpm`: from a record at bounds exactly; else, or if none is active there, anew.

    x (n,) is the reference on entry and the answer on return, zero on failure. record
    (n + L + 3 m + 3,): see `_is_at_bound`; that of an earlier solve or zeros on entry, and zeros
    on return where all rows are equalities. settings: those of `Hcod`. Returns a status, TOO_SMALL,
    or -(i + 1) if row i is an inequality but not a bound.
    """
    (m, n), inner, known = A.shape, record[x.size + sizes.size:], False
    size = work_size(n, m, sizes.size, settings[DAMPING] > 0.0)
    if size + n > work.size:
        return TOO_SMALL
    reference, work = work[size:size + n], work[:size]
    assign(reference, x)
    for i in range(record.size):
        known |= record[i] != 0.0
    if known:
        code = solve(A, lower, upper, sizes, x, inner, settings, work)
        if code != NUMERICAL_FAILURE and _is_at_bound(A, lower, upper, sizes, x, record, work):
            return code
        fill(record, 0.0)
        assign(x, reference)
    code = solve_by_staircase(A, lower, upper, sizes, x, settings, work)
    if code == INACCURATE:
        assign(x, reference)
        code = solve(A, lower, upper, sizes, x, inner, settings, work)
        fill(record, 0.0)
    if code >= 0:
        return code
    assign(x, reference)
    code = _solve_without_bounds(A, lower, upper, sizes, x, inner, settings, work)
    if code == UNPROVED:
        assign(x, reference)
        code = solve(A, lower, upper, sizes, x, inner, settings, work)
    if code >= 0 and code != NUMERICAL_FAILURE:
        _is_at_bound(A, lower, upper, sizes, x, record, work)
    return code


@inlined
def _solve_without_bounds(A, lower, upper, sizes, x, inner, settings, work):
    """Solve as if there were no bounds; return SOLVED if x is within them, otherwise UNPROVED.

    Other codes: NUMERICAL_FAILURE, or -(i + 1) if row i is an inequality but not a bound.
    """
    top, end = first_level(sizes)
    code = refused(A, lower, upper, end)
    if code != SOLVED:
        return finish(x, code) if code == NUMERICAL_FAILURE else code
    low, high = _intersect(A[:end], lower, upper, work)
    within = SOLVED == solve_by_staircase(A[end:], lower[end:], upper[end:], sizes[top + 1:], x,
                                          settings, work[2 * x.size:])
    for c in range(x.size):
        within &= low[c] < high[c] and low[c] <= x[c] <= high[c]
    inner[inner.size - 3] = 1.0 if within else 0.0
    return SOLVED if within else UNPROVED


@internal
def _is_at_bound(A, lower, upper, sizes, x, record, work):
    """Whether x has an unknown at a bound; remove rounding there, and write what the record has.

    Its first part has the state of each unknown (-1 or +1: at its lower or upper bound, 2: both, 0:
    free) and the scaling of each level. The second is the record of the exact resolver.
    Without bounds in the first level, or with other inequalities, nothing is written.
    """
    if all_equal(lower, upper):
        return False
    n, found, (top, end) = x.size, False, first_level(sizes)
    inner = record[n + sizes.size:]
    if refused(A, lower, upper, end) != SOLVED:
        return False
    low, high = _intersect(A[:end], lower, upper, work)
    for c in range(n):
        record[c] = CONFLICT if low[c] >= high[c] else NONE
        if low[c] <= high[c]:
            x[c] = min(max(x[c], low[c]), high[c])
    for i in range(end):
        c = only_entry(A[i])
        if record[c] == NONE and abs(inner[i]) == 1.0:
            record[c] = inner[i] if A[i, c] > 0.0 else -inner[i]
            x[c] = high[c] if record[c] > 0.0 else low[c]
    _scale(A, upper, sizes, x, record)
    for c in range(n):
        found |= record[c] != NONE
        if low[c] > high[c]:
            record[n + top] = 0.0
    return found


@inlined
def _intersect(A, lower, upper, sides):
    """Return the bounds of each unknown; low exceeds high where rows of A contradict each other."""
    n = A.shape[1]
    low, high = sides[:n], sides[n:2 * n]
    fill(low, -np.inf)
    fill(high, np.inf)
    for i in range(A.shape[0]):
        narrow(low, high, A[i], lower[i], upper[i])
    return low, high


@inlined
def _scale(A, b, sizes, x, record):
    """Write the scaling of each level: 1 - |A_k x - b_k| / |b_k|, not below zero."""
    n, (top, begin) = x.size, first_level(sizes)
    fill(record[n:n + sizes.size], 1.0)
    for k in range(top + 1, sizes.size):
        missed = asked = 0.0
        met = True
        for i in range(begin, begin + sizes[k]):
            over, terms = -b[i], abs(b[i])
            for c in range(n):
                over += A[i, c] * x[c]
                terms += abs(A[i, c] * x[c])
            met &= abs(over) <= LEVEL_MET * terms
            missed += over * over
            asked += b[i] * b[i]
        begin += sizes[k]
        if not met:
            record[n + k] = 1.0 - np.sqrt(missed / asked) if missed < asked else 0.0
