"""Damping beside inequalities: each damped level is one convex problem.

The staircase of the equalities alone gives an x. Where the inequalities are met, that is the
answer, as in `tpm`, unless a bound fixes an unknown, for bounds are not damped. Where a row is
exceeded, what lies along it is taken out of the equalities, in proportion up to all of it, and the
staircase of the rest gives each level its lambda: an arm that would be singular with a joint at its
limit is damped as one that is singular. Then level by level

    min |A_k x - b_k|^2 + lambda_k^2 |x - c_k|^2, levels above at what they have reached,

and last the distance to the reference. c_k is the x of the staircase without what level k adds to
it. So each level alone has that x for its minimum, and keeps it where inequalities allow. No lambda
depends on which of them act, and what a level hands down is unique: x is continuous in the sides,
except where those of a row meet, which makes an equality of it.
"""

from collections import namedtuple

from hierarchy.jit import add_multiple, inlined, inner_product, internal
from solvers.kernels.linalg.block import level_damping
from solvers.kernels.linalg.rows import (
    factor_level,
    inequalities_hold,
    length_of,
    only_entry,
    reflect,
    reflect_back,
)
from solvers.kernels.linalg.space import Block, assign, integers, matrix, shared, vector
from solvers.kernels.staircase import carve_staircase, solve_by_staircase
from solvers.kernels.tolerances import LEVEL_MET, SATURATES
from solvers.status import NUMERICAL_FAILURE, UNPROVED

Damped = namedtuple("Damped", "A lower upper sizes factor E b ends Q ranks free")
"""The rows of one level to damp and of those above it, and of the equalities alone.

A (m + n, n), lower, upper (m + n,), sizes (L,): m rows of the hierarchy, their sides as far as
they are met, then n rows of damping. factor (L,): lambda. E (m, n), b (m,), ends (L,): the
equalities, their targets, their number per level. Q (m, n), ranks (L,): the columns of the
staircase that each level adds, in its rows of E. free (n,): the x that meets the equalities.
"""


@inlined
def carve_damped(work, m, n, levels):
    """Return a Damped without data, and where it ends."""
    A, at = matrix(work, 0, m + n, n)
    lower, at = vector(work, at, m + n)
    upper, at = vector(work, at, m + n)
    sizes, at = integers(work, at, levels)
    factor, at = vector(work, at, levels)
    E, at = matrix(work, at, m, n)
    b, at = vector(work, at, m)
    ends, at = integers(work, at, levels)
    Q, at = matrix(work, at, m, n)
    ranks, at = integers(work, at, levels)
    free, at = vector(work, at, n)
    return Damped(A, lower, upper, sizes, factor, E, b, ends, Q, ranks, free), at


@internal
def open_damped(d, A, lower, upper, sizes, x, settings, work):
    """Write the rows, and the x and lambda of the equalities; return the code of that x.

    SOLVED: it meets all rows, UNPROVED: not all, or NUMERICAL_FAILURE. x: the reference.
    """
    first, count, fixed = 0, 0, False
    for k in range(sizes.size):
        d.sizes[k], begin = sizes[k], count
        for i in range(first, first + sizes[k]):
            assign(d.A[i], A[i])
            d.lower[i], d.upper[i] = lower[i], upper[i]
            if lower[i] == upper[i]:
                assign(d.E[count], A[i])
                d.b[count] = lower[i]
                count += 1
        d.ends[k], first = count - begin, first + sizes[k]
        fixed = fixed or bool(count > begin and _are_bounds(d, A, first, k))
    assign(d.free, x)
    E, b = d.E[:count], d.b[:count]
    code = solve_by_staircase(E, b, b, d.ends, d.free, settings, work)
    if code == NUMERICAL_FAILURE or (not fixed and inequalities_hold(A, lower, upper, d.free)):
        return code
    _factor_equalities(d, A, sizes, settings, work, True)
    _take_out_exceeded(d, E, A, lower, upper, x)
    _factor_equalities(d, A, sizes, settings, work, False)
    return UNPROVED


