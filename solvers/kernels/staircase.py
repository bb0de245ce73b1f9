"""The exact task priority solution at every rank, from a level-by-level QR of J^T.

J^T = Q [R; O] (8), but with R an upper block staircase: a level takes as many columns of Q as it
adds rank, so columns that an upper level cannot use remain for the levels below. In y = Q^T x the
levels are solved from the top by block forward substitution, least squares in each block: the
recursion (5), (13) in other coordinates. The columns of Q that no level takes carry (14).
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product, internal
from solvers.kernels.linalg.block import solve_level
from solvers.kernels.linalg.rows import (
    factor_level,
    finish,
    has_outlier,
    length_of,
    load_rows,
    reflect,
    reflect_back,
)
from solvers.kernels.linalg.space import (
    Block,
    assign,
    carve_rows,
    fill,
    integers,
    matrix,
    shared,
    vector,
)
from solvers.kernels.tolerances import FAR_LIGHTER, LIGHT_ROW, UNCLEAR_CUT, UNCLEAR_PIVOT
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL

Staircase = namedtuple("Staircase", "basis rows y of_x of_block")
"""The rows in coordinates of Q.

basis: the reflectors of Q. rows: the rows of J Q. y (n,): the answer in the columns of the
levels. of_x (1, n): x, for reflections. of_block: work space of `solve_level`.
"""


@inlined
def carve_staircase(work, at, m, n):
    """Return a Staircase for m rows of n unknowns, and where it ends."""
    basis, at = matrix(work, at, n, n)
    rows, at = carve_rows(work, at, m, n)
    y, at = vector(work, at, n)
    of_x, at = matrix(work, at, 1, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Staircase(basis, rows, y, of_x, of_block), at


@compiled
def solve_by_staircase(A, lower, upper, sizes, x, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    settings: an array that starts with damping, threshold, rank_tolerance. work: any contents.
    Returns SOLVED, NUMERICAL_FAILURE, TOO_SMALL, -(i + 1) if row i is an inequality, or INACCURATE
    if a row is nearly parallel to others or far lighter, and damping is off.
    """
    code, least = climb(A, lower, upper, sizes, x, settings, work)
    if settings[0] > 0.0:  # which no other kernel does
        return NUMERICAL_FAILURE if code == INACCURATE else code
    return INACCURATE if code == SOLVED and least < UNCLEAR_PIVOT else code


@compiled
def solve_as_one(A, lower, upper, sizes, x, settings, work):
    """Solve like `solve_by_staircase`, all levels as one, but never INACCURATE."""
    whole, at = integers(work, 0, 1)
    whole[0] = lower.size
    code, _ = climb(A, lower, upper, whole, x, settings, work[at:])
    return NUMERICAL_FAILURE if code == INACCURATE else code


@internal
def climb(A, lower, upper, sizes, x, settings, work):
    """Solve like `solve_by_staircase`; return the code and the least pivot.

    INACCURATE, and x = 0, only if the square of a row underflows. A pivot is the remainder of a row
    when its column was made, relative to its norm.
    """
    m, n = A.shape
    (basis, rows, y, of_x, of_block), at = carve_staircase(work, 0, m, n)
    if at > work.size:
        return TOO_SMALL, 0.0
    settings = shared(settings)
    code = load_rows(rows.W, rows.zero, A, lower, upper, x, settings.rank_tolerance)
    if code != SOLVED:
        fill(x, 0.0)
        return code, 0.0

    rank, first, least = 0, 0, np.inf
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        reflect(basis, 0, above, rows.W, first, last)  # J_i Q: the level as seen from above
        assign(rows.miss[first:last], lower[first:])
        rank = factor_level(rows, basis, first, last, rank)
        block = Block(first, last, above, rank)
        least = smallest_pivot(rows, block, least)
        if rank - above < last - first and is_doubtful(rows, block, least, settings.rank_tolerance):
            least = 0.0
        for i in range(first, last):
            rows.miss[i] -= inner_product(y[:above], rows.W[i])  # p_i - J_i x_{i-1}, in (13)
        solve_level(rows.W, rows.miss, y, block, settings, of_block)
        first = last
    assign(of_x[0], x)
    if x.any():
        reflect(basis, 0, rank, of_x, 0, 1)
    assign(of_x[0, :rank], y)  # and the rest of the reference: (7) and (14)
    reflect_back(basis, 0, rank, of_x, 0, 1)
    assign(x, of_x[0])
    least = 0.0 if has_outlier(rows.zero, FAR_LIGHTER * FAR_LIGHTER) else least
    return finish(x, SOLVED), np.sqrt(least) * settings.rank_tolerance


@inlined
def is_doubtful(rows, block, least, rank_tolerance):
    """Whether rounding in heavy rows of a level hides light ones, or a row is hardly dependent."""
    thin = min(np.sqrt(least) * rank_tolerance, 1.0)  # the smallest pivot
    share, doubtful = UNCLEAR_CUT * thin, False
    if has_outlier(rows.zero[block.i0:block.i1], LIGHT_ROW * LIGHT_ROW):
        return True
    for i in range(block.i0 + block.k1 - block.k0, block.i1):
        doubtful |= length_of(rows.W[i, block.k1:]) ** 2 > share * share * rows.zero[i]
    return doubtful


@inlined
def smallest_pivot(rows, block, least):
    """Return the least squared pivot, relative to the square at which a row counts as zero."""
    for k in range(block.k0, block.k1):
        i = block.i0 + k - block.k0
        square, zero = rows.W[i, k] * rows.W[i, k], rows.zero[i]
        least = min(least, square / zero) if zero > 0.0 else least
    return least
