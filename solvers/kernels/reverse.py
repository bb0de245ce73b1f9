"""Reverse priority: levels from the lowest up, each correcting the answer of those below it.

Level k corrects by T_k (J_k T_k)^# (b_k - J_k x_{k+1}), where T_k are the first m_k columns of the
pseudoinverse of the reverse augmented Jacobian, the rows of the levels k, k + 1, ..., l. With
J_RA = U S V^T and U_k the first m_k rows of U, T_k = V S^-1 U_k^T, so S V^T times the correction is
U_k^# (b_k - J_k x_{k+1}): of all steps that bring level k as near as it can come, the one that
changes the rows below least, || J_RA d ||, and of those the shortest. That is a strict hierarchy of
two levels, the rows of k with what they miss, and all rows below with zero; so the staircase
finds it at any rank, and no pseudoinverse is formed.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from solvers.kernels.rows import finish
from solvers.kernels.staircase import staircase, staircase_work
from solvers.status import NUMERICAL_FAILURE, SOLVED, TOO_SMALL


@compiled
def reverse_work(m, n, levels):
    """Return how many numbers of work space a hierarchy needs."""
    return staircase_work(m, n) + m + 2 * n + levels


@compiled
def reverse(A, lower, upper, sizes, x, in_order, damping, threshold, rank_tolerance, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    in_order: the rows below are changed least level by level, the upper ones first, in place of
    all alike. work: at least reverse_work(m, n, levels), of any content. Returns SOLVED,
    NUMERICAL_FAILURE, TOO_SMALL, or -(i + 1) where row i is an inequality.
    """
    m, n = A.shape
    levels = sizes.size
    if work.size < reverse_work(m, n, levels):
        return TOO_SMALL
    asked, d, reference = work[:m], work[m:m + n], work[m + n:m + 2 * n]
    at = m + 2 * n
    parts = work[at:at + levels].view(np.int64)
    of_staircase = work[at + levels:]
    for i in range(m):
        if lower[i] != upper[i]:
            return finish(x, -(i + 1) if lower[i] < upper[i] else NUMERICAL_FAILURE)
        asked[i] = 0.0
    for c in range(n):
        reference[c] = x[c]
        x[c] = 0.0
    for k in range(levels):
        parts[k] = sizes[k]

    first = m
    for k in range(levels - 1, -1, -1):
        last, first = first, first - sizes[k]
        for i in range(first, last):
            asked[i] = lower[i]
            for c in range(n):
                asked[i] -= A[i, c] * x[c]  # b_k - J_k x_{k+1}
        two = parts[k:] if in_order else parts[k:k + 2]
        if not in_order and k + 1 < levels:
            two[1] = m - last
        for c in range(n):
            d[c] = 0.0 if k > 0 else reference[c]  # nothing sees what J_RA of all levels leaves
        code = staircase(A[first:], asked[first:], asked[first:], two, d, damping, threshold,
                         rank_tolerance, of_staircase)
        if code != SOLVED:
            return finish(x, code)
        for c in range(n):
            x[c] += d[c]
        for i in range(first, last):
            asked[i] = 0.0
    if levels == 0:
        for c in range(n):
            x[c] = reference[c]
    return finish(x, SOLVED)
