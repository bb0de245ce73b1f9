"""Weighted least squares with the rows that act as equalities, and what each of them pushes with.

Minimised is sum_i (w_i e_i)^2 + mu^2 ||x - x_0||^2, e_i what soft row i is missed by, on the hard
rows. In x = x_0 + Q y, with Q from an LQ factorisation of first the hard and then the weighted soft
rows in pivot order, the hard rows give the first y by substitution, and a QR of the soft rows and
mu I the others. Reflections of columns keep the error of each row in proportion to that row, and
the pivot order makes the QR do the same (Powell, Reid 1969; Barlow, Handy 1988; Cox, Higham 1998),
so weights may differ by any ratio. Normal equations would square them.

R (7, m) holds by row of A its norm, its push, the rounding in that and whether there is a doubt;
and by acting row, in the order of W, its number, what counts as zero, and what is missed. W
(m + n + 5, n): acting rows, reflectors of Q, five vectors. settings: regularisation, damping,
threshold, rank_tolerance, ...; see `weighted.py`.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import variable_damping
from solvers.kernels.flat import factor_level, reflect_rows
from solvers.kernels.rows import ROUNDING, ZERO
from solvers.status import FREE

SCALE, PUSH, NOISE, DOUBT, ROW, NOTHING, MISS = range(7)  # rows of R
EXACT, CLOSE = 1e-12, 1e-7  # shares left of a row behind others between which it is ill-posed


@compiled
def solve_acting(A, lower, upper, reference, x, active, weight, R, W, settings, work):
    """Write x and the pushes; return whether rows are nearly parallel but not quite.

    work: at least (m + n) (n + 1) numbers, of any content.
    """
    m, n = A.shape
    zero, miss, row = R[NOTHING], R[MISS], R[ROW].view(np.int64)
    V, X = m, m + n
    beta, y = W[X + 1], W[X + 2]
    hard = _gather(A, lower, upper, reference, active, weight, R, W, settings[3], ZERO, True)
    end = _gather(A, lower, upper, reference, active, weight, R, W, settings[3], hard, False)
    p = factor_level(W, row, zero, miss, beta, V, ZERO, hard, ZERO)
    reflect_rows(W, beta, V, ZERO, p, hard, end)
    for k in range(p):
        y[k] = miss[k]
        for c in range(k):
            y[k] -= W[k, c] * y[c]
        y[k] /= W[k, k]
    rank = factor_level(W, row, zero, miss, beta, V, hard, end, p)
    close = False
    for i in range(end):
        norm = R[SCALE, row[i]] * (1.0 if i < hard else weight[row[i]])
        own = i if i < hard else p + i - hard
        left = _drop_rounding(W, i, own, zero[i], p if i < hard else rank)
        close |= EXACT * norm < left < CLOSE * norm
    for i in range(hard, end):
        for c in range(p):
            miss[i] -= W[i, c] * y[c]
    mu = settings[0]
    if settings[1] > 0.0 and rank > p:
        mu = np.hypot(mu, variable_damping(W, hard, end, p, rank, settings[1], settings[2], work))
    _least_squares(W, miss, y, hard, end, p, rank, mu, W[X + 3], work)
    for c in range(n):
        W[X, c] = y[c] if c < rank else 0.0
    for k in range(rank - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, X, X + 1)
    for c in range(n):
        x[c] = reference[c] + W[X, c]
    _pushes(lower, upper, x, active, weight, R, W, hard, end, p, settings[0])
    return close


@inlined
def side_of(lower, upper, active, i):
    """The side at which a row acts."""
    return lower[i] if active[i] == -1.0 else upper[i]


@inlined
def length_of(x):
    """Euclidean norm."""
    square = 0.0
    for c in range(x.size):
        square += x[c] * x[c]
    return np.sqrt(square)


@compiled
def _gather(A, lower, upper, reference, active, weight, R, W, rank_tolerance, at, hard):
    """Write the acting rows that are hard, or soft, into W from row `at` on; return their end."""
    row = R[ROW].view(np.int64)
    for i in range(active.size):
        if active[i] == FREE or (weight[i] == np.inf) != hard:
            continue
        w, miss = 1.0 if hard else weight[i], side_of(lower, upper, active, i)
        for c in range(reference.size):
            W[at, c] = w * A[i, c]
            miss -= A[i, c] * reference[c]
        row[at], R[MISS, at] = i, w * miss
        R[NOTHING, at] = (rank_tolerance * w * R[SCALE, i]) ** 2
        at += 1
    return at


@inlined
def _drop_rounding(W, i, own, zero, rank):
    """Set to zero what of row i, from its end, is nothing: of a heavy row it would be something.

    own: its column where it got one. Returns what was left of it there, or when it got none.
    """
    square = 0.0
    for c in range(rank, W.shape[1]):
        square += W[i, c] * W[i, c]
    for c in range(rank - 1, -1, -1):
        more = square + W[i, c] * W[i, c]
        if more > zero:
            return abs(W[i, c]) if c == own else np.sqrt(square)
        square = more
        W[i, c] = 0.0
    return np.sqrt(square)


@compiled
def _least_squares(W, miss, y, i0, i1, k0, k1, mu, diagonal, work):
    """Write into y[k0:k1] what minimises ||W y - miss||^2 + mu^2 ||y||^2, over rows i0:i1.

    miss[i0:i1] goes out as what is still missed. It comes out of the reflections, so that what
    little a heavy row misses is as exact as the rest.
    """
    rows, q = i1 - i0, k1 - k0
    height = rows + q
    T = work[:height * (q + 1)].reshape((q + 1, height))  # a column lies in memory as a row
    b = T[q]
    for k in range(q + 1):
        for i in range(rows):
            T[k, i] = miss[i0 + i] if k == q else W[i0 + i, k0 + k]
        for i in range(rows, height):
            T[k, i] = mu if i - rows == k else 0.0
    for k in range(q):
        v = T[k, k:]
        norm = length_of(v)
        diagonal[k] = -norm if v[0] > 0.0 else norm
        v[0] -= diagonal[k]
        for j in range(k + 1, q + 1):
            _reflect(v, T[j, k:], diagonal[k])
    for k in range(q - 1, -1, -1):
        rest = b[k]
        for j in range(k + 1, q):
            rest -= T[j, k] * y[k0 + j]
        y[k0 + k] = rest / diagonal[k]
    for k in range(q):
        b[k] = 0.0
    for k in range(q - 1, -1, -1):
        _reflect(T[k, k:], b[k:], diagonal[k])
    for i in range(rows):
        miss[i0 + i] = b[i]


@inlined
def _reflect(v, b, norm):
    """Apply the reflector of v, which maps a column onto `norm` times the first unit vector."""
    s = 0.0
    for i in range(v.size):
        s += v[i] * b[i]
    s /= norm * v[0]
    for i in range(v.size):
        b[i] += s * v[i]


@compiled
def _pushes(lower, upper, x, active, weight, R, W, hard, end, p, mu):
    """Write how strongly each acting row would be left outward; inward is negative.

    Of a soft row it is w_i times what it is violated by; of a hard row the multiplier, L^T times
    which is the force of all the others on y[:p]; zero where a hard row adds no column.
    """
    row, miss = R[ROW].view(np.int64), R[MISS]
    at = W.shape[0] - 3
    y, force, size = W[at], W[at + 1], W[at + 2]
    for k in range(p, hard):
        R[PUSH, row[k]] = R[NOISE, row[k]] = 0.0
    for k in range(p - 1, -1, -1):
        force[k] = -mu * mu * y[k]
        size[k] = abs(force[k])
        for i in range(hard, end):
            force[k] += W[i, k] * miss[i]
            size[k] += abs(W[i, k] * miss[i])
        for j in range(k + 1, p):
            force[k] -= W[j, k] * force[j]
            size[k] += abs(W[j, k] * force[j])
        force[k] /= W[k, k]
        R[PUSH, row[k]] = active[row[k]] * force[k]
        R[NOISE, row[k]] = ROUNDING * size[k] / abs(W[k, k])
    length = length_of(x)
    for i in range(hard, end):
        j = row[i]
        R[PUSH, j] = -active[j] * miss[i]
        R[NOISE, j] = ROUNDING * weight[j] * (
            R[SCALE, j] * length + abs(side_of(lower, upper, active, j)))
