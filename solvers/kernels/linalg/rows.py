"""Operations on rows in kernels: check, copy, reflect, swap, factor.

The inner loops run over views of whole rows with unit stride, so that the compiler can vectorise
them without fastmath. numba does not inline across functions, so each function here handles a range
of rows.
"""

import numpy as np

from hierarchy.jit import add_multiple, inlined, inner_product, internal
from solvers.kernels.linalg.space import fill
from solvers.kernels.tolerances import LEAST_SQUARE, LEVEL_MET, NEGLIGIBLE
from solvers.status import INACCURATE, NUMERICAL_FAILURE, SOLVED

LANES = 8  # numbers that the inner loops take at a time


@internal
def load_rows(W, zero, A, lower, upper, x, rank_tolerance):
    """Copy A into the first rows of W, check all data, and write when a row counts as zero.

    zero (m,) receives the squared norm at or below which the remainder of a row counts as zero,
    infinite for a row that is rounding beside the largest. Returns SOLVED, NUMERICAL_FAILURE for an
    entry that is not finite, -(i + 1) if row i is an inequality, or INACCURATE if the square of a
    row underflows.
    """
    (m, n), most = A.shape, 0.0
    code = SOLVED if all_finite(x) else NUMERICAL_FAILURE
    for i in range(m):
        if lower[i] != upper[i]:
            return -(i + 1) if lower[i] < upper[i] else NUMERICAL_FAILURE
        square = 0.0
        for c in range(n):
            W[i, c] = A[i, c]
            square += A[i, c] * A[i, c]
        zero[i], most = rank_tolerance * rank_tolerance * square, max(most, square)
        if square <= LEAST_SQUARE and code == SOLVED and A[i].any():
            code = INACCURATE
        if not (np.isfinite(square) and np.isfinite(lower[i])):
            return NUMERICAL_FAILURE
    most *= (rank_tolerance * NEGLIGIBLE) ** 2
    for i in range(m):
        zero[i] = np.inf if 0.0 < zero[i] < most else zero[i]
    return code


@inlined
def all_finite(x):
    """Whether every entry is finite."""
    finite = True
    for c in range(x.size):
        finite &= np.isfinite(x[c])
    return finite


@inlined
def length_of(x):
    """Return the Euclidean norm."""
    return np.sqrt(inner_product(x, x))


@inlined
def all_equal(lower, upper):
    """Whether all rows are equalities."""
    equal = True
    for i in range(lower.size):
        equal &= lower[i] == upper[i]
    return equal


@inlined
def inequalities_hold(A, lower, upper, x):
    """Whether x meets all rows that are no equalities."""
    hold = True
    for i in range(lower.size):
        hold &= lower[i] == upper[i] or lower[i] <= inner_product(A[i], x) <= upper[i]
    return hold


@inlined
def only_entry(a):
    """Return the unknown that a row names alone, -1 if it has none or several."""
    entries, only = 0, 0
    for c in range(a.size):
        entries += a[c] != 0.0
    while entries == 1 and a[only] == 0.0:
        only += 1
    return only if entries == 1 else -1


@inlined
def largest_row(W, zero, i0, i1, c0):
    """Return the row of i0 .. i1 - 1 with the largest norm from column c0 on, and its square.

    The row is -1 if all rows count as zero.
    """
    largest, pivot = 0.0, -1
    for i in range(i0, i1):
        square = inner_product(W[i, c0:], W[i, c0:])
        if square > largest and square > zero[i]:
            largest, pivot = square, i
    return pivot, largest


@inlined
def has_outlier(sizes, share):
    """Whether a positive entry is smaller than this share of another."""
    least, most = np.inf, 0.0
    for i in range(sizes.size):
        least, most = min(least, sizes[i] if sizes[i] > 0.0 else np.inf), max(most, sizes[i])
    return least < share * most


@inlined
def swap(values, i, j):
    """Exchange entries i and j."""
    values[i], values[j] = values[j], values[i]


@inlined
def swap_rows(W, i, j):
    """Exchange rows i and j of W."""
    for c in range(W.shape[1]):
        W[i, c], W[j, c] = W[j, c], W[i, c]


@inlined
def reflect(basis, k0, k1, W, i0, i1):
    """Apply reflectors k0 .. k1 - 1 of the basis to rows i0 .. i1 - 1 of W, in this order.

    Q is the product of the reflectors I - v v^T, v the rows of the basis, zero before column k.
    They act from a whole block of lanes on, so that each finds what the last has stored.
    """
    for k in range(k0, k1):
        first = k & -LANES if basis.shape[1] >= LANES else k
        v = basis[k, first:]
        for i in range(i0, i1):
            reflect_by(v, W[i, first:])


@inlined
def reflect_by(v, w):
    """Reflect w by I - v v^T; v has the size."""
    add_multiple(w, -inner_product(v, w), v)


@inlined
def reflect_back(basis, k0, k1, W, i0, i1):
    """Apply reflectors k1 - 1 .. k0: from coordinates of Q to x, for rows i0 .. i1 - 1 of W."""
    for k in range(k1 - 1, k0 - 1, -1):
        reflect(basis, k, k + 1, W, i0, i1)


@inlined
def make_reflector(basis, k, w, square):
    """Make reflector k, which maps the row w onto unit vector k, without applying it.

    square is the squared norm of w from column k on.
    """
    v, norm = basis[k], np.sqrt(square)
    head = w[k] + (norm if w[k] >= 0.0 else -norm)
    scale = 1.0 / np.sqrt(norm * abs(head))
    for c in range(k & -LANES, w.size):
        v[c] = scale * w[c] if c > k else 0.0
    v[k] = scale * head


@internal
def factor_level(rows, basis, begin, end, rank):
    """Factor rows begin .. end - 1, already reflected, into columns of their own; return the rank.

    The rows are put into pivot order, together with row, zero and miss.
    """
    W = rows.W
    for i in range(begin, end):
        pivot, square = largest_row(W, rows.zero, i, end, rank)
        if pivot < 0:
            break
        if pivot != i:
            swap_rows(W, i, pivot)
            swap(rows.row, i, pivot)
            swap(rows.zero, i, pivot)
            swap(rows.miss, i, pivot)
        make_reflector(basis, rank, W[i], square)
        reflect(basis, rank, rank + 1, W, i, end)
        rank += 1
    return rank


@internal
def finish(x, code):
    """Return `code`, NUMERICAL_FAILURE if x is not finite or not found; x is zero unless SOLVED."""
    if code == INACCURATE or (code == SOLVED and not all_finite(x)):
        code = NUMERICAL_FAILURE
    if code != SOLVED:
        fill(x, 0.0)
    return code


@internal
def finish_unless_missed(light, A, b, sizes, x, damping):
    """Return the code of `finish`, or INACCURATE if a level of rows that are rounding is missed.

    light : whether `load_rows` may have found such rows. Beside a heavier row of its level one is
    no more than a small change of that row, and any is missed with damping.
    """
    code, most, first = finish(x, SOLVED), 0.0, 0
    if code != SOLVED or not light or damping > 0.0:
        return code
    for i in range(b.size):
        most = max(most, length_of(A[i]))
    for k in range(sizes.size):
        last, largest, over = first + sizes[k], 0.0, 0.0
        for i in range(first, last):
            norm = length_of(A[i])
            largest = max(largest, norm)
            off = abs(b[i] - inner_product(A[i], x))
            over = max(over, off / norm if norm > 0.0 else 0.0)
        if 0.0 < largest < NEGLIGIBLE * most and over > LEVEL_MET * (1.0 + length_of(x)):
            code = INACCURATE
        first = last
    return code
