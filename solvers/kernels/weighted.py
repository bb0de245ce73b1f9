"""Weighted least squares within hard rows: which rows act.

A set of acting rows is right when the rows outside of it hold and every one inside pushes outward.
First sets are guessed: rows join and leave all at once (Hintermueller, Ito, Kunisch 2002); this
mostly ends within a few guesses, and may cycle. Then x goes step by step from one that the hard
rows allow: as far as the next row that begins or ceases to act, each better than the last (primal
active set; Nocedal, Wright 2006, ch. 16.5).

A push is a product of squared weights, and a light one drowns in the rounding of heavy ones. Where
its sign is in doubt the row is let go on trial: it was right if x then moves out, or nowhere that
can be told.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.acting import DOUBT, NOISE, PUSH, SCALE, length_of, side_of, solve_acting
from solvers.kernels.rows import ZERO, finish
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    ITERATION_LIMIT,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
)

UNPROVED = 7  # no value of solvers.Status


@compiled
def weighted_work(m, n):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return (m + n + 5) * n + 7 * m + 3 * n + (m + n) * (n + 1)


@compiled
def weighted(A, lower, upper, sizes, weights, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    weights (L,): of the levels. record (2 m + 1,): begins with zeros, or with what the rows did in
    an earlier solve; goes out as what each row does (FREE, EQUAL, -1, +1), the weight of each row,
    infinite where it is hard, and the factorisations made. settings: regularisation, damping,
    threshold, rank_tolerance, tolerance, hard_levels, guesses, max_iterations, in one array because
    each argument costs time. work: at least weighted_work(m, n), of any content. Returns SOLVED,
    INACCURATE where an acting row is nearly parallel to others, NUMERICAL_FAILURE, TOO_SMALL, or
    UNPROVED, where x is of no use.
    """
    m, n = A.shape
    if work.size < weighted_work(m, n):
        return TOO_SMALL
    active, weight, count = record[:m], record[m:2 * m], record[2 * m:]
    W, R, reference, _, trial, of_block = _carved(m, n, work)
    inequalities = _prepare(A, lower, upper, sizes, weights, x, active, weight, R, settings[5])
    if inequalities < 0:
        return finish(x, NUMERICAL_FAILURE)
    for c in range(n):
        reference[c] = x[c]
    count[0] = 0.0
    while count[0] < settings[6]:
        count[0] += 1.0
        close = solve_acting(A, lower, upper, reference, x, active, weight, R, W, settings,
                             of_block)
        if inequalities == 0:
            return finish(x, SOLVED)
        if not _all_change(A, lower, upper, x, active, weight, R, settings[4]) and _no_doubt(
                A, lower, upper, reference, trial, active, weight, R, W, count, settings, of_block):
            return INACCURATE if close and np.isfinite(length_of(x)) else finish(x, SOLVED)
    return UNPROVED


@compiled
def weighted_steps(A, lower, upper, sizes, weights, given, x, record, settings, work):
    """Like `weighted`, step by step; x comes in as one within the hard rows, `given` (n,) is x_0.

    Returns ITERATION_LIMIT in place of UNPROVED: x is the best that was found.
    """
    m, n = A.shape
    if work.size < weighted_work(m, n):
        return TOO_SMALL
    active, weight, count = record[:m], record[m:2 * m], record[2 * m:]
    W, R, reference, goal, trial, of_block = _carved(m, n, work)
    _prepare(A, lower, upper, sizes, weights, given, active, weight, R, settings[5])
    for c in range(n):
        reference[c] = given[c]
    for i in range(m):
        if active[i] != EQUAL:
            over, under = _beyond(A, lower, upper, x, i)
            active[i] = FREE
            if weight[i] < np.inf and max(over, under) > 0.0:
                active[i] = 1.0 if over > 0.0 else -1.0
    freed = -1
    for _ in range(np.int64(settings[7])):
        count[0] += 1.0
        close = solve_acting(A, lower, upper, reference, goal, active, weight, R, W, settings,
                             of_block)
        row, share = _first_event(A, lower, upper, x, goal, active, weight, R, settings[4])
        for c in range(n):
            x[c] = x[c] + share * (goal[c] - x[c]) if share < 1.0 else goal[c]
        if share < 1.0:
            if row == freed and share == 0.0:
                R[DOUBT, row] = 1.0  # it was freed for what only rounding had it push
            over, under = _beyond(A, lower, upper, goal, row)
            active[row] = FREE if active[row] != FREE else (1.0 if over > under else -1.0)
            freed = -1
            continue
        freed = _pulls_most(active, R)
        if freed >= 0:
            active[freed] = FREE
        elif _no_doubt(A, lower, upper, reference, trial, active, weight, R, W, count, settings,
                       of_block):
            return INACCURATE if close and np.isfinite(length_of(x)) else finish(x, SOLVED)
    return finish(x, SOLVED) if not np.isfinite(length_of(x)) else ITERATION_LIMIT


