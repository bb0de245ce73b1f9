"""Kernels that write tasks and limits of pink and mink into the rows of a hierarchy.

An adapter is called once per tick of somebody's loop; small arrays in numpy would take longer than
the solve.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled
from solvers.kernels.tableau import reflect_columns

ODD = -1         # returned for rows with numbers that are not finite, apart from missing limits
CONTRADICT = -2  # returned for bounds that no value meets


@compiled
def write_limits(G, h, period, bounds, A, low, up, row):
    """Write the rows G x <= h / period on several unknowns from `row` on.

    Rows on a single one narrow its bounds, two of (n,); rows with infinite h are no limits.
    Returns the row after them, or ODD.
    """
    lower, upper = bounds
    for i in range(len(h)):
        if np.isnan(h[i]) or h[i] == -np.inf:
            return ODD
        if h[i] == np.inf:
            continue
        unknown, count = -1, 0
        for c in range(G.shape[1]):
            if not np.isfinite(G[i, c]):
                return ODD
            if G[i, c] != 0.0:
                unknown, count = c, count + 1
        if count != 1:
            for c in range(A.shape[1]):
                A[row, c] = G[i, c]
            low[row], up[row] = -np.inf, h[i] / period
            row += 1
        elif G[i, unknown] > 0.0:
            upper[unknown] = min(upper[unknown], h[i] / period / G[i, unknown])
        else:
            lower[unknown] = max(lower[unknown], h[i] / period / G[i, unknown])
    return row


@compiled
def write_bounds(lower, upper, A, low, up, row):
    """Write the bounds that exist as rows of the identity from `row` on.

    Returns the row after them, or CONTRADICT.
    """
    for c in range(len(lower)):
        if lower[c] > upper[c]:
            return CONTRADICT
        if lower[c] == -np.inf and upper[c] == np.inf:
            continue
        for j in range(A.shape[1]):
            A[row, j] = 0.0
        A[row, c] = 1.0
        low[row], up[row] = lower[c], upper[c]
        row += 1
    return row


@compiled
def write_task(J, e, cost, rate, A, low, up, row):
    """Write cost J x = -cost rate e from `row` on, without rows that cost nothing.

    Returns the row after them, or ODD.
    """
    for i in range(len(e)):
        if cost[i] == 0.0:
            continue
        value = -cost[i] * rate * e[i]
        if not np.isfinite(value):
            return ODD
        for c in range(A.shape[1]):
            A[row, c] = cost[i] * J[i, c]
            if not np.isfinite(A[row, c]):
                return ODD
        low[row] = up[row] = value
        row += 1
    return row


@compiled
def largest_violation(A, lower, upper, x, first, last):
    """The largest distance of a row from its bounds at x, over the rows from first to last."""
    largest = 0.0
    for i in range(first, last):
        value = 0.0
        for c in range(A.shape[1]):
            value += A[i, c] * x[c]
        largest = max(largest, value - upper[i], lower[i] - value)
    return largest


@compiled
def squared(cost, e):
    """|cost e|^2, row by row."""
    total = 0.0
    for i in range(len(e)):
        total += (cost[i] * e[i]) ** 2
    return total


@compiled
def write_pull(A, lower, upper, weight, centre, row):
    """Write sqrt(weight) x = sqrt(weight) centre from `row` on."""
    root = np.sqrt(weight)
    for i in range(len(centre)):
        for c in range(A.shape[1]):
            A[row + i, c] = root if c == i else 0.0
        lower[row + i] = upper[row + i] = root * centre[i]


@compiled
def make_triangular(A, lower, upper, first, last):
    """Replace the rows A x = lower from first to last, of rank n, by n rows from `first` on.

    |A x - lower|^2 of the new ones is less by what no x can change.
    """
    m, n = last - first, A.shape[1]
    M, total = np.empty((m, n + 1)), np.empty(n + 1)
    for i in range(m):
        for c in range(n):
            M[i, c] = A[first + i, c]
        M[i, n] = lower[first + i]
    for k in range(n):
        reflect_columns(M, k, m, k, k + 1, total)
    for i in range(n):
        for c in range(n):
            A[first + i, c] = M[i, c] if c >= i else 0.0
        lower[first + i] = upper[first + i] = M[i, n]
