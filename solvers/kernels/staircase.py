"""The exact task priority solution at every rank, from a level-by-level QR of J^T.

J^T = Q [R; O] (8), but with R an upper block staircase: a level takes as many columns of Q as it
adds rank, so what an upper level cannot use stays free for the levels below. In y = Q^T x the
levels are solved from the top by block forward substitution, least squares in each block: the
recursion (5), (13) in other coordinates. The columns of Q that no level took carry (14).
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from solvers.kernels.block import solve_block
from solvers.kernels.flat import factor_level, reflect_rows
from solvers.kernels.rows import ZERO, finish, load_rows
from solvers.status import SOLVED, TOO_SMALL


@compiled
def staircase_work(m, n):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return (2 * m + 2 * n + 4) * n + 4 * m


@compiled
def staircase(A, lower, upper, sizes, x, damping, threshold, rank_tolerance, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    work: at least staircase_work(m, n), of any content. Returns SOLVED, NUMERICAL_FAILURE,
    TOO_SMALL, or -(i + 1) where row i is an inequality.
    """
    m, n = A.shape
    if work.size < staircase_work(m, n):
        return TOO_SMALL
    V, X, of_rows = m, m + n, (m + n + 3) * n
    W = work[:of_rows].reshape((m + n + 3, n))  # rows of J, then of Q's reflectors, then x
    beta, y = W[X + 1], W[X + 2]
    zero, miss = work[of_rows:of_rows + m], work[of_rows + m:of_rows + 2 * m]
    row = work[of_rows + 2 * m:of_rows + 3 * m].view(np.int64)  # the pivot order, not asked for
    of_block = work[of_rows + 3 * m:]
    code = load_rows(W, zero, A, lower, upper, x, rank_tolerance)
    if code != SOLVED:
        return finish(x, code)
    for i in range(m):
        miss[i] = lower[i]

    rank = first = ZERO
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        reflect_rows(W, beta, V, ZERO, above, first, last)  # J_i Q: the level as seen from above
        rank = factor_level(W, row, zero, miss, beta, V, first, last, rank)
        for i in range(first, last):
            for c in range(above):
                miss[i] -= W[i, c] * y[c]  # p_i - J_i x_{i-1}, in (13)
        solve_block(W, miss, y, first, last, above, rank, damping, threshold, of_block)
        first = last

    zero_reference = True
    for c in range(n):
        W[X, c] = x[c]
        zero_reference &= x[c] == 0.0
    if not zero_reference:
        reflect_rows(W, beta, V, ZERO, rank, X, X + 1)  # Q^T q0, of which (14) keeps the rest
    for c in range(rank):
        W[X, c] = y[c]
    for k in range(rank - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, X, X + 1)  # x = Q [y; rest]: (7) and (14) at once
    for c in range(n):
        x[c] = W[X, c]
    return finish(x, SOLVED)
