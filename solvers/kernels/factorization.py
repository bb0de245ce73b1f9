"""A stack of equality levels factored as J = C Q^T, and the staircase of C, across edits.

Q (n, r) has orthonormal columns, C (m, r) the coefficients of the rows. Lengths and angles of rows
of J are those of rows of C, so the staircase of C is that of J, with r numbers per row, not n: new
priorities need C alone, as "only F is recomputed" (below (11)) promises.

Rows of C and of the squares stay in the slot where a level was first put; a table has for each
level, in order of priority, [slot, rows, rank with all above]. W has, for m <= V rows:

    rows 0 .. V - 1       the staircase, in order, each level in pivot order
    the next `width`      reflectors
    three more            y, x and the reference, in coordinates of Q
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import add_multiple, compiled, inlined, inner_product
from solvers.kernels.block import solve_level
from solvers.kernels.rows import (
    ZERO,
    factor_level,
    finish,
    has_outlier,
    length_of,
    reflect,
    reflect_back,
)
from solvers.kernels.space import Block, Rows, View, shared
from solvers.kernels.staircase import is_doubtful, smallest_pivot, subtract
from solvers.kernels.tolerances import FAR_LIGHTER, OUTSIDE, UNCLEAR_PIVOT
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED

PASSES = 4       # most passes; two are enough unless the row is rounding
EXTRA_ROWS = 3   # of W, in addition to staircase and reflectors


@compiled
def project_rows(A, first, last, r, Q, C, squares):
    """Write rows first .. last - 1 of A as C Q^T, extending the basis where necessary; return r.

    Q (at least r + the rows + 1, n) has the basis in its first r rows. A row whose square is not
    finite gets no coefficients. squares receives the squared norms.
    """
    n = A.shape[1]
    for i in range(first, last):
        w, coefficients = Q[r], C[i]
        for c in range(n):
            w[c] = A[i, c]
        for k in range(coefficients.size):
            coefficients[k] = 0.0
        squares[i] = inner_product(w, w)
        if not np.isfinite(squares[i]):
            continue
        size = np.sqrt(squares[i])
        left = _orthogonalise(w, Q, r, coefficients, size)
        if left > OUTSIDE * size and r < n:
            coefficients[r] = left
            for c in range(n):
                w[c] /= left
            r += 1
    return r


@inlined
def _orthogonalise(w, Q, r, coefficients, size):
    """Project the first r rows of Q out of w, of norm `size`; return the norm of the remainder.

    By Gram-Schmidt, repeated if the row loses more than half of itself.
    """
    left = size
    for _ in range(PASSES):
        before = left
        for k in range(r):
            q = Q[k]
            s = inner_product(q, w)
            coefficients[k] += s
            add_multiple(w, -s, q)
        left = length_of(w)
        if left > 0.5 * before or left <= OUTSIDE * size:
            break
    return left


class Factored(NamedTuple):
    """The staircase of C.

    rows, basis: as in `Staircase`. y (width,): the answer in the columns of the levels. of_x
    (2, width): x and the reference in coordinates of Q. rest: what follows in the work space.
    """

    rows: Rows
    basis: View
    y: View
    of_x: View
    rest: View


@inlined
def _opened(W, pivots, work):
    """Return the parts of W, with zero and miss from the work space."""
    V, width = pivots.size, W.shape[1]
    rows = Rows(W[:V], pivots, work[:V], work[V:2 * V])
    y, of_x = W[V + width], W[V + width + 1:V + width + 3]
    return Factored(rows, W[V:V + width], y, of_x, work[2 * V:])


@compiled
def refactor(C, squares, table, kept, W, pivots, rank_tolerance, work):
    """Add the levels from `kept` on to the staircase, after the kept ones; return a code.

    INACCURATE: `solve_by_staircase` would say so without damping. Writes ranks into the
    table, and into pivots (V,) the row of the stack of each row of W.
    work: see `factorization_work`.
    """
    rows, basis, _, _, _ = _opened(W, pivots, work)
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
            rows.zero[i], rows.row[i] = rank_tolerance * rank_tolerance * square, i
            for c in range(W.shape[1]):
                rows.W[i, c] = C[slot + i - first, c]
        reflect(basis, ZERO, above, rows.W, first, last)
        rank = factor_level(rows, basis, first, last, rank)
        table[level, 2] = rank
        first = last
    return SOLVED if _is_clear(rows, squares, table, rank_tolerance) else INACCURATE


@inlined
def _is_clear(rows, squares, table, rank_tolerance):
    """Whether no row of the staircase is nearly parallel to others or far lighter."""
    first, above, least, clear = ZERO, ZERO, np.inf, True
    for level in range(table.shape[0]):
        slot, last, rank = table[level, 0], first + table[level, 1], table[level, 2]
        for i in range(first, last):
            rows.zero[i] = rank_tolerance * rank_tolerance * squares[slot + rows.row[i] - first]
        block = Block(first, last, above, rank)
        least = smallest_pivot(rows, block, least)
        clear &= rank - above == last - first or not is_doubtful(rows, block, least, rank_tolerance)
        first, above = last, rank
    return (clear and not has_outlier(rows.zero[:first], FAR_LIGHTER * FAR_LIGHTER)
            and not np.sqrt(least) * rank_tolerance < UNCLEAR_PIVOT)


@inlined
def _substitute(b, table, factored, settings):
    """Write y (rank,) for targets b (m,) by block forward substitution; return the rank."""
    rows, _, y, _, of_block = factored
    first = above = ZERO
    for level in range(table.shape[0]):
        last, rank = first + table[level, 1], table[level, 2]
        for i in range(first, last):
            rows.miss[i] = b[rows.row[i]]
        subtract(rows, y, first, last, above)  # p_i - J_i x_{i-1}, in (13)
        solve_level(rows.W, rows.miss, y, Block(first, last, above, rank), settings, of_block)
        first, above = last, rank
    return above


@compiled
def resolve(b, x, Q, table, W, pivots, settings, work):
    """Solve for targets b (m,); x (n,) is the reference on entry and the answer on return.

    Returns SOLVED, NUMERICAL_FAILURE with x = 0, -(i + 1) if target i is not finite, or
    -(m + 1 + c) if entry c of the reference is not. work: see `factorization_work`.
    """
    for i in range(b.size):
        if not np.isfinite(b[i]):
            return -(i + 1)
    zero_reference = True
    for c in range(x.size):
        if not np.isfinite(x[c]):
            return -(b.size + 1 + c)
        zero_reference &= x[c] == 0.0
    factored = _opened(W, pivots, work)
    u, u0 = factored.of_x[0], factored.of_x[1]
    rank = _substitute(b, table, factored, shared(settings))
    for k in range(u.size):
        u[k] = u0[k] = 0.0
    if not zero_reference:
        _project_reference(x, Q, factored, rank)
    _lift(factored, rank)
    for k in range(Q.shape[0]):
        add_multiple(x, u[k] - u0[k], Q[k])
    return finish(x, SOLVED)


@inlined
def _project_reference(x, Q, factored, rank):
    """Write Q^T q0 (14) into u0, and its reflection into u."""
    u, u0 = factored.of_x[0], factored.of_x[1]
    for k in range(Q.shape[0]):
        u[k] = u0[k] = inner_product(Q[k], x)
    reflect(factored.basis, ZERO, rank, factored.of_x, ZERO, ZERO + 1)
    if Q.shape[0] == x.size:  # only rounding of the reference is outside the basis
        for c in range(x.size):
            x[c] = 0.0
        for k in range(u0.size):
            u0[k] = 0.0


@inlined
def _lift(factored, rank):
    """Transform x, with y in its first columns, to coordinates of Q."""
    for c in range(rank):
        factored.of_x[0, c] = factored.y[c]
    reflect_back(factored.basis, rank, factored.of_x, ZERO, ZERO + 1)


@compiled
def resolve_units(Z, table, W, pivots, settings, work):
    """Write into row i of Z (m, width) the answer to unit target i, in coordinates of Q.

    Then G = Q Z^T and F = J G = C Z^T. work: see `factorization_work`.
    """
    m, width = Z.shape
    unit, factored = work[:m], _opened(W, pivots, work[m:])
    for i in range(m):
        for k in range(m):
            unit[k] = 1.0 if k == i else 0.0
        rank = _substitute(unit, table, factored, shared(settings))
        for k in range(width):
            factored.of_x[0, k] = 0.0
        _lift(factored, rank)
        for k in range(width):
            Z[i, k] = factored.of_x[0, k]


def factorization_work(rows: int, width: int) -> int:
    """Return the size of the work space for the kernels of this file."""
    return 3 * rows + (rows + width) * (width + 1)
