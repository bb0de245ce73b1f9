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
from solvers.kernels.flat import factor_level, reflect_rows
from solvers.kernels.rows import (
    DOUBT,
    EQUAL,
    FREE,
    NEARLY_PARALLEL,
    NUMERICAL_FAILURE,
    ROUNDING,
    SLIGHT,
    SOLVED,
    TOO_SMALL,
    ZERO,
    finish,
    grown,
    prepare,
)
from solvers.kernels.staircase import staircase, staircase_work

UNPROVED = 7  # no value of solvers.Status
FEW = 16  # inequality rows up to which a guess from nothing is worth its cost (measured)


@compiled
def hcod_work(m, n, levels):
    """Return how many numbers of work space a hierarchy needs; `staircase` needs fewer."""
    return (2 * m + 3 * n + 7) * n + 6 * m + 2 * levels + 2


@compiled
def hcod_equalities(A, lower, upper, sizes, x, record, settings, work):
    """Like `hcod`, for equalities alone: the staircase. UNPROVED if there are inequalities."""
    m, n = A.shape
    if work.size < staircase_work(m, n):
        return TOO_SMALL
    for i in range(m):
        if lower[i] != upper[i]:
            return UNPROVED
    for i in range(m):
        record[i], record[m + i], record[2 * m + i] = EQUAL, -1.0, 0.0
    record[3 * m], record[3 * m + 1], record[3 * m + 2] = 1.0, 0.0, -1.0
    return staircase(A, lower, upper, sizes, x, settings[0], settings[1], settings[2],
                     work)


