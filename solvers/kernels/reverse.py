"""Reverse priority: from the lowest level up, each level corrects the answer of those below.

Level k corrects by T_k (J_k T_k)^# (b_k - J_k x_{k+1}), where T_k are the first m_k columns of the
pseudoinverse of the reverse augmented Jacobian, the rows of the levels k, k + 1, ..., l. With
J_RA = U S V^T and U_k the first m_k rows of U, T_k = V S^-1 U_k^T, so S V^T times the correction is
U_k^# (b_k - J_k x_{k+1}): of all steps that bring level k as close as possible to its target, the
one that changes the rows below least, || J_RA d ||, and of those the shortest. That is a strict
hierarchy of two levels: the rows of k with their residual, and all rows below with zero. So the
staircase finds it at any rank, and no pseudoinverse is formed.
"""

import numpy as np

from hierarchy.jit import add_multiple, compiled, inner_product
from solvers.kernels.linalg.rows import finish, finish_unless_missed, length_of
from solvers.kernels.linalg.space import assign, fill, integers, vector
from solvers.kernels.staircase import carve_staircase, climb
from solvers.kernels.tolerances import NEGLIGIBLE, UNCLEAR_PIVOT
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL


@compiled
def reverse(A, lower, upper, sizes, x, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    settings: damping, threshold, rank_tolerance, and whether the rows below are changed least level
    by level, upper ones first, rather than all alike, which does not make rows that are nearly
    parallel INACCURATE. Otherwise like `solve_by_staircase`.
    """
    (m, n), in_order, most, least = A.shape, settings[3] > 0.0, 0.0, np.inf
    asked, at = vector(work, 0, m)
    d, at = vector(work, at, n)
    reference, at = vector(work, at, n)
    parts, at = integers(work, at, sizes.size)
    _, end = carve_staircase(work, at, m, n)
    if end > work.size:
        return TOO_SMALL
    for i in range(m):
        if lower[i] != upper[i]:
            return finish(x, -(i + 1) if lower[i] < upper[i] else NUMERICAL_FAILURE)
        asked[i], most = 0.0, max(most, length_of(A[i]))
    if not np.isfinite(most):
        return finish(x, NUMERICAL_FAILURE)
    for c in range(n):
        reference[c], x[c] = x[c], 0.0
    first = m
    for k in range(sizes.size - 1, -1, -1):
        last, first = first, first - sizes[k]
        for c in range(n):
            d[c] = 0.0 if k > 0 else reference[c]  # in the null space of all levels
        for i in range(first, last):
            if length_of(A[i]) >= NEGLIGIBLE * most:
                asked[i] = lower[i] - inner_product(A[i], x)  # b_k - J_k x_{k+1}
        parts[k] = sizes[k]
        if not in_order and k + 1 < sizes.size:
            parts[k + 1] = m - last
        two = parts[k:sizes.size if in_order else k + 2]
        code, pivot = climb(A[first:], asked[first:], asked[first:], two, d, settings, work[at:])
        if code != SOLVED:
            return finish(x, code)
        least = min(least, pivot)
        add_multiple(x, 1.0, d)
        fill(asked[first:last], 0.0)
    if sizes.size == 0:
        assign(x, reference)
    code = finish_unless_missed(least == 0.0, A, lower, sizes, x, settings[0])
    unclear = in_order and least < UNCLEAR_PIVOT and settings[0] == 0.0
    return INACCURATE if code == SOLVED and unclear else code
