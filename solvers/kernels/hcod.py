"""Lexicographic least squares with two-sided rows: guess the active set, solve it, prove it.

Given a guess of which rows act, and at which side, one staircase factorisation gives the x of that
guess and the multipliers of every level. If no other row is violated and no multiplier has the
wrong sign, x is proved optimal. Otherwise the violated rows join, those with a wrong sign leave,
and so on: the primal-dual active set method (Hintermueller, Ito, Kunisch 2002) on the hierarchy of
Escande, Mansard, Wieber (2014). It mostly ends in two to five steps but may cycle; `stages.py`
always ends, and is called where this does not.

An inequality row of level j that acts on a lower level k has a multiplier in
A_k^T w_k + sum_j A_j^T lambda_j = 0, w_k being what level k misses. Over k = j + 1, ..., its first
nonzero multiplier must push outward. Equalities, and rows that stay violated, may have any.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_block
from solvers.kernels.rows import (
    EQUAL,
    FREE,
    NUMERICAL_FAILURE,
    SOLVED,
    ZERO,
    factor_level,
    finish,
    prepare,
    reflect_rows,
)
from solvers.kernels.staircase import staircase

UNPROVED = 7  # no value of solvers.Status
FEW = 16  # inequality rows up to which a guess from nothing is worth its cost (measured)


@compiled
def hcod(A, lower, upper, sizes, x, record, settings):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (3 m + 3,) comes in as zeros, or as that of an earlier solve whose active set is to be
    guessed. It goes out as: what each row does; the level that each row holds back (its own if it
    stays violated, L for the reference, -1 for none); its multiplier there; guesses tried; steps
    by stages; the level that was not finished. settings: damping, threshold, rank_tolerance,
    tolerance, guesses, max_iterations, in one array because each argument costs time. Returns
    SOLVED, NUMERICAL_FAILURE, or UNPROVED where `solve_by_stages` must be called.
    """
    m = A.shape[0]
    counts = record[3 * m:]
    warm = counts[0] + counts[1] > 0.0
    counts[0] = counts[1] = 0.0
    counts[2] = -1.0
    equalities = 0
    for i in range(m):
        equalities += lower[i] == upper[i]
    if equalities == m:
        for i in range(m):
            record[i], record[m + i], record[2 * m + i] = EQUAL, -1.0, 0.0
        counts[0] = 1.0
        return staircase(A, lower, upper, sizes, x, settings[0], settings[1], settings[2])
    return _guess(A, lower, upper, sizes, x, record, settings, warm)


@compiled
def _guess(A, lower, upper, sizes, x, record, settings, warm):
    m, n = A.shape
    levels = sizes.size
    active, held, multiplier = record[:m], record[m:2 * m], record[2 * m:3 * m]
    counts = record[3 * m:]
    W = np.empty((m + n + 6, n))  # active rows, reflectors of Q, x, and five vectors
    of_rows, of_levels = np.empty((4, m)), np.empty(m + 2 * levels + 2, np.int64)
    scale, zero, miss, w = of_rows[0], of_rows[1], of_rows[2], of_rows[3]
    at = m + n + 1
    beta, y, g, pull, reference = W[at], W[at + 1], W[at + 2], W[at + 3], W[at + 4]
    row, first, rank = of_levels[:m], of_levels[m:m + levels + 1], of_levels[m + levels + 1:]
    damping, threshold, rank_tolerance = settings[0], settings[1], settings[2]
    tolerance, guesses = settings[3], settings[4]
    inequalities = prepare(A, lower, upper, x, active, held, multiplier, scale)
    if inequalities < 0:
        return finish(x, NUMERICAL_FAILURE)
    for c in range(n):
        reference[c] = x[c]
    while counts[0] < guesses and (warm or inequalities <= FEW):
        counts[0] += 1.0
        _solve_guess(A, lower, upper, sizes, reference, x, active, scale, W, row, first, rank, zero,
                     miss, beta, y, pull, damping, threshold, rank_tolerance)
        _residuals(first, rank, W, miss, y, w, damping)
        if _improve(A, lower, upper, reference, x, active, held, multiplier, scale, W, row, first,
                    rank, w, g, pull, damping, tolerance):
            return finish(x, SOLVED)
    return UNPROVED


