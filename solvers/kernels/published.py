"""The task priority matrix as published: plain QR (8), Gauss-Jordan with pivot blocks (9)-(10).

It is the recursion's answer only while no level above the last loses rank or freedom is left over:
a level occupies as many columns of Q as it has rows, whether it can use them or not. For m > n, J
is filled up with zero columns to a square matrix.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from solvers.kernels.block import invert_triangle, orthogonalise_rows, smallest_square
from solvers.kernels.flat import make_reflector, reflect_rows
from solvers.kernels.rows import ZERO, finish, load_rows
from solvers.kernels.staircase import staircase, staircase_work
from solvers.status import SOLVED, TOO_SMALL


@compiled
def published_work(m, n):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return m + n + 1 + max((2 * m + 1) * max(m, n) + 2 * m + 5 * m * m, staircase_work(m, n))


@compiled
def published(A, lower, upper, sizes, x, damping, threshold, rank_tolerance, work):
    """Solve (14) with F of (10); x (n,) comes in as the reference and goes out as the answer.

    x is zero on failure. work: at least published_work(m, n), of any content. Returns
    SOLVED, NUMERICAL_FAILURE, TOO_SMALL, or -(i + 1) where row i is an inequality.
    """
    m, n = A.shape
    if work.size < published_work(m, n):
        return TOO_SMALL
    N, of_rows = max(m, n), m + n + 1
    of_squares = of_rows + (2 * m + 1) * N
    u, least, whole = work[:m], work[m:m + n], work[m + n:of_rows].view(np.int64)
    W = work[of_rows:of_squares].reshape((2 * m + 1, N))  # rows of J, reflectors of Q, then x
    F = work[of_squares:of_squares + m * m].reshape((m, m))
    T = work[of_squares + m * m:of_squares + 2 * m * m].reshape((m, m))
    beta = work[of_squares + 2 * m * m:of_squares + 2 * m * m + m]
    code = priority_matrix(A, lower, upper, sizes, x, W, beta, F, T, damping, threshold,
                           rank_tolerance, work[of_squares + 2 * m * m + m:])
    if code != SOLVED:
        return finish(x, code)
    tolerance, square = _tolerance(A, rank_tolerance), 0.0
    for i in range(m):
        u[i] = 0.0
        for k in range(n):
            u[i] -= A[i, k] * x[k]
        for k in range(i, m):
            square += T[i, k] * T[i, k]
    for k in range(m):
        for i in range(m):
            u[i] += F[k, i] * lower[k]  # F p - J q0, of (14); F here is its transpose
    if square * tolerance * tolerance < 1.0:  # sigma_min(R) >= 1 / ||R^-1||_F > tolerance
        for c in range(N):
            W[2 * m, c] = 0.0
        for i in range(m):
            for k in range(i):
                u[i] -= W[i, k] * u[k]
            u[i] /= W[i, i]
            W[2 * m, i] = u[i]
        for k in range(m - 1, -1, -1):
            reflect_rows(W, beta, m, k, k + 1, 2 * m, 2 * m + 1)  # (11)
        for c in range(n):
            x[c] += W[2 * m, c]
        return finish(x, SOLVED)
    whole[0] = m
    for c in range(n):
        least[c] = 0.0
    code = staircase(A, u, u, whole, least, 0.0, threshold, rank_tolerance,
                     work[of_rows:])  # J^# at any rank
    for c in range(n):
        x[c] += least[c]
    return finish(x, code)


@compiled
def priority_matrix(A, lower, upper, sizes, x, W, beta, F, T, damping, threshold, rank_tolerance,
                    work):
    """Write R^T into W, its reflectors below and into beta, F^T into F and R^-1 into T; a code.

    Shapes, with N = max(m, n): W (>= 2 m, N), beta (m,), F (m, m), T (m, m). work: at least
    m + 3 m^2 numbers, of any content.
    """
    m, n = A.shape
    code = load_rows(W, beta, A, lower, upper, x, rank_tolerance)
    if code != SOLVED:
        return code
    for i in range(m):
        for c in range(n, W.shape[1]):
            W[i, c] = 0.0
    for k in range(m):  # (8)
        square = 0.0
        for c in range(k, W.shape[1]):
            W[m + k, c] = 0.0
            square += W[k, c] * W[k, c]
        zero, beta[k] = beta[k], 0.0
        if square <= zero:  # nothing is left of the row: rounding error must not choose for it
            for c in range(k, W.shape[1]):
                W[k, c] = 0.0
        else:
            make_reflector(W, beta, m, k, k, square)
            reflect_rows(W, beta, m, k, k + 1, k, m)
    invert_triangle(W, T, ZERO, ZERO, m)
    for i in range(m):
        for k in range(m):
            F[i, k] = W[k, i] if k >= i else 0.0  # (9)
    entries, of_block, tolerance = work[:m], work[m:], _tolerance(A, rank_tolerance)
    first = ZERO
    for level in range(sizes.size):
        last = first + sizes[level]
        D = of_block[:(last - first) * (last - first)].reshape((last - first, last - first))
        _invert_pivot(F, T, first, last, damping, threshold, tolerance, D,
                      of_block[D.size:])
        for k in range(first, m):  # step 2
            for j in range(last - first):
                entries[j] = F[first + j, k]
            for i in range(last - first):
                F[first + i, k] = 0.0
                for j in range(last - first):
                    F[first + i, k] += D[i, j] * entries[j]
        for i in range(first):  # step 3
            for j in range(last - first):
                entries[j] = F[i, first + j]
            for j in range(last - first):
                for k in range(first, m):
                    F[i, k] -= entries[j] * F[first + j, k]
        first = last
    return SOLVED


@compiled
def _tolerance(A, rank_tolerance):
    """Absolute tolerance of singular values: rank_tolerance times the largest row norm."""
    largest = 0.0
    for i in range(A.shape[0]):
        square = 0.0
        for c in range(A.shape[1]):
            square += A[i, c] * A[i, c]
        largest = max(largest, square)
    return rank_tolerance * np.sqrt(largest)


@compiled
def _invert_pivot(F, T, first, last, damping, threshold, tolerance, D, work):
    """Write R_ii^# into D, damped where its smallest singular value is small.

    That is R^T (R R^T + lambda^2 I)^-1. work: twice the size of D, of any content.
    """
    p, square = last - first, 0.0
    for i in range(p):
        for j in range(p):
            D[i, j] = T[first + i, first + j]
            square += D[i, j] * D[i, j]
    enough = max(tolerance, threshold) if damping > 0.0 else tolerance
    if square * enough * enough < 1.0:
        return
    S, U = work[:p * p].reshape((p, p)), work[p * p:2 * p * p].reshape((p, p))
    for i in range(p):
        for j in range(p):
            U[i, j] = 1.0 if i == j else 0.0
            D[i, j] = 0.0
            S[i, j] = F[first + i, first + j]
    orthogonalise_rows(S, U)  # R_ii = U^T S, rows of S orthogonal
    ratio = smallest_square(S) / (threshold * threshold)
    damped = damping * damping * max(0.0, 1.0 - ratio)  # lambda^2
    for k in range(p):
        square = 0.0
        for j in range(p):
            square += S[k, j] * S[k, j]
        if damped > 0.0 or square > tolerance * tolerance:
            for i in range(p):
                for j in range(p):
                    D[i, j] += S[k, i] * U[k, j] / (square + damped)
