"""The recursion with null-space projections, (5), (6) and (13), at every rank.

(J_i P_{i-1})^# comes from an orthogonal decomposition J_i P_{i-1} = C V that reveals its rank: rows
of V orthonormal, C lower trapezoidal, pivoted by the largest remainder. Then P_i = P_{i-1} - V^T V.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from solvers.kernels.block import solve_block
from solvers.kernels.rows import ZERO, finish, largest_row, load_rows, swap_rows
from solvers.status import SOLVED, TOO_SMALL

SHRUNK = 0.01  # squared norm that a row may lose by projection before it is projected once more


@compiled
def recursion_work(m, n):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return 3 * (m + n) * (n + 1)


@compiled
def recursion(A, lower, upper, sizes, x, damping, threshold, rank_tolerance, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    work: at least recursion_work(m, n), of any content. Returns SOLVED, NUMERICAL_FAILURE,
    TOO_SMALL, or -(i + 1) where row i is an inequality.
    """
    m, n = A.shape
    if work.size < recursion_work(m, n):
        return TOO_SMALL
    of_rows = 2 * (m + n) * n
    of_columns = of_rows + 2 * m
    in_rows = work[:of_rows].reshape((2 * (m + n), n))
    W, C, P, V = in_rows[:m], in_rows[m:2 * m], in_rows[2 * m:2 * m + n], in_rows[2 * m + n:]
    zero, miss = work[of_rows:of_rows + m], work[of_rows + m:of_columns]
    y, q = work[of_columns:of_columns + n], work[of_columns + n:of_columns + 2 * n]
    of_block = work[of_columns + 2 * n:]
    code = load_rows(W, zero, A, lower, upper, x, rank_tolerance)
    if code != SOLVED:
        return finish(x, code)
    for i in range(m):
        for c in range(n):
            C[i, c] = 0.0
    for i in range(n):
        q[i] = 0.0
        for c in range(n):
            P[i, c] = 1.0 if i == c else 0.0  # P_0 = I

    rank = first = ZERO
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        for i in range(first, last):
            miss[i] = lower[i]
            for c in range(n):
                miss[i] -= A[i, c] * q[c]  # p_i - J_i x_{i-1}, in (13)
            if above > 0:
                project(W, i, A, i, P)  # J_i P_{i-1}
        for i in range(first, last):
            pivot, square = largest_row(W, zero, i, last, ZERO)
            if pivot < 0 or rank == n:
                break
            if pivot != i:
                swap_rows(W, i, pivot)
                swap_rows(C, i, pivot)
                zero[i], zero[pivot] = zero[pivot], zero[i]
                miss[i], miss[pivot] = miss[pivot], miss[i]
            again = not rank_tolerance * rank_tolerance * square > SHRUNK * zero[i]
            _take_direction(W, C, P, V, i, last, rank, again)
            rank += 1
        solve_block(C, miss, y, first, last, above, rank, damping, threshold, of_block)
        for k in range(above, rank):
            for c in range(n):
                q[c] += V[k, c] * y[k]  # (5)
        first = last

    for i in range(n):
        for c in range(n):
            q[c] += P[i, c] * x[i]  # (14): I - J^# J = P_l
    for c in range(n):
        x[c] = q[c]
    return finish(x, SOLVED)


@compiled
def project(W, i, A, j, P):
    """Set row i of W to row j of A times P."""
    w = W[i]
    for c in range(w.size):
        w[c] = 0.0
    for k in range(w.size):
        factor, p = A[j, k], P[k]
        for c in range(w.size):
            w[c] += factor * p[c]


@compiled
def _take_direction(W, C, P, V, i, last, k, again):
    """Make row i of W unit vector V[k], and take it out of the level's rows and out of P.

    again: project it once more, so that V[k] stays in the range of P when little was left of it.
    """
    if again:
        project(V, k, W, i, P)
    v = V[k]
    square = 0.0
    for c in range(v.size):
        v[c] = v[c] if again else W[i, c]
        square += v[c] * v[c]
    norm = np.sqrt(square)
    for c in range(v.size):
        v[c] /= norm
    for j in range(i, last):
        w = W[j]
        s = 0.0
        for c in range(v.size):
            s += w[c] * v[c]
        C[j, k] = s
        for c in range(v.size):
            w[c] -= s * v[c]
    for j in range(v.size):
        s, p = v[j], P[j]
        for c in range(v.size):
            p[c] -= s * v[c]  # (6)
