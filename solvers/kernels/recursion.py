"""The recursion with null-space projections, (5), (6) and (13), at every rank.

(J_i P_{i-1})^# comes from an orthogonal decomposition J_i P_{i-1} = C V that reveals its rank: rows
of V orthonormal, C lower trapezoidal, pivoted by the largest remainder. Then P_i = P_{i-1} - V^T V.

The dampings of Nakamura, Chiaverini, and Buss and Kim act in the singular value decomposition
B = J_i P_{i-1} = sum_k s_k u_k v_k^T. Projectors stay undamped: no level disturbs those above it.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import add_multiple, compiled, inlined, inner_product, internal
from solvers.kernels.linalg.block import orthogonalise_rows, solve_damped_level, solve_level
from solvers.kernels.linalg.rows import (
    finish,
    finish_unless_missed,
    has_outlier,
    largest_row,
    length_of,
    load_rows,
    swap,
    swap_rows,
)
from solvers.kernels.linalg.space import Block, assign, fill, matrix, shared, vector
from solvers.kernels.tolerances import NEGLIGIBLE, REMAINDER, SIGN_ROUNDING
from solvers.status import INACCURATE, SOLVED, TOO_SMALL

LEVEL, NAKAMURA, CHIAVERINI, SELECTIVE = 0.0, 1.0, 2.0, 3.0  # methods of `Recursive`, in order
SHRUNK = 0.01  # squared norm of a remainder: smaller ones are projected a second time

Inverse = namedtuple("Inverse", "method damping threshold isotropic largest")
"""How to invert: the method, and settings as in `Recursive`, after the shared ones."""

Projected = namedtuple("Projected", "W C V P zero miss")
"""Rows J_i P_{i-1} = C V, their residuals, and the projector.

W (m, n): the remainders of the rows. C (m, n), V (n, n), P (n, n). zero, miss (m,): see `Rows`.
"""


@inlined
def _carve(work, m, n):
    """Return Projected for m rows of n unknowns, and where it ends."""
    W, at = matrix(work, 0, m, n)
    C, at = matrix(work, at, m, n)
    V, at = matrix(work, at, n, n)
    P, at = matrix(work, at, n, n)
    zero, at = vector(work, at, m)
    miss, at = vector(work, at, m)
    return Projected(W, C, V, P, zero, miss), at


@compiled
def recursion(A, lower, upper, sizes, x, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    settings: those of `Recursive`. Other arguments and the codes are those of `solve_by_staircase`,
    but INACCURATE if a level is missed whose rows are rounding beside others, or which has light
    rows that its heavy ones round off.
    """
    m, n = A.shape
    rows, at = _carve(work, m, n)
    y, at = vector(work, at, n)
    q, at = vector(work, at, n)
    of_block, at = vector(work, at, 2 * (m + n) * (n + 1))
    if at > work.size:
        return TOO_SMALL
    inverse = Inverse(settings[3], settings[0], settings[1], settings[4], settings[5])
    settings = shared(settings)
    code = load_rows(rows.W, rows.zero, A, lower, upper, x, settings.rank_tolerance)
    if code != SOLVED:
        return finish(x, code)
    _begin(rows, q)

    rank, first, doubtful = 0, 0, False
    for level in range(sizes.size):
        last, above = first + sizes[level], rank
        _see(rows, A, lower, q, first, last, above)
        rank = _decompose(rows, A, first, last, rank, settings.rank_tolerance)
        block = Block(first, last, above, rank)
        if inverse.method == LEVEL:
            solve_level(rows.C, rows.miss, y, block, settings, of_block)
            doubtful |= _rounds_off(rows, y, block, settings.rank_tolerance)
        else:
            invert(rows, y, block, inverse, of_block)
        for k in range(above, rank):
            add_multiple(q, y[k], rows.V[k])  # (5)
        first = last
    for i in range(n):
        add_multiple(q, x[i], rows.P[i])  # (14): I - J^# J = P_l
    assign(x, q)
    light = has_outlier(rows.zero, NEGLIGIBLE * NEGLIGIBLE) and inverse.method == LEVEL
    code = finish_unless_missed(light, A, lower, sizes, x, settings.damping)
    return INACCURATE if code == SOLVED and doubtful and settings.damping == 0.0 else code


