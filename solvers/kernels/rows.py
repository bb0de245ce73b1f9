"""What kernels do to rows: check and copy them, reflect them, swap them.

The inner loops run over views of whole rows, unit stride, so that the compiler may vectorise them
without fastmath. numba does not inline across functions, so each function here does the work of a
range of rows; and it compiles a function once more for a literal argument, so counters start from
ZERO.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined

ZERO = np.int64(0)
# Values of solvers.Status; -(i + 1) refuses row i, an inequality.
SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE = 0, 1, 2

INACCURATE = 4
TOO_SMALL = 8  # no value of solvers.Status: the work space is, and nothing was done
# A multiplier is known to ROUNDING times the size of the rows that it balances: where rows of very
# different scale conflict, that is more than DOUBT times what they really pull.
ROUNDING, DOUBT = 1e-13, 1e-6
SLIGHT = 1e-6  # share of its terms by which a level may be missed and yet be attainable
GROWTH = 1e3  # of x over the distance of the farthest acting row from zero; more is worth a doubt
NEARLY_PARALLEL = 1e-5  # what is left of a row behind others, as a share; less is worth a doubt
FREE, EQUAL = 0, 2  # what a row does; -1 and +1: it acts at its lower or upper side


@compiled
def load_rows(W, zero, A, lower, upper, x, rank_tolerance):
    """Copy A into the first rows of W, check all data, and say when a row counts as zero.

    zero (m,) receives the squared norm at or below which what is left of a row is nothing.
    Returns SOLVED, NUMERICAL_FAILURE at an entry that is not finite, or -(i + 1) where row i is an
    inequality.
    """
    m, n = A.shape
    for i in range(m):
        if lower[i] != upper[i]:
            return -(i + 1) if lower[i] < upper[i] else NUMERICAL_FAILURE
        square = 0.0
        for c in range(n):
            W[i, c] = A[i, c]
            square += A[i, c] * A[i, c]
        zero[i] = rank_tolerance * rank_tolerance * square
        if not (np.isfinite(square) and np.isfinite(lower[i])):
            return NUMERICAL_FAILURE
    for c in range(n):
        if not np.isfinite(x[c]):
            return NUMERICAL_FAILURE
    return SOLVED


@compiled
def prepare(A, lower, upper, x, active, held, multiplier, scale):
    """Check the data and start the record; return the number of inequality rows, -1 if bad."""
    m, n = A.shape
    inequalities = 0
    for c in range(n):
        if not np.isfinite(x[c]):
            return -1
    for i in range(m):
        square = 0.0
        for c in range(n):
            square += A[i, c] * A[i, c]
        scale[i] = np.sqrt(square)
        held[i], multiplier[i] = -1.0, 0.0
        low, up = lower[i], upper[i]
        if not np.isfinite(square) or not low <= up or low == np.inf or up == -np.inf:
            return -1
        if low == up:
            active[i] = EQUAL
            continue
        inequalities += 1
        guess = active[i]
        known = (guess == 1 and up < np.inf) or (guess == -1 and low > -np.inf)
        active[i] = guess if known else FREE
    return inequalities


@inlined
def reflect_rows(W, beta, V, k0, k1, i0, i1):
    """Apply reflectors k0 .. k1 - 1 to rows i0 .. i1 - 1 of W, one after the other.

    Reflector k is I - beta[k] v v^T, its v in row V + k of W, zero before column k.
    """
    for k in range(k0, k1):
        v = W[V + k, k:]
        for i in range(i0, i1):
            w = W[i, k:]
            s = 0.0
            for c in range(v.size):
                s += w[c] * v[c]
            s *= beta[k]
            for c in range(v.size):
                w[c] -= s * v[c]


@inlined
def largest_row(W, zero, i0, i1, c0):
    """Row of i0 .. i1 - 1 with the largest norm from column c0 on, and that norm squared.

    The row is -1 if all count as zero.
    """
    largest, pivot = 0.0, -1
    for i in range(i0, i1):
        w = W[i, c0:]
        square = 0.0
        for c in range(w.size):
            square += w[c] * w[c]
        if square > largest and square > zero[i]:
            largest, pivot = square, i
    return pivot, largest


@inlined
def swap_rows(W, i, j):
    """Exchange rows i and j of W."""
    for c in range(W.shape[1]):
        W[i, c], W[j, c] = W[j, c], W[i, c]


@inlined
def make_reflector(W, beta, V, k, i, square):
    """Make reflector k (see `reflect_rows`) map row i of W onto unit vector k; apply it to no row.

    square is the squared norm of the row from column k on.
    """
    for c in range(k, W.shape[1]):
        W[V + k, c] = W[i, c]
    norm = np.sqrt(square)
    W[V + k, k] += norm if W[V + k, k] >= 0.0 else -norm
    beta[k] = 1.0 / (norm * abs(W[V + k, k]))


@compiled
def factor_level(W, row, zero, miss, beta, V, begin, end, rank):
    """Give the rows begin .. end - 1, already reflected, columns of their own; return the rank.

    The rows are brought into pivot order, and row, zero and miss with them.
    """
    for i in range(begin, end):
        pivot, square = largest_row(W, zero, i, end, rank)
        if pivot < 0:
            break
        if pivot != i:
            swap_rows(W, i, pivot)
            row[i], row[pivot] = row[pivot], row[i]
            zero[i], zero[pivot] = zero[pivot], zero[i]
            miss[i], miss[pivot] = miss[pivot], miss[i]
        make_reflector(W, beta, V, rank, i, square)
        reflect_rows(W, beta, V, rank, rank + 1, i, end)
        rank += 1
    return rank


@compiled
def grown(lower, upper, active, scale, x, reference):
    """Whether x is far longer than the rows that act, or the reference, ask for."""
    size = square = 0.0
    for c in range(x.size):
        size += x[c] * x[c]
        square += reference[c] * reference[c]
    if size <= GROWTH * GROWTH * square:
        return False
    size = np.sqrt(size)
    for i in range(active.size):
        if active[i] != FREE:
            bound = upper[i] if active[i] > 0 else lower[i]
            if scale[i] * size <= GROWTH * abs(bound):
                return False
    return size > 0.0


@compiled
def finish(x, code):
    """Return code if x is finite; otherwise, or if code is no success, make x zero and say so."""
    for i in range(x.size):
        if not np.isfinite(x[i]) and code == SOLVED:
            code = NUMERICAL_FAILURE
    if code != SOLVED:
        for i in range(x.size):
            x[i] = 0.0
    return code
