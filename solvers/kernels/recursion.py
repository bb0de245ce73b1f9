"""The recursion with null-space projections, (5), (6) and (13), at every rank.

(J_i P_{i-1})^# comes from an orthogonal decomposition J_i P_{i-1} = C V that reveals its rank: rows
of V orthonormal, C lower trapezoidal, pivoted by the largest remainder. Then P_i = P_{i-1} - V^T V.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

from hierarchy.jit import add_multiple, compiled, inlined, inner_product
from solvers.kernels.block import solve_level
from solvers.kernels.damped import LEVEL, Inverse, invert
from solvers.kernels.rows import ZERO, finish, largest_row, length_of, load_rows, swap, swap_rows
from solvers.kernels.space import Block, View, matrix, shared, vector
from solvers.status import SOLVED, TOO_SMALL

SHRUNK = 0.01  # squared norm of a remainder: smaller ones are projected a second time


class Projected(NamedTuple):
    """Rows J_i P_{i-1} = C V, their residuals, and the projector.

    W (m, n): the remainders of the rows. C (m, n), V (n, n), P (n, n). zero, miss (m,): see `Rows`.
    """

    W: View
    C: View
    V: View
    P: View
    zero: View
    miss: View


@inlined
def _carve(work, at, m, n):
    """Return Projected for m rows of n unknowns, and where it ends."""
    W, at = matrix(work, at, m, n)
    C, at = matrix(work, at, m, n)
    V, at = matrix(work, at, n, n)
    P, at = matrix(work, at, n, n)
    zero, at = vector(work, at, m)
    miss, at = vector(work, at, m)
    return Projected(W, C, V, P, zero, miss), at


@compiled
def recursion(A, lower, upper, sizes, x, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    settings: those of `Recursive`. Other arguments and the codes are those of `solve_by_staircase`.
    """
    m, n = A.shape
    rows, at = _carve(work, ZERO, m, n)
    y, at = vector(work, at, n)
    q, at = vector(work, at, n)
    of_block, at = vector(work, at, 2 * (m + n) * (n + 1))
    if at > work.size:
        return ZERO + TOO_SMALL
    inverse = Inverse(settings[3], settings[0], settings[1], settings[4], settings[5])
    settings = shared(settings)
    code = load_rows(rows.W, rows.zero, A, lower, upper, x, settings.rank_tolerance)
    if code != SOLVED:
        return finish(x, code)
    _begin(rows, q)

    rank = first = ZERO
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        _see(rows, A, lower, q, first, last, above)
        rank = _decompose(rows, A, first, last, rank, settings.rank_tolerance)
        block = Block(first, last, above, rank)
        if inverse.method == LEVEL:
            solve_level(rows.C, rows.miss, y, block, settings, of_block)
        else:
            invert(rows, y, block, inverse, of_block)
        for k in range(above, rank):
            add_multiple(q, y[k], rows.V[k])  # (5)
        first = last
    for i in range(n):
        add_multiple(q, x[i], rows.P[i])  # (14): I - J^# J = P_l
    for c in range(n):
        x[c] = q[c]
    return finish(x, SOLVED)


@inlined
def _begin(rows, q):
    """Set C and q to zero, and P_0 to I."""
    n = q.size
    for i in range(rows.C.shape[0]):
        for c in range(n):
            rows.C[i, c] = 0.0
    for i in range(n):
        q[i] = 0.0
        for c in range(n):
            rows.P[i, c] = 1.0 if i == c else 0.0


@inlined
def _see(rows, A, b, q, first, last, above):
    """Write the residual of a level, p_i - J_i x_{i-1} in (13), and its rows J_i P_{i-1}."""
    for i in range(first, last):
        rows.miss[i] = b[i] - inner_product(A[i], q)
        if above > 0:
            _project(rows.W[i], A[i], rows.P)


@inlined
def _decompose(rows, A, first, last, rank, rank_tolerance):
    """Decompose the rows of a level into unit vectors, largest first; return the rank."""
    for i in range(first, last):
        pivot, square = largest_row(rows.W, rows.zero, i, last, ZERO)
        if pivot < 0 or rank == A.shape[1]:
            break
        if pivot != i:
            swap_rows(rows.W, i, pivot)
            swap_rows(rows.C, i, pivot)
            swap(rows.zero, i, pivot)
            swap(rows.miss, i, pivot)
        again = not rank_tolerance * rank_tolerance * square > SHRUNK * rows.zero[i]
        _take_direction(rows, i, last, rank, again)
        rank += 1
    return rank


@compiled
def _project(w, a, P):
    """Set w to a P."""
    for c in range(w.size):
        w[c] = 0.0
    for k in range(w.size):
        add_multiple(w, a[k], P[k])


@compiled
def _take_direction(rows, i, last, k, again):
    """Normalise row i of W to V[k], and remove it from the level's rows and from P.

    again: project it a second time, so that V[k] stays in the range of P if its remainder is small.
    """
    v = rows.V[k]
    if again:
        _project(v, rows.W[i], rows.P)
    else:
        for c in range(v.size):
            v[c] = rows.W[i, c]
    norm = length_of(v)
    for c in range(v.size):
        v[c] /= norm
    for j in range(i, last):
        rows.C[j, k] = inner_product(v, rows.W[j])
        add_multiple(rows.W[j], -rows.C[j, k], v)
    for j in range(v.size):
        add_multiple(rows.P[j], -v[j], v)  # (6)
