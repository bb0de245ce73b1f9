"""Bounds on single unknowns in the first level that has rows."""

import numpy as np

from hierarchy.jit import inlined, inner_product
from solvers.kernels.linalg.rows import only_entry
from solvers.status import NUMERICAL_FAILURE, SOLVED


@inlined
def first_level(sizes):
    """Return the first level that has rows, and their number; if none has, L and 0."""
    top = 0
    while top < sizes.size and sizes[top] == 0:
        top += 1
    return top, sizes[top] if top < sizes.size else 0


@inlined
def refused(A, lower, upper, end):
    """Return SOLVED, NUMERICAL_FAILURE for bad data, or -(i + 1) if row i must be rejected.

    An inequality that is not a bound is rejected. If the first level, of rows before `end`, also
    has an equality with several entries, its bounds do not count as bounds, and the first of them
    is rejected.
    """
    sane, mixed, refused, bound = True, False, 0, 0
    for i in range(lower.size):
        only = only_entry(A[i])
        single, entry = only >= 0, A[i, only] if only >= 0 else 1.0
        sane &= np.isfinite(inner_product(A[i], A[i])) and lower[i] <= upper[i]
        sane &= lower[i] < np.inf and upper[i] > -np.inf
        if i < end and single:
            sane &= np.isfinite(lower[i] / entry) or not np.isfinite(lower[i])
            sane &= np.isfinite(upper[i] / entry) or not np.isfinite(upper[i])
        mixed |= i < end and not single
        if lower[i] == upper[i]:
            continue
        if i < end and single and bound == 0:
            bound = -(i + 1)
        elif refused == 0 and (i >= end or not single):
            refused = -(i + 1)
    if not sane:
        return NUMERICAL_FAILURE
    if refused == 0 and mixed:
        refused = bound
    return refused if refused < 0 else SOLVED


@inlined
def narrow(low, high, a, lower, upper):
    """Narrow the bounds of the unknown that a row names alone; return the unknown."""
    c = only_entry(a)
    one, other = lower / a[c], upper / a[c]
    low[c], high[c] = max(low[c], min(one, other)), min(high[c], max(one, other))
    return c
