"""A stack of equality levels factored as J = C Q^T, and the staircase of C, kept between edits.

Q (n, r) has orthonormal columns, C (m, r) the coefficients of the rows. Lengths and angles of rows
of J are those of rows of C, so the staircase of C is that of J, in r numbers a row in place of n:
new priorities need C alone, which is what "only F is recomputed" (below (11)) promises.

Rows of C and of the squares lie where a level was put first, its slot; a table says for each level,
in order of priority, [slot, rows, rank with all above]. W has, for m <= V rows:

    rows 0 .. V - 1       the staircase, in order, each level in pivot order
    the width after V     reflectors, see `reflect_rows`
    four more             beta, y, x and the reference, in coordinates of Q
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_block
from solvers.kernels.flat import factor_level, reflect_rows
from solvers.kernels.rows import ZERO, finish
from solvers.status import NUMERICAL_FAILURE, SOLVED

ROUNDED = 1e-14  # share of a row outside the basis that is its rounding, and no direction
PASSES = 4       # bound; two are enough where the row is not rounding
EXTRA_ROWS = 4   # of W, beside staircase and reflectors


@inlined
def dot(u, v):
    """Inner product in four sums, which do not wait for each other."""
    a = b = c = d = 0.0
    fours = u.size - u.size % 4
    for i in range(0, fours, 4):
        a += u[i] * v[i]
        b += u[i + 1] * v[i + 1]
        c += u[i + 2] * v[i + 2]
        d += u[i + 3] * v[i + 3]
    for i in range(fours, u.size):
        a += u[i] * v[i]
    return (a + b) + (c + d)


@compiled
def project_rows(A, first, last, r, Q, C, squares):
    """Write rows first .. last - 1 of A as C Q^T, adding to the basis what is outside; return r.

    Q (r + the rows at least, and one more; n) has the basis as its first r rows. A row whose square
    is not finite gets no coefficients. squares receives the squared norms.
    """
    n = A.shape[1]
    for i in range(first, last):
        w, coefficients = Q[r], C[i]
        for c in range(n):
            w[c] = A[i, c]
        for k in range(coefficients.size):
            coefficients[k] = 0.0
        squares[i] = dot(w, w)
        if not np.isfinite(squares[i]):
            continue
        left = size = np.sqrt(squares[i])
        for _ in range(PASSES):  # Gram-Schmidt, again where a row loses more than half of itself
            before = left
            for k in range(r):
                q = Q[k]
                s = dot(q, w)
                coefficients[k] += s
                for c in range(n):
                    w[c] -= s * q[c]
            left = np.sqrt(dot(w, w))
            if left > 0.5 * before or left <= ROUNDED * size:
                break
        if left > ROUNDED * size and r < n:
            coefficients[r] = left
            for c in range(n):
                w[c] /= left
            r += 1
    return r


@compiled
def refactor(C, squares, table, kept, W, V, pivots, rank_tolerance, work):
    """Bring the levels from `kept` on into the staircase, behind the kept ones; return a code.

    Writes ranks into the table, and into pivots (V,) which row of the stack each row of W is.
    work: at least 2 V numbers.
    """
    width = W.shape[1]
    beta, zero, unused = W[V + width], work[:V], work[V:2 * V]
    rank, first = ZERO, ZERO
    if kept > 0:
        rank = table[kept - 1, 2]
    for level in range(kept):
        first += table[level, 1]
    for level in range(kept, table.shape[0]):
        slot, last, above = table[level, 0], first + table[level, 1], rank
        for i in range(first, last):
            square = squares[slot + i - first]
            if not np.isfinite(square):
                return NUMERICAL_FAILURE
            zero[i], pivots[i] = rank_tolerance * rank_tolerance * square, i
            for c in range(width):
                W[i, c] = C[slot + i - first, c]
        reflect_rows(W, beta, V, ZERO, above, first, last)
        rank = factor_level(W, pivots, zero, unused, beta, V, first, last, rank)
        table[level, 2] = rank
        first = last
    return SOLVED


@inlined
def substitute(b, table, W, V, pivots, y, damping, threshold, work):
    """Write y (rank,) for targets b (m,) by block forward substitution, see `staircase`."""
    miss, of_block = work[:V], work[V:]
    first = above = ZERO
    for level in range(table.shape[0]):
        last, rank = first + table[level, 1], table[level, 2]
        for i in range(first, last):
            miss[i] = b[pivots[i]]
            for c in range(above):
                miss[i] -= W[i, c] * y[c]  # p_i - J_i x_{i-1}, in (13)
        solve_block(W, miss, y, first, last, above, rank, damping, threshold, of_block)
        first, above = last, rank
    return above


@compiled
def resolve(b, x, r, Q, table, W, V, pivots, damping, threshold, work):
    """Solve for targets b (m,); x (n,) comes in as the reference and goes out as the answer.

    Returns SOLVED, NUMERICAL_FAILURE with x = 0, or -(i + 1) where target i is not finite, and
    -(m + 1 + c) where entry c of the reference is not. work: as `factorization_work` says.
    """
    n, width = x.size, W.shape[1]
    beta, y, u, u0 = W[V + width], W[V + width + 1], W[V + width + 2], W[V + width + 3]
    for i in range(b.size):
        if not np.isfinite(b[i]):
            return -(i + 1)
    zero_reference = True
    for c in range(n):
        if not np.isfinite(x[c]):
            return -(b.size + 1 + c)
        zero_reference &= x[c] == 0.0
    rank = substitute(b, table, W, V, pivots, y, damping, threshold, work)
    for k in range(width):
        u[k] = u0[k] = 0.0
    if not zero_reference:
        for k in range(r):
            u[k] = u0[k] = dot(Q[k], x)
        reflect_rows(W, beta, V, ZERO, rank, V + width + 2, V + width + 3)  # of q0, see (14)
        if r == n:  # nothing of the reference is outside the basis but rounding
            for c in range(n):
                x[c] = 0.0
            for k in range(width):
                u0[k] = 0.0
    lift(W, V, y, rank, V + width + 2)
    for k in range(r):
        s, q = u[k] - u0[k], Q[k]
        for c in range(n):
            x[c] += s * q[c]
    return finish(x, SOLVED)


@inlined
def lift(W, V, y, rank, row):
    """Turn row `row` of W, with y in its first columns, into coordinates of Q."""
    width = W.shape[1]
    for c in range(rank):
        W[row, c] = y[c]
    for k in range(rank - 1, -1, -1):
        reflect_rows(W, W[V + width], V, k, k + 1, row, row + 1)


@compiled
def resolve_units(Z, table, W, V, pivots, damping, threshold, work):
    """Write into row i of Z (m, width) the answer to target i alone being 1, in coordinates of Q.

    With it G = Q Z^T and F = J G = C Z^T. work: as `factorization_work` says.
    """
    m, width = Z.shape
    y, unit = W[V + width + 1], work[:m]
    for i in range(m):
        for k in range(m):
            unit[k] = 1.0 if k == i else 0.0
        rank = substitute(unit, table, W, V, pivots, y, damping, threshold, work[m:])
        for k in range(width):
            W[V + width + 2, k] = 0.0
        lift(W, V, y, rank, V + width + 2)
        for k in range(width):
            Z[i, k] = W[V + width + 2, k]


def factorization_work(rows: int, width: int) -> int:
    """Return how many numbers of work space the kernels here need."""
    return 2 * rows + (rows + width) * (width + 1)