@inlined
def _solve_guess(A, lower, upper, sizes, reference, x, active, scale, W, row, first, rank, zero,
                 miss, beta, y, pull, damping, threshold, rank_tolerance):
    """Solve the hierarchy of the active rows as equalities: `staircase.py` on a part of the rows.

    first, rank (L + 1,): where the active rows of a level begin in W, and its columns of Q.
    pull (n,): Q^T (x - reference) in the columns of the levels.
    """
    m, n = A.shape
    V, X = m, m + n
    q = r = begin_row = ZERO
    for k in range(sizes.size):
        first[k], rank[k] = q, r
        begin, above, end_row = q, r, begin_row + sizes[k]
        for i in range(begin_row, end_row):
            if active[i] != FREE:
                for c in range(n):
                    W[q, c] = A[i, c]
                row[q], zero[q] = i, (rank_tolerance * scale[i]) ** 2
                miss[q] = upper[i] if active[i] > 0 else lower[i]
                q += 1
        begin_row = end_row
        if q == begin:
            continue
        reflect_rows(W, beta, V, ZERO, above, begin, q)
        r = factor_level(W, row, zero, miss, beta, V, begin, q, r)
        for p in range(begin, q):
            for c in range(above):
                miss[p] -= W[p, c] * y[c]
        solve_block(W, miss, y, begin, q, above, r, damping, threshold)
    first[sizes.size], rank[sizes.size] = q, r
    for c in range(n):
        W[X, c] = reference[c]
    reflect_rows(W, beta, V, ZERO, r, X, X + 1)
    for c in range(r):
        pull[c] = y[c] - W[X, c]
        W[X, c] = y[c]
    for k in range(r - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, X, X + 1)
    for c in range(n):
        x[c] = W[X, c]


@inlined
def _residuals(first, rank, W, miss, y, w, damping):
    """Write into w what each active row has too much.

    Undamped rows that are independent of each other and of the levels above are met: exactly zero.
    """
    for k in range(first.size - 1):
        begin, end, above, below = first[k], first[k + 1], rank[k], rank[k + 1]
        for q in range(begin, end):
            w[q] = 0.0
            if damping > 0.0 or end - begin > below - above:
                w[q] = -miss[q]
                for c in range(above, below):
                    w[q] += W[q, c] * y[c]


@inlined
def _improve(A, lower, upper, reference, x, active, held, multiplier, scale, W, row, first, rank,
             w, g, pull, damping, tolerance):
    """Say whether the guess is right; otherwise let violated rows act, and rows that pull rest."""
    m, n = A.shape
    levels = first.size - 1
    size = square = 0.0
    for c in range(n):
        size += x[c] * x[c]
        square += reference[c] * reference[c]
    size = np.sqrt(size)
    right = True
    for i in range(m):
        if active[i] == FREE:
            value = 0.0
            for c in range(n):
                value += A[i, c] * x[c]
            side = 1 if value > upper[i] else (-1 if value < lower[i] else 0)
            bound = upper[i] if side > 0 else lower[i]
            if side != 0 and side * (value - bound) > tolerance * (scale[i] * size + abs(bound)):
                active[i] = side
                right = False
        held[i], multiplier[i] = -1.0, 0.0
    for k in range(levels + 1):
        if k == levels:
            noise = max(size, np.sqrt(square))
            for c in range(rank[k]):
                g[c] = pull[c]
        elif damping == 0.0 and first[k + 1] - first[k] == rank[k + 1] - rank[k]:
            continue
        else:
            noise = 0.0
            for c in range(rank[k]):
                g[c] = 0.0
            for q in range(first[k], first[k + 1]):
                i = row[q]
                around = scale[i] * size + abs(upper[i] if active[i] > 0 else lower[i])
                noise = max(noise, scale[i] * around)
                if active[i] != EQUAL:
                    if active[i] * w[q] < -tolerance * around:
                        active[i] = FREE
                        right = False
                    elif active[i] * w[q] > tolerance * around:
                        held[i], multiplier[i] = k, w[q]
                for c in range(rank[k]):
                    g[c] += w[q] * W[q, c]
        right &= _signs_kept(row, first, rank, W, g, active, held, multiplier, scale, k,
                             tolerance * noise)
        if not right:
            break
    return right


@inlined
def _signs_kept(row, first, rank, W, g, active, held, multiplier, scale, k, tolerance):
    """Give the rows above level k their multipliers in it; free those that pull, if any."""
    kept = True
    for j in range(k - 1, -1, -1):
        for c in range(rank[j + 1] - 1, rank[j] - 1, -1):
            q = first[j] + c - rank[j]
            i = row[q]
            force = -g[c] / W[q, c]
            for d in range(c):
                g[d] += force * W[q, d]
            if active[i] == EQUAL or held[i] >= 0:
                continue
            push = active[i] * force * scale[i]
            if push > tolerance:
                held[i], multiplier[i] = k, force
            elif push < -tolerance:
                active[i] = FREE
                kept = False
    return kept
