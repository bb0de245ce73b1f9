"""Kernels that write tasks and limits of pink and mink into the rows of a hierarchy.

An adapter is called once per tick of somebody's loop; small arrays in numpy would take longer than
the solve. All that is given stands in one table, a row for each row of a limit or task: n entries
of G or J, then h or e, and of a task its cost, gain and lm_damping.
"""

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.active_set.tableau import reflect_columns
from solvers.kernels.box import narrow
from solvers.kernels.linalg.rows import all_finite, only_entry
from solvers.kernels.linalg.space import assign, fill
from solvers.kernels.tolerances import NEGLIGIBLE

GIVEN = 4        # columns of the table after those of the unknowns
ODD = -1         # returned for rows with numbers that are not finite, apart from missing limits
CONTRADICT = -2  # returned for bounds that no value meets, minus the number of the unknown
NO_DAMPING = 1e-12  # pink's default: such a weight only picks the shortest of equal steps


@compiled
def write_limits(table, first, last, period, bounds, A, sides):
    """Write the rows G x <= h / period of the table from row 0 on, after them those on one unknown.

    Of these each unknown that has any gets one row; bounds (2, n) are what they leave it. Entries
    that are rounding beside the largest become zero, and rows with infinite h are no limits.
    Returns the row after them, ODD or CONTRADICT.
    """
    n, row = A.shape[1], 0
    least = NEGLIGIBLE * _largest(table[first:last, :n])
    fill(bounds[0], -np.inf)
    fill(bounds[1], np.inf)
    for i in range(first, last):
        g, h = table[i, :n], table[i, n] / period
        if h == np.inf:
            continue
        if not (h > -np.inf and all_finite(g)):
            return ODD
        for c in range(n):
            g[c] = 0.0 if abs(g[c]) <= least else g[c]
        if only_entry(g) >= 0:
            narrow(bounds[0], bounds[1], g, -np.inf, h)
        else:
            assign(A[row], g)
            sides[0, row], sides[1, row] = -np.inf, h
            row += 1
    return _write_bounds(bounds, A, sides, row)


@inlined
def _largest(rows):
    """The largest entry of rows, without its sign."""
    largest = 0.0
    for i in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            largest = max(largest, abs(rows[i, c]))
    return largest


@inlined
def _write_bounds(bounds, A, sides, row):
    for c in range(A.shape[1]):
        if bounds[0, c] > bounds[1, c]:
            return CONTRADICT - c
        if bounds[0, c] > -np.inf or bounds[1, c] < np.inf:
            fill(A[row], 0.0)
            A[row, c] = 1.0
            sides[0, row], sides[1, row] = bounds[0, c], bounds[1, c]
            row += 1
    return row


@compiled
def write_tasks(table, first, last, period, A, sides, row):
    """Write the rows cost J x = -cost gain / period e of the table from `row` on.

    Rows that cost nothing are left out, and those that are rounding beside the largest entry of the
    table so far become zero. Returns the row after them, or ODD.
    """
    n, least = A.shape[1], NEGLIGIBLE * _largest(table[:last, :A.shape[1]])
    for i in range(first, last):
        cost = table[i, n + 1]
        if cost == 0.0:
            continue
        value = -cost * (table[i, n + 2] / period) * table[i, n]
        for c in range(n):
            A[row, c] = cost * table[i, c]
        if not (np.isfinite(value) and all_finite(A[row])):
            return ODD
        if _largest(table[i:i + 1, :n]) <= least:
            fill(A[row], 0.0)
        sides[0, row] = sides[1, row] = value
        row += 1
    return row


@compiled
def largest_violation(A, lower, upper, x, first, last):
    """The largest distance of a row from its bounds at x, over the rows from first to last."""
    largest = 0.0
    for i in range(first, last):
        value = inner_product(A[i], x)
        largest = max(largest, value - upper[i], lower[i] - value)
    return largest


@compiled
def damp(table, first, last, pull, A, sides, row, end):
    """Weigh the step in the level of these rows of the table, which was written from row to end.

    `pull` is a weight, and the point (n,) that it pulls to; each task adds its lm_damping
    |gain cost e|^2.
    Returns the sum, 0 for up to NO_DAMPING; if it is not zero, n rows then stand for the level:
    what its best x misses says nothing of that x.
    """
    weight, centre = pull
    n, total = A.shape[1], weight
    for i in range(first, last):
        total += table[i, n + 3] * (table[i, n + 2] * table[i, n + 1] * table[i, n]) ** 2
    if total <= NO_DAMPING:
        return 0.0
    for c in range(n):
        fill(A[end + c], 0.0)
        A[end + c, c] = np.sqrt(total)
        sides[0, end + c] = np.sqrt(total) * weight / total * centre[c]
    _merge_rows(A, sides, row, end + n)
    return total


@inlined
def _merge_rows(A, sides, first, last):
    """Replace the rows A x = side from first to last, of rank n, by n rows from `first` on.

    |A x - side|^2 of the new ones is less by what no x can change. They are triangular rows that a
    reflection mixes: those of the damping are far lighter than others, whose rounding would hide
    them.
    """
    m, n = last - first, A.shape[1]
    M, total = np.zeros((m, n + 1)), np.empty(n + 1)
    for i in range(m):
        assign(M[i, :n], A[first + i])
        M[i, n] = sides[0, first + i]
    for k in range(n):
        reflect_columns(M, k, m, k, k + 1, total)
    for c in range(n + 1):
        mean = 0.0
        for i in range(min(c + 1, n)):
            mean += M[i, c] / n
        for i in range(n):
            M[i, c] = (M[i, c] if i <= c else 0.0) - 2.0 * mean
    for i in range(n):
        assign(A[first + i], M[i, :n])
        sides[0, first + i] = sides[1, first + i] = M[i, n]
