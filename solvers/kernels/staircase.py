"""The exact task priority solution at every rank, from a level-by-level QR of J^T.

J^T = Q [R; O] (8), but with R an upper block staircase: a level takes as many columns of Q as it
adds rank, so what an upper level cannot use stays free for the levels below. In y = Q^T x the
levels are solved from the top by block forward substitution, least squares in each block: the
recursion (5), (13) in other coordinates. The columns of Q that no level took carry (14).
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_level
from solvers.kernels.rows import ZERO, factor_level, finish, load_rows, reflect, reflect_back
from solvers.kernels.space import (
    Basis,
    Block,
    Rows,
    View,
    carve_basis,
    carve_rows,
    matrix,
    shared,
    vector,
)
from solvers.status import SOLVED, TOO_SMALL


class Staircase(NamedTuple):
    """The rows in coordinates of Q.

    basis: the reflectors of Q. rows: the rows of J Q. y (n,): the answer in the columns that the
    levels took. of_x (1, n): x, to be reflected. of_block: work space of `solve_level`.
    """

    basis: Basis
    rows: Rows
    y: View
    of_x: View
    of_block: View


@inlined
def carve_staircase(work, at, m, n):
    """Return a Staircase for m rows of n unknowns, and where it ends."""
    basis, at = carve_basis(work, at, n, n)
    rows, at = carve_rows(work, at, m, n)
    y, at = vector(work, at, n)
    of_x, at = matrix(work, at, 1, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Staircase(basis, rows, y, of_x, of_block), at


@compiled
def solve_by_staircase(A, lower, upper, sizes, x, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    settings: an array that begins with damping, threshold, rank_tolerance. work: of any content.
    Returns SOLVED, NUMERICAL_FAILURE, TOO_SMALL, or -(i + 1) where row i is an inequality.
    """
    m, n = A.shape
    (basis, rows, y, of_x, of_block), at = carve_staircase(work, 0, m, n)
    if at > work.size:
        return TOO_SMALL
    settings = shared(settings)
    code = load_rows(rows.W, rows.zero, A, lower, upper, x, settings.rank_tolerance)
    if code != SOLVED:
        return finish(x, code)

    rank = first = ZERO
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        reflect(basis, ZERO, above, rows.W, first, last)  # J_i Q: the level as seen from above
        _ask(rows, lower, first, last)
        rank = factor_level(rows, basis, first, last, rank)
        subtract(rows, y, first, last, above)  # p_i - J_i x_{i-1}, in (13)
        solve_level(rows.W, rows.miss, y, Block(first, last, above, rank), settings, of_block)
        first = last
    _to_unknowns(basis, y, rank, x, of_x)
    return finish(x, SOLVED)


@inlined
def _ask(rows, b, first, last):
    """Write the targets of a level into what it misses."""
    for i in range(first, last):
        rows.miss[i] = b[i]


@inlined
def subtract(rows, y, first, last, above):
    """Take what y reaches in columns 0 .. above - 1 out of what a level misses."""
    for i in range(first, last):
        miss = rows.miss[i]
        for c in range(above):
            miss -= rows.W[i, c] * y[c]
        rows.miss[i] = miss


@inlined
def _to_unknowns(basis, y, rank, x, of_x):
    """Turn x, a reference, into Q [y; rest], the rest being that of the reference: (7) and (14)."""
    zero_reference = True
    for c in range(x.size):
        of_x[0, c] = x[c]
        zero_reference &= x[c] == 0.0
    if not zero_reference:
        reflect(basis, ZERO, rank, of_x, ZERO, ZERO + 1)
    for c in range(rank):
        of_x[0, c] = y[c]
    reflect_back(basis, rank, of_x, ZERO, ZERO + 1)
    for c in range(x.size):
        x[c] = of_x[0, c]


@compiled
def staircase_work(m, n):  # for hcod.py until it is replaced
    """Return how many numbers of work space `staircase` needs."""
    return 3 + (2 * m + 2 * n + 4) * n + 4 * m


@compiled
def staircase(A, lower, upper, sizes, x, damping, threshold, rank_tolerance, work):
    """Like `solve_by_staircase`."""  # for hcod.py, tpm.py until they are replaced
    if work.size < 3:
        return TOO_SMALL
    work[0], work[1], work[2] = damping, threshold, rank_tolerance
    return solve_by_staircase(A, lower, upper, sizes, x, work[:3], work[3:])