@inlined
def _rounds_off(rows, y, at, rank_tolerance):
    """Whether rounding in the violation of a heavy row may turn a light one of its level."""
    if at.i1 - at.i0 == at.k1 - at.k0:
        return False
    source, pivot, reach = 0.0, np.inf, 1.0
    for k in range(at.k0, at.k1):
        pivot, reach = min(pivot, abs(rows.C[at.i0 + k - at.k0, k])), reach + abs(y[k])
    for i in range(at.i0, at.i1):
        off = abs(rows.miss[i] - inner_product(y[at.k0:at.k1], rows.C[i, at.k0:]))
        norm = np.sqrt(rows.zero[i])  # times rank_tolerance
        source = max(source, off * norm if norm < np.inf else 0.0)
    return SIGN_ROUNDING * source > REMAINDER * rank_tolerance * pivot * pivot * reach


@inlined
def _begin(rows, q):
    """Set C and q to zero, and P_0 to I."""
    fill(q, 0.0)
    for i in range(rows.C.shape[0]):
        fill(rows.C[i], 0.0)
    for i in range(q.size):
        fill(rows.P[i], 0.0)
        rows.P[i, i] = 1.0


@inlined
def _see(rows, A, b, q, first, last, above):
    """Write the residual of a level, p_i - J_i x_{i-1} in (13), and its rows J_i P_{i-1}."""
    for i in range(first, last):
        rows.miss[i] = b[i] - inner_product(A[i], q)
        if above > 0:
            _project(rows.W[i], A[i], rows.P)
            if inner_product(rows.W[i], rows.W[i]) <= rows.zero[i]:
                fill(rows.W[i], 0.0)  # it depends on levels above; what is left is rounding


@inlined
def _decompose(rows, A, first, last, rank, rank_tolerance):
    """Decompose the rows of a level into unit vectors, largest first; return the rank."""
    for i in range(first, last):
        pivot, square = largest_row(rows.W, rows.zero, i, last, 0)
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


@internal
def _project(w, a, P):
    """Set w to a P."""
    fill(w, 0.0)
    for k in range(w.size):
        add_multiple(w, a[k], P[k])


@internal
def _take_direction(rows, i, last, k, again):
    """Normalise row i of W to V[k], and remove it from the level's rows and from P.

    again: project it a second time, so that V[k] stays in the range of P if its remainder is small.
    """
    v = rows.V[k]
    if again:
        _project(v, rows.W[i], rows.P)
    else:
        assign(v, rows.W[i])
    norm = length_of(v)
    for c in range(v.size):
        v[c] /= norm
    for j in range(i, last):
        rows.C[j, k] = inner_product(v, rows.W[j])
        add_multiple(rows.W[j], -rows.C[j, k], v)
    for j in range(v.size):
        add_multiple(rows.P[j], -v[j], v)  # (6)

Singular = namedtuple("Singular", "S Y sizes step total")
"""The decomposition of a level with p rows and rank r, and a step.

S (r, p): row k is s_k u_k. Y (r, r): row k is v_k in coordinates of V. sizes (n,): norms of the
columns of B. step, total (n,): of one singular vector, and of the level.
"""


