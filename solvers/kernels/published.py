"""The task priority matrix as published: plain QR (8), Gauss-Jordan with pivot blocks (9)-(10).

A level occupies as many columns of Q as it has rows, whether it can use them or not. So where one
above the last loses rank it gives the answer of the recursion only if no lower level needs the
columns that are wasted. For m > n, zero columns extend J to a square matrix.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import add_multiple, as_matrix, compiled, inlined, inner_product, internal
from solvers.kernels.linalg.block import (
    invert_triangle,
    orthogonalise_rows,
    smallest_square,
    solve_damped_level,
)
from solvers.kernels.linalg.rows import finish, load_rows, make_reflector, reflect, reflect_back
from solvers.kernels.linalg.space import Block, assign, fill, integers, matrix, shared, vector
from solvers.kernels.staircase import carve_staircase, climb
from solvers.status import SOLVED, TOO_SMALL

Matrices = namedtuple("Matrices", "R basis F T zero rest u of_x")
"""The matrices from which F is computed, and F; N = max(m, n).

R (m, N): R^T, the rows of J reflected. basis: the m reflectors of Q. F (m, m): F^T. T (m, m):
R^-1. zero (m,): squared norm at or below which a row is zero. rest: m + 3 m^2 numbers. u (m,),
of_x (1, N): intermediate results.
"""


@inlined
def _carve(work, m, n):
    """Return Matrices for m rows of n unknowns, and where they end."""
    N = max(m, n)
    R, at = matrix(work, 0, m, N)
    basis, at = matrix(work, at, m, N)
    F, at = matrix(work, at, m, m)
    T, at = matrix(work, at, m, m)
    zero, at = vector(work, at, m)
    rest, at = vector(work, at, m + 3 * m * m)
    u, at = vector(work, at, m)
    of_x, at = matrix(work, at, 1, N)
    return Matrices(R, basis, F, T, zero, rest, u, of_x), at


@compiled
def solve_as_published(A, lower, upper, sizes, x, settings, work):
    """Solve (14) with F of (10); arguments and return codes as in `solve_by_staircase`."""
    m, n = A.shape
    matrices, at = _carve(work, m, n)
    _, end = carve_staircase(work, at + 4, m, n)  # 4: a level and its settings
    if end > work.size:
        return TOO_SMALL
    settings, u = shared(settings), matrices.u
    code, tolerance = _fill(A, lower, upper, sizes, x, matrices, settings)
    if code != SOLVED:
        return finish(x, code)
    square = 0.0
    for i in range(m):
        u[i] = -inner_product(A[i], x)
        for k in range(i, m):
            square += matrices.T[i, k] * matrices.T[i, k]
    for k in range(m):
        for i in range(m):
            u[i] += matrices.F[k, i] * lower[k]  # F p - J q0, of (14); F here is its transpose
    fill(matrices.of_x[0], 0.0)
    if square * tolerance * tolerance < 1.0:  # sigma_min(R) >= 1 / ||R^-1||_F > tolerance
        of_x = matrices.of_x  # J^# u = Q [R^-T u; 0] (11)
        solve_damped_level(matrices.R, u, of_x[0], Block(0, m, 0, m), 0.0, matrices.rest)
        reflect_back(matrices.basis, 0, m, of_x, 0, 1)
    else:
        whole, at = integers(work, at, 1)  # all rows as one level
        undamped, at = vector(work, at, 3)
        undamped[0], undamped[1], undamped[2] = 0.0, settings.threshold, settings.rank_tolerance
        whole[0] = m
        code, _ = climb(A, u, u, whole, matrices.of_x[0, :n], undamped, work[at:])
    add_multiple(x, 1.0, matrices.of_x[0, :n])
    return finish(x, code)


@internal
def _fill(A, lower, upper, sizes, x, matrices, settings):
    """Write R, its reflectors, F and T; return a code, and the tolerance of singular values.

    That is `rank_tolerance` times the largest norm of a row.
    """
    m, n = A.shape
    R, basis, F, T, zero, rest = matrices[:6]
    code = load_rows(R, zero, A, lower, upper, x, settings.rank_tolerance)
    if code != SOLVED:
        return code, 0.0
    for i in range(m):
        fill(R[i, n:], 0.0)
    for k in range(m):  # the QR of J^T: R is J before and R^T after it (8)
        square = 0.0
        fill(basis[k], 0.0)
        for c in range(k, R.shape[1]):
            square += R[k, c] * R[k, c]
        if square <= zero[k]:  # no remainder: rounding must not choose a direction
            fill(R[k, k:], 0.0)
        else:
            make_reflector(basis, k, R[k], square)
            reflect(basis, k, k + 1, R, k, m)
    invert_triangle(R, T, 0, 0, m)
    for i in range(m):
        for k in range(m):
            F[i, k] = R[k, i] if k >= i else 0.0  # (9)
    entries, of_pivot, largest, first = rest[:m], rest[m:], 0.0, 0
    for i in range(m):
        largest = max(largest, inner_product(A[i], A[i]))
    tolerance = settings.rank_tolerance * np.sqrt(largest)
    for level in range(sizes.size):
        last = first + sizes[level]
        p = last - first
        D = as_matrix(of_pivot[:p * p], p, p)
        _invert_pivot(F, T, first, settings, tolerance, D, of_pivot[D.size:])
        _eliminate(F, D, entries, first, last)
        first = last
    return SOLVED, tolerance


@inlined
def _eliminate(F, D, entries, first, last):
    """Do steps 2 and 3 of the elimination for one level; D is the inverse of its pivot."""
    p = last - first
    for k in range(first, F.shape[1]):  # step 2
        for j in range(p):
            entries[j] = F[first + j, k]
        for i in range(p):
            F[first + i, k] = 0.0
            for j in range(p):
                F[first + i, k] += D[i, j] * entries[j]
    for i in range(first):  # step 3
        assign(entries[:p], F[i, first:])
        for j in range(p):
            for k in range(first, F.shape[1]):
                F[i, k] -= entries[j] * F[first + j, k]


@internal
def _invert_pivot(F, T, first, settings, tolerance, D, work):
    """Write R_ii^# into D, damped if its smallest singular value is small.

    That is R^T (R R^T + lambda^2 I)^-1. work: twice the size of D, any contents.
    """
    damping, threshold = settings.damping, settings.threshold
    p, square = D.shape[0], 0.0
    for i in range(p):
        for j in range(p):
            D[i, j] = T[first + i, first + j]
            square += D[i, j] * D[i, j]
    enough = max(tolerance, threshold) if damping > 0.0 else tolerance
    if square * enough * enough < 1.0:
        return
    S, U = as_matrix(work[:p * p], p, p), as_matrix(work[p * p:2 * p * p], p, p)
    for i in range(p):
        for j in range(p):
            U[i, j] = 1.0 if i == j else 0.0
            D[i, j] = 0.0
            S[i, j] = F[first + i, first + j]
    orthogonalise_rows(S, U)  # R_ii = U^T S, rows of S orthogonal
    ratio = smallest_square(S) / (threshold * threshold)
    damped = damping * damping * max(0.0, 1.0 - ratio)  # lambda^2
    for k in range(p):
        square = inner_product(S[k], S[k])
        if damped > 0.0 or square > tolerance * tolerance:
            for i in range(p):
                for j in range(p):
                    D[i, j] += S[k, i] * U[k, j] / (square + damped)


@compiled
def matrix_as_published(A, lower, upper, sizes, F, settings, work):
    """Write F^T of (10) into F (m, m); return SOLVED, NUMERICAL_FAILURE or TOO_SMALL."""
    m, n = A.shape
    matrices, at = _carve(work, m, n)
    if at > work.size:
        return TOO_SMALL
    code, _ = _fill(A, lower, upper, sizes, work[:0], matrices, shared(settings))
    for i in range(m):
        assign(F[i], matrices.F[i])
    return code
