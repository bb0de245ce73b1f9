"""Bounds in a first level, equalities below: where no bound is in the way, the staircase alone.

The exact engine does the rest: bounds cost nothing in its tableau. This file says which bounds an
unknown has, and afterwards which of them it is at and how much of its target each level gets.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.exact import all_equal, solve_exactly
from solvers.kernels.levels import end_of_levels
from solvers.kernels.rows import ZERO, finish
from solvers.kernels.space import View, vector
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    NO_LIMITS,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
)

MET = 1e-10  # of the terms of a row, up to which it is met
NONE, CONFLICT = 0.0, 2.0  # beside -1 and 1: what an unknown that is at no bound does, and at both


class Box(NamedTuple):
    """Bounds of each unknown and the x it had at first (n,); rows of the first level with rows, its
    index.
    """

    low: View
    high: View
    reference: View
    end: View
    top: View


@compiled
def solve_within_bounds(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (n + L + 1,): comes in with the saturation to begin with, or zeros; goes out as what each
    unknown does (-1 or +1: at its lower or upper bound, 2: both, 0: free), the scaling of each
    level, and the steps taken. settings: those of `Hcod`. Returns a Status as `solve_exactly`,
    TOO_SMALL, NO_LIMITS, or -(i + 1) where row i is an inequality that is no bound.
    """
    m, n = A.shape
    sides, at = vector(work, 0, 3 * n)
    inner, at = vector(work, at, 3 * m + 3)
    if at > work.size or end_of_levels(A, lower, upper, sizes, x, work[at:]) > work.size - at:
        return TOO_SMALL
    if all_equal(lower, upper):
        return NO_LIMITS
    top = ZERO
    while sizes[top] == 0:
        top += 1
    box = Box(sides[:n], sides[n:2 * n], sides[2 * n:], sizes[top], top)
    code = _refused(A, lower, upper, box.end)
    if code != SOLVED:
        return code if code < 0 else finish(x, code)
    _intersect(A, lower, upper, box, x)
    known = False
    for c in range(n):
        known |= record[c] != NONE and settings[0] == 0.0
    code = _try_without(A, lower, upper, sizes, x, box, settings, work[at:])
    if code == INACCURATE or known:
        _activate(A, lower, upper, box, record, inner, known)
        for c in range(n):
            x[c] = box.reference[c]
        code = solve_exactly(A, lower, upper, sizes, x, inner, settings, work[at:])
        _put_on_bounds(A, lower, upper, box, inner, x, record)
    else:
        for c in range(n):
            record[c] = CONFLICT if box.low[c] == box.high[c] else NONE
        inner[3 * m], inner[3 * m + 1] = 1.0, 0.0
    _scale(A, upper, sizes, box, x, record)
    record[n + sizes.size] = inner[3 * m] + inner[3 * m + 1]
    return code


@inlined
def _refused(A, lower, upper, end):
    """SOLVED, NUMERICAL_FAILURE at bad data, or -(i + 1) where row i is an inequality no bound.

    In place of an equality with several entries among bounds the first bound is refused.
    """
    sane, refused, bound = True, ZERO, ZERO
    for i in range(lower.size):
        entries, square = 0, 0.0
        for c in range(A.shape[1]):
            entries += A[i, c] != 0.0
            square += A[i, c] * A[i, c]
        sane &= np.isfinite(square) and lower[i] <= upper[i]
        sane &= lower[i] < np.inf and upper[i] > -np.inf
        if i < end and bound == 0 and lower[i] < upper[i]:
            bound = -(ZERO + i + 1)
        if refused == 0 and ((i < end and entries != 1) or (i >= end and lower[i] < upper[i])):
            refused = -(ZERO + i + 1)
    if not sane:
        return ZERO + NUMERICAL_FAILURE
    if refused < 0 and lower[-refused - 1] == upper[-refused - 1] and bound < 0:
        refused = bound
    return refused if refused < 0 else ZERO + SOLVED


@inlined
def _intersect(A, lower, upper, box, x):
    """Write the bounds of each unknown, low above high where its rows exclude each other."""
    for c in range(x.size):
        box.low[c], box.high[c], box.reference[c] = -np.inf, np.inf, x[c]
    for i in range(box.end):
        c = _unknown(A, i)
        one, other = lower[i] / A[i, c], upper[i] / A[i, c]
        box.low[c] = max(box.low[c], min(one, other))
        box.high[c] = min(box.high[c], max(one, other))


@inlined
def _unknown(A, i):
    """The unknown that a bound is on."""
    c = 0
    while A[i, c] == 0.0:
        c += 1
    return c


@inlined
def _try_without(A, lower, upper, sizes, x, box, settings, work):
    """Solve without the bounds; INACCURATE, which nothing else here is, if x is not within them."""
    end = box.end
    code = solve_by_staircase(A[end:], lower[end:], upper[end:], sizes[box.top + 1:], x, settings,
                              work)
    for c in range(x.size):
        if code == SOLVED and not box.low[c] <= x[c] <= box.high[c]:
            code = INACCURATE
    return code


@inlined
def _activate(A, lower, upper, box, record, inner, known):
    """Write the first working set: the bounds that unknowns are said to be at."""
    for i in range(inner.size):
        inner[i] = 0.0
    if not known:
        return
    inner[inner.size - 3] = 1.0
    for i in range(lower.size):
        inner[i] = EQUAL if lower[i] == upper[i] else FREE
    for i in range(box.end):
        c = _unknown(A, i)
        side = record[c] if A[i, c] > 0.0 else -record[c]
        bound = box.high[c] if record[c] > 0.0 else box.low[c]
        row = upper[i] if side > 0.0 else lower[i]
        if abs(record[c]) == 1.0 and lower[i] < upper[i] and row / A[i, c] == bound:
            inner[i] = side


@inlined
def _put_on_bounds(A, lower, upper, box, inner, x, record):
    """Take the rounding out of x where it is at a bound, and say which those are."""
    for c in range(x.size):
        record[c] = CONFLICT if box.low[c] >= box.high[c] else NONE
        if box.low[c] <= box.high[c]:
            x[c] = min(max(x[c], box.low[c]), box.high[c])
    for i in range(box.end):
        c = _unknown(A, i)
        if record[c] == NONE and abs(inner[i]) == 1.0:
            record[c] = inner[i] if A[i, c] > 0.0 else -inner[i]
            x[c] = box.high[c] if record[c] > 0.0 else box.low[c]


@inlined
def _scale(A, b, sizes, box, x, record):
    """Write how much of its target each level gets: 1 - |A_k x - b_k| / |b_k|, not below zero."""
    begin, n = ZERO + box.end, x.size
    for k in range(sizes.size):
        record[n + k] = 1.0
    for c in range(n):
        if box.low[c] > box.high[c]:
            record[n + box.top] = 0.0
    for k in range(box.top + 1, sizes.size):
        missed = asked = 0.0
        met = True
        for i in range(begin, begin + sizes[k]):
            over, terms = -b[i], abs(b[i])
            for c in range(n):
                over += A[i, c] * x[c]
                terms += abs(A[i, c] * x[c])
            met &= abs(over) <= MET * terms
            missed += over * over
            asked += b[i] * b[i]
        begin += sizes[k]
        if not met:
            record[n + k] = 1.0 - np.sqrt(missed / asked) if missed < asked else 0.0