@internal
def invert(rows, y, at, inverse, work):
    """Write the damped step of one level into y.

    Of Chiaverini: sum_k s_k / (s_k^2 + beta^2 + [k smallest] lambda^2) v_k u_k^T r, with lambda^2 =
    (1 - (s_m / epsilon)^2) lambda_max^2 for s_m < epsilon. A level that has lost rank has s_m = 0,
    and nothing remains in that direction. work: what `recursion` has for it.
    """
    r, lost = at.k1 - at.k0, at.i1 - at.i0 > at.k1 - at.k0
    if r == 0:
        return
    if inverse.method == NAKAMURA:  # lambda = lambda_0 (1 - w / w_0) for w = sqrt(det B B^T) < w_0
        w = 0.0 if lost else 1.0
        for k in range(r):
            w *= abs(rows.C[at.i0 + k, at.k0 + k])
        damped = inverse.damping * max(0.0, 1.0 - w / inverse.threshold)
        solve_damped_level(rows.C, rows.miss, y, at, damped, work)
        return
    space, of_step = _decomposed(rows, at, work)
    if inverse.method == SELECTIVE:
        _selective(rows, y, at, inverse, space)
        return
    least, smallest = np.inf, 0
    for k in range(r):
        square, _ = _along(rows, at, space, k)
        if square < least:
            least, smallest = square, k
    ratio = 0.0 if lost else least / (inverse.threshold * inverse.threshold)
    if (inverse.damping == 0.0 or ratio >= 1.0) and inverse.isotropic == 0.0:
        solve_damped_level(rows.C, rows.miss, y, at, 0.0, of_step)
        return
    extra = inverse.damping * inverse.damping * max(0.0, 1.0 - ratio)  # lambda^2
    fill(y[at.k0:at.k1], 0.0)
    for k in range(r):
        square, part = _along(rows, at, space, k)
        below = square + inverse.isotropic * inverse.isotropic
        below += extra if k == smallest and not lost else 0.0
        add_multiple(y[at.k0:], part / below, space.Y[k])


@inlined
def _decomposed(rows, at, work):
    """Decompose the block of a level; return it and the rest of `work`."""
    p, r, n = at.i1 - at.i0, at.k1 - at.k0, rows.V.shape[1]
    S, end = matrix(work, 0, r, p)
    Y, end = matrix(work, end, r, r)
    sizes, end = vector(work, end, n)
    step, end = vector(work, end, n)
    total, end = vector(work, end, n)
    for k in range(r):
        for i in range(p):
            S[k, i] = rows.C[at.i0 + i, at.k0 + k]
        fill(Y[k], 0.0)
        Y[k, k] = 1.0
    orthogonalise_rows(S, Y)
    return Singular(S, Y, sizes, step, total), work[end:]


@inlined
def _along(rows, at, space, k):
    """Return s_k^2, and s_k u_k^T times the residual of the level."""
    s = space.S[k]
    return inner_product(s, s), inner_product(s, rows.miss[at.i0:])


@inlined
def _selective(rows, y, at, inverse, space):
    """Write the selectively damped step: each singular vector has a largest step of its own.

    gamma_k = min(1, N_k / M_k) gamma_max, M_k = (1 / s_k) sum_j |v_kj| |b_j|, b_j the columns of B,
    and N_k = |u_k| = 1: a level counts as one end effector.
    """
    r, n = at.k1 - at.k0, rows.V.shape[1]
    for c in range(n):
        total = 0.0
        for i in range(at.i0, at.i1):
            entry = 0.0
            for k in range(at.k0, at.k1):
                entry += rows.C[i, k] * rows.V[k, c]
            total += entry * entry
        space.sizes[c] = np.sqrt(total)
    fill(y[at.k0:at.k1], 0.0)
    fill(space.total, 0.0)
    for k in range(r):
        square, part = _along(rows, at, space, k)
        reach = 0.0  # M_k s_k
        fill(space.step, 0.0)
        for j in range(r):
            add_multiple(space.step, space.Y[k, j], rows.V[at.k0 + j])
        for c in range(n):
            reach += abs(space.step[c]) * space.sizes[c]
        own = min(1.0, np.sqrt(square) / reach) * inverse.largest
        share = _share(space.step, part / square, own)
        add_multiple(y[at.k0:], share * part / square, space.Y[k])
        add_multiple(space.total, share * part / square, space.step)
    share = _share(space.total, 1.0, inverse.largest)
    for j in range(r):
        y[at.k0 + j] *= share


@inlined
def _share(v, factor, largest):
    """Return the share of factor v whose largest entry is `largest`, at most 1."""
    size = 0.0
    for c in range(v.size):
        size = max(size, abs(factor * v[c]))
    return largest / size if size > largest else 1.0