@inlined
def _carved(m, n, work):
    """Return W and R of `acting.py`, three vectors (n,), and the rest."""
    at = (m + n + 5) * n
    W = work[:at].reshape((m + n + 5, n))
    R, at = work[at:at + 7 * m].reshape((7, m)), at + 7 * m
    return (W, R, work[at:at + n], work[at + n:at + 2 * n], work[at + 2 * n:at + 3 * n],
            work[at + 3 * n:])


@compiled
def _prepare(A, lower, upper, sizes, weights, x, active, weight, R, hard_levels):
    """Check the data and start the record; return the number of inequality rows, -1 if bad."""
    inequalities = first = ZERO
    if not np.isfinite(length_of(x)):
        return -1
    for k in range(sizes.size):
        last, before = first + sizes[k], inequalities
        for i in range(first, last):
            R[SCALE, i], R[DOUBT, i] = length_of(A[i]), 0.0
            low, up = lower[i], upper[i]
            if not np.isfinite(R[SCALE, i]) or not low <= up or low == np.inf or up == -np.inf:
                return -1
            if low == up:
                active[i] = EQUAL
                continue
            inequalities += 1
            known = (active[i] == 1 and up < np.inf) or (active[i] == -1 and low > -np.inf)
            active[i] = active[i] if known else FREE
        hard = hard_levels > 0.0 and inequalities - before == sizes[k]
        if sizes[k] > 0:
            hard_levels = hard_levels - 1.0 if hard else 0.0
        for i in range(first, last):
            weight[i] = np.inf if hard else weights[k]
        first = last
    return inequalities


@inlined
def _beyond(A, lower, upper, x, i):
    """By how much row i is above its upper side, and below its lower."""
    value = 0.0
    for c in range(x.size):
        value += A[i, c] * x[c]
    return value - upper[i], lower[i] - value


@compiled
def _all_change(A, lower, upper, x, active, weight, R, tolerance):
    """Let rows join that are violated, and leave that push inward; say whether any did.

    A hard row that acts and is missed all the same, because others contradict it, is a change too.
    """
    changed, length = False, length_of(x)
    for i in range(active.size):
        if active[i] == EQUAL:
            continue
        over, under = _beyond(A, lower, upper, x, i)
        near = tolerance * (R[SCALE, i] * length + abs(upper[i] if over >= under else lower[i]))
        outside = max(over, under) > near
        if active[i] == FREE:
            if outside:
                active[i] = 1.0 if over >= under else -1.0
                changed = True
        elif R[PUSH, i] < -R[NOISE, i]:
            active[i] = FREE
            changed = True
        elif weight[i] == np.inf:
            changed |= outside
    return changed


@compiled
def _first_event(A, lower, upper, x, goal, active, weight, R, tolerance):
    """Return the row that first begins or ceases to act on the way from x to goal, and where.

    The share of the way is 1 where none does. Hard rows that act stay where they are.
    """
    first, share, length = -1, 1.0, length_of(goal)
    for i in range(active.size):
        if active[i] == EQUAL or (active[i] != FREE and weight[i] == np.inf):
            continue
        over, under = _beyond(A, lower, upper, goal, i)
        up = over >= under if active[i] == FREE else active[i] > 0.0
        new = over if up else under
        near = tolerance * (R[SCALE, i] * length + abs(upper[i] if up else lower[i]))
        if (active[i] == FREE and new > near) or (active[i] != FREE and new < -near):
            over, under = _beyond(A, lower, upper, x, i)
            old = over if up else under
            at = old / (old - new) if old * new < 0.0 else 0.0
            if at < share:
                first, share = i, at
    return first, share


@compiled
def _pulls_most(active, R):
    """Return the acting row that pushes inward most beyond doubt, -1 for none."""
    most, row = 0.0, -1
    for i in range(active.size):
        if abs(active[i]) == 1.0 and R[DOUBT, i] == 0.0 and R[PUSH, i] < -R[NOISE, i]:
            pull = -R[PUSH, i] / R[SCALE, i]
            if pull > most:
                most, row = pull, i
    return row


@compiled
def _no_doubt(A, lower, upper, reference, trial, active, weight, R, W, count, settings, work):
    """Let each row go whose push may be rounding; say whether none of them moves inward.

    One that does is left free.
    """
    m = active.size
    for i in range(m):
        if abs(active[i]) == 1.0 and abs(R[PUSH, i]) <= R[NOISE, i]:
            R[DOUBT, i] = 1.0
    for i in range(m):
        if R[DOUBT, i] == 0.0 or abs(active[i]) != 1.0:
            continue
        count[0] += 1.0
        side, bound, active[i] = active[i], side_of(lower, upper, active, i), FREE
        solve_acting(A, lower, upper, reference, trial, active, weight, R, W, settings, work)
        over, under = _beyond(A, lower, upper, trial, i)
        outside = over if side > 0.0 else under
        if outside < -settings[4] * (R[SCALE, i] * length_of(trial) + abs(bound)):
            return False
        active[i] = side
    return True