@compiled
def hcod(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (3 m + 3,) comes in as zeros, or as that of an earlier solve whose active set is to be
    guessed. It goes out as: what each row does; the level that each row holds back (its own if it
    stays violated, L for the reference, -1 for none); its multiplier there; guesses tried; steps
    by stages; the level that was not finished. settings: damping, threshold, rank_tolerance,
    tolerance, guesses, max_iterations, in one array because each argument costs time. work: at
    least hcod_work(m, n, levels), of any content. Returns SOLVED, NUMERICAL_FAILURE, TOO_SMALL,
    or UNPROVED where `solve_by_stages` must be called.
    """
    m, n = A.shape
    levels = sizes.size
    if work.size < hcod_work(m, n, levels):
        return TOO_SMALL
    active, held, multiplier = record[:m], record[m:2 * m], record[2 * m:3 * m]
    counts = record[3 * m:]
    warm = counts[0] + counts[1] > 0.0
    counts[0] = counts[1] = 0.0
    counts[2] = -1.0
    # Active rows, reflectors of Q, x, five vectors, and a basis of what a level finds free.
    at = (m + 2 * n + 6) * n
    W = work[:at].reshape((m + 2 * n + 6, n))
    scale, zero, miss = work[at:at + m], work[at + m:at + 2 * m], work[at + 2 * m:at + 3 * m]
    w, at = work[at + 3 * m:at + 4 * m], at + 4 * m
    of_levels = work[at:at + m + 2 * levels + 2].view(np.int64)
    of_block = work[at + m + 2 * levels + 2:]
    at = m + n + 1
    beta, y, g, pull, reference = W[at], W[at + 1], W[at + 2], W[at + 3], W[at + 4]
    row, first, rank = of_levels[:m], of_levels[m:m + levels + 1], of_levels[m + levels + 1:]
    damping, threshold, rank_tolerance = settings[0], settings[1], settings[2]
    tolerance, guesses = settings[3], settings[4]
    inequalities = prepare(A, lower, upper, x, active, held, multiplier, scale)
    if inequalities < 0:
        return finish(x, NUMERICAL_FAILURE)
    if damping > 0.0:  # a damped level's multipliers are those of its own stage
        return UNPROVED
    for c in range(n):
        reference[c] = x[c]
    while counts[0] < guesses and (warm or inequalities <= FEW):
        counts[0] += 1.0
        _solve_guess(A, lower, upper, sizes, reference, x, active, scale, W, row, first, rank, zero,
                     miss, beta, y, pull, damping, threshold, rank_tolerance, of_block)
        if _nearly_parallel(W, row, first, rank, scale):
            return UNPROVED
        _residuals(first, rank, W, miss, y, w, damping)
        if _improve(A, lower, upper, reference, x, active, held, multiplier, scale, W, row, first,
                    rank, w, g, beta, pull, damping, tolerance):
            doubtful = grown(lower, upper, active, scale, x, reference)
            return UNPROVED if doubtful else finish(x, SOLVED)
    return UNPROVED


@inlined
def _solve_guess(A, lower, upper, sizes, reference, x, active, scale, W, row, first, rank, zero,
                 miss, beta, y, pull, damping, threshold, rank_tolerance, of_block):
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
        tall = _is_tall(q - begin, above, n)
        if tall:
            _see_in_basis(A, W, row, miss, beta, V, y, begin, q, above)
        else:
            reflect_rows(W, beta, V, ZERO, above, begin, q)
        r = factor_level(W, row, zero, miss, beta, V, begin, q, r)
        if tall:  # the rows in pivot order are needed whole, for the multipliers
            for p in range(begin, begin + r - above):
                for c in range(n):
                    W[p, c] = A[row[p], c]
            reflect_rows(W, beta, V, ZERO, r, begin, begin + r - above)
        else:
            for p in range(begin, q):
                for c in range(above):
                    miss[p] -= W[p, c] * y[c]
        solve_block(W, miss, y, begin, q, above, r, damping, threshold, of_block)
    first[sizes.size], rank[sizes.size] = q, r
    zero_reference = True
    for c in range(n):
        W[X, c] = reference[c]
        zero_reference &= reference[c] == 0.0
    if not zero_reference:
        reflect_rows(W, beta, V, ZERO, r, X, X + 1)
    for c in range(r):
        pull[c] = y[c] - W[X, c]
        W[X, c] = y[c]
    for k in range(r - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, X, X + 1)
    for c in range(n):
        x[c] = W[X, c]


@inlined
def _nearly_parallel(W, row, first, rank, scale):
    """Whether so little is left of a row behind those before it that x is worth a doubt."""
    nearly = False
    for k in range(first.size - 1):
        for c in range(rank[k], rank[k + 1]):
            q = first[k] + c - rank[k]
            nearly |= abs(W[q, c]) < NEARLY_PARALLEL * scale[row[q]]
    return nearly


@inlined
def _is_tall(rows, above, n):
    """Whether a level has so many rows that a basis of the free directions is cheaper."""
    free = n - above
    by_basis = (free + 1) * (above + rows // 2) + free * (above + free)
    return above > 0 and rows * above > by_basis


@inlined
def _see_in_basis(A, W, row, miss, beta, V, y, begin, end, above):
    """Write a level's rows as seen from above by products with the directions left free.

    The columns of Q from `above` on, and the x of the levels above, are made by reflecting unit
    vectors and y back: fewer reflections than there are rows.
    """
    n = A.shape[1]
    Z, free = V + n + 6, n - above  # V + n + 6: behind the reflectors, x and the five vectors
    for j in range(free + 1):
        for c in range(n):
            W[Z + j, c] = 0.0
        if j < free:
            W[Z + j, above + j] = 1.0
        else:
            for c in range(above):
                W[Z + j, c] = y[c]
    for k in range(above - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, Z, Z + free + 1)
    for p in range(begin, end):
        i = row[p]
        for j in range(free + 1):
            product = 0.0
            for c in range(n):
                product += A[i, c] * W[Z + j, c]
            if j < free:
                W[p, above + j] = product
            else:
                miss[p] -= product


@inlined
def _pull_of_level(A, W, row, w, g, beta, V, begin, end, above):
    """Write Q^T A_k^T w_k into g, in the columns of the levels above."""
    n = A.shape[1]
    if not _is_tall(end - begin, above, n):
        for c in range(above):
            g[c] = 0.0
        for q in range(begin, end):
            for c in range(above):
                g[c] += w[q] * W[q, c]
        return
    Z = V + n + 6
    for c in range(n):
        W[Z, c] = 0.0
    for q in range(begin, end):
        for c in range(n):
            W[Z, c] += w[q] * A[row[q], c]
    reflect_rows(W, beta, V, ZERO, above, Z, Z + 1)
    for c in range(above):
        g[c] = W[Z, c]


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
             w, g, beta, pull, damping, tolerance):
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
            pulled = 0.0
            for c in range(n):
                pulled += (x[c] - reference[c]) ** 2
            pulled = np.sqrt(pulled)
            noise = max(size, np.sqrt(square))
            worst = 1.0 if pulled > tolerance * noise else 0.0
            for c in range(rank[k]):
                g[c] = pull[c]
        elif damping == 0.0 and first[k + 1] - first[k] == rank[k + 1] - rank[k]:
            continue
        else:
            noise = pulled = worst = 0.0
            for q in range(first[k], first[k + 1]):
                i = row[q]
                around = scale[i] * size + abs(upper[i] if active[i] > 0 else lower[i])
                noise = max(noise, scale[i] * around)
                pulled += abs(w[q]) * scale[i]
                if scale[i] > 0.0 and abs(w[q]) > worst * around:
                    worst = abs(w[q]) / around
                if active[i] != EQUAL:
                    if active[i] * w[q] < -ROUNDING * around:
                        active[i] = FREE
                        right = False
                    elif active[i] * w[q] > tolerance * around:
                        held[i], multiplier[i] = k, w[q]
        if tolerance < worst < SLIGHT:  # missed so slightly that it may be attainable
            right = False
        if worst > tolerance:
            if k < levels:
                _pull_of_level(A, W, row, w, g, beta, m, first[k], first[k + 1], rank[k])
            right &= _signs_kept(row, first, rank, W, g, active, held, multiplier, scale, k,
                                 max(tolerance * pulled, ROUNDING * noise), DOUBT * pulled)
        if not right:
            break
    return right


@inlined
def _signs_kept(row, first, rank, W, g, active, held, multiplier, scale, k, sure, doubt):
    """Give the rows above level k their multipliers in it; free those that pull, if any.

    False if any pulls, or if multipliers that matter cannot be told from rounding.
    """
    kept = not sure > doubt > 0.0
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
            if sure < abs(push) < doubt:
                kept = False
            if push > sure:
                held[i], multiplier[i] = k, force
            elif push < -sure:
                active[i] = FREE
                kept = False
    return kept