@inlined
def _are_bounds(d, A, last, k):
    """Whether level k, which ends at row `last`, has bounds alone: they are not damped."""
    bounds = False
    for i in range(last - d.sizes[k], last):
        single = only_entry(A[i]) >= 0
        if not single and A[i].any():
            return False
        bounds = bounds or (single and d.lower[i] < d.upper[i])
    return bounds


@inlined
def _take_out_exceeded(d, E, A, lower, upper, reference):
    """Take the directions of exceeded rows out of the equalities."""
    reach = length_of(d.free) + length_of(reference)
    for i in range(lower.size):
        value, norm = inner_product(A[i], d.free), length_of(A[i])
        over = max(value - upper[i], lower[i] - value)
        if lower[i] < upper[i] and over > 0.0 and norm > 0.0:
            share = min(SATURATES * over / (norm * reach), 1.0) if reach > 0.0 else 1.0
            for e in range(E.shape[0]):
                add_multiple(E[e], -share * inner_product(E[e], A[i]) / (norm * norm), A[i])


@inlined
def _factor_equalities(d, A, sizes, settings, work, whole):
    """Write what each level adds to the staircase, if `whole`, else its lambda."""
    m, n = d.E.shape
    (basis, rows, _, _, of_block), _ = carve_staircase(work, 0, m, n)
    settings, rank, first, begin = shared(settings), 0, 0, 0
    for k in range(sizes.size):
        end, last, e = begin + d.ends[k], first + sizes[k], begin
        for i in range(first, last):
            if d.lower[i] == d.upper[i]:
                assign(rows.W[e], d.E[e])
                rows.zero[e] = (settings.rank_tolerance * length_of(A[i])) ** 2
                e += 1
        reflect(basis, 0, rank, rows.W, begin, end)
        above, rank = rank, factor_level(rows, basis, begin, end, rank)
        if whole:
            d.ranks[k] = rank - above
            for t in range(above, rank):
                for c in range(n):
                    d.Q[begin + t - above, c] = 1.0 if c == t else 0.0
            reflect_back(basis, 0, rank, d.Q, begin, begin + rank - above)
        elif begin < end and not _are_bounds(d, A, last, k):
            d.factor[k] = level_damping(rows.W, Block(begin, end, above, rank), settings, of_block)
        else:
            d.factor[k] = 0.0
        first, begin = last, end


@internal
def damp_level(d, k):
    """Write the rows of damping below level k; return the number of rows up to them."""
    n, end, begin = d.free.size, 0, 0
    for j in range(k + 1):
        begin, end = begin + (d.ends[j] if j < k else 0), end + d.sizes[j]
    for t in range(n):
        for c in range(n):
            d.A[end + t, c] = d.factor[k] if c == t else 0.0
        d.lower[end + t] = d.factor[k] * d.free[t]
    for q in range(begin, begin + d.ranks[k]):
        add_multiple(d.lower[end:end + n], -d.factor[k] * inner_product(d.Q[q], d.free), d.Q[q])
    assign(d.upper[end:end + n], d.lower[end:])
    return end


@internal
def keep_reached(d, A, lower, upper, x, k, end):
    """Hold level k where x has brought it: its sides, and its columns of Q for its equalities.

    The levels above keep theirs, and the rows from `end` on get their data back.
    """
    for i in range(end, lower.size):
        assign(d.A[i], A[i])
        d.lower[i], d.upper[i] = lower[i], upper[i]
    begin, t = 0, 0
    for j in range(k):
        begin, t = begin + d.sizes[j], t + d.ends[j]
    last = t + d.ranks[k]
    for i in range(end):
        value = inner_product(d.A[i], x)
        if lower[i] < upper[i]:
            least = LEVEL_MET * (1.0 + abs(value))  # less is rounding of a side that is kept
            d.lower[i] = value if value < d.lower[i] - least else d.lower[i]
            d.upper[i] = value if value > d.upper[i] + least else d.upper[i]
        elif i < begin:
            d.lower[i] = d.upper[i] = value
        else:
            for c in range(x.size):
                d.A[i, c] = d.Q[t, c] if t < last else 0.0
            d.lower[i] = d.upper[i] = inner_product(d.A[i], x)
            t += 1
