"""Weighted least squares within hard rows: the search for the active set.

An active set is optimal if the rows outside it hold and every row in it has an outward multiplier.
First, sets are guessed: rows join and leave all at once (Hintermueller, Ito, Kunisch 2002), which
mostly ends within a few guesses but may cycle. Then x moves step by step from a point within the
hard rows, each time up to the next row that becomes active or inactive, and improves with every
step (primal active set; Nocedal, Wright 2006, ch. 16.5).

A multiplier is a product of squared weights, and that of a light row drowns in the rounding of
heavy ones. If its sign is in doubt the row is released on trial: it belongs in the set if x then
moves outward, or by nothing measurable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.block import level_damping, stacked
from solvers.kernels.least_squares import least_squares
from solvers.kernels.rows import ZERO, factor_level, finish, length_of, reflect, reflect_back
from solvers.kernels.space import (
    Block,
    Rows,
    Settings,
    View,
    assign,
    carve_rows,
    fill,
    matrix,
    shared,
    vector,
)
from solvers.kernels.tolerances import EXACTLY_DEPENDENT, LONGEST, NEARLY_DEPENDENT, TERMS
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    ITERATION_LIMIT,
    LOWER,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
    UNPROVED,
    UPPER,
)

OWN_SETTINGS = 8  # at the start of the array of settings; the weights of the levels follow


class Space(NamedTuple):
    """The problem, the settings of `Weighted`, and intermediate results.

    A (m, n), lower, upper (m,), reference (n,).

    Of each row (m,): state: FREE, EQUAL, UPPER or LOWER. weight: infinite for a hard row. norm.
    push: its multiplier, outward positive. noise: the rounding in it. doubt: 1 if it was released
    on trial. count (1,): the number of factorisations.

    rows: the factored active rows, hard rows first. of_x (1, n), y (n,): the step, and the step in
    coordinates of Q. force, size, goal, trial (n,). of_block: work space.
    """

    A: View
    lower: View
    upper: View
    reference: View
    shared: Settings
    regularisation: View
    tolerance: View
    hard_levels: View
    guesses: View
    max_iterations: View
    weights: View
    state: View
    weight: View
    count: View
    norm: View
    push: View
    noise: View
    doubt: View
    rows: Rows
    basis: View
    of_x: View
    y: View
    force: View
    size: View
    goal: View
    trial: View
    of_block: View


@inlined
def _carve(A, lower, upper, record, settings, work):
    """Return Space, and where it ends in the work space."""
    m, n = A.shape
    norm, at = vector(work, 0, m)
    push, at = vector(work, at, m)
    noise, at = vector(work, at, m)
    doubt, at = vector(work, at, m)
    rows, at = carve_rows(work, at, m, n)
    basis, at = matrix(work, at, n, n)
    of_x, at = matrix(work, at, 1, n)
    y, at = vector(work, at, n)
    force, at = vector(work, at, n)
    size, at = vector(work, at, n)
    goal, at = vector(work, at, n)
    trial, at = vector(work, at, n)
    reference, at = vector(work, at, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Space(A, lower, upper, reference, shared(settings), settings[3], settings[4],
                 settings[5], settings[6], settings[7], settings[OWN_SETTINGS:], record[:m],
                 record[m:2 * m], record[2 * m:], norm, push, noise, doubt, rows, basis, of_x, y,
                 force, size, goal, trial, of_block), at


@compiled
def weighted(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (2 m + 1,): on entry zeros, or the row states of an earlier solve first; on return the
    state of each row (FREE, EQUAL, UPPER, LOWER), its weight, infinite for a hard row, and the
    number of factorisations. settings: those of `Space`, the weights last. work: any contents.
    Returns SOLVED, INACCURATE if an active row is nearly parallel to others, NUMERICAL_FAILURE,
    TOO_SMALL, or UNPROVED, when x has no meaning.
    """
    s, end = _carve(A, lower, upper, record, settings, work)
    if end > work.size:
        return TOO_SMALL
    inequalities = _prepare(s, sizes, x)
    if inequalities < 0:
        return finish(x, NUMERICAL_FAILURE)
    s.count[0] = 0.0
    while s.count[0] < s.guesses:
        close = _solve(s, x)
        if inequalities == 0:
            return _found(x, False)
        if not _all_change(s, x) and _no_doubt(s):
            return _found(x, close)
    return UNPROVED


@inlined
def _found(x, close):
    """Return the code of an answer: no number is left of sides beside one that is this long."""
    if not length_of(x) < LONGEST:
        return finish(x, NUMERICAL_FAILURE)
    return ZERO + (INACCURATE if close else SOLVED)


@compiled
def weighted_steps(A, lower, upper, sizes, x, record, settings, work):
    """Like `weighted`, step by step.

    x (2, n): a point within the hard rows, which is the answer on return, and the reference.
    Returns ITERATION_LIMIT in place of UNPROVED: x is then the best point found.
    """
    s, end = _carve(A, lower, upper, record, settings, work)
    if end > work.size:
        return TOO_SMALL
    x, reference = x[0], x[1]
    _prepare(s, sizes, reference)
    _begin_at(s, x)
    freed = -1
    for _ in range(np.int64(s.max_iterations)):
        close = _solve(s, s.goal)
        row, share = _first_event(s, x)
        for c in range(x.size):
            x[c] = x[c] + share * (s.goal[c] - x[c]) if share < 1.0 else s.goal[c]
        if share < 1.0:
            if row == freed and share == 0.0:
                s.doubt[row] = 1.0  # only the rounding of its multiplier released it
            over, under = _beyond(s, s.goal, row)
            s.state[row] = FREE if s.state[row] != FREE else (UPPER if over > under else LOWER)
            freed = -1
            continue
        freed = _pulls_most(s)
        if freed >= 0:
            s.state[freed] = FREE
        elif _no_doubt(s):
            return _found(x, close)
    return finish(x, SOLVED) if not np.isfinite(length_of(x)) else ITERATION_LIMIT


@compiled
def _prepare(s, sizes, x):
    """Check the data and start the record; return the number of inequality rows, -1 if bad."""
    A, lower, upper, reference = s.A, s.lower, s.upper, s.reference
    hard_levels, inequalities, first = s.hard_levels, ZERO, ZERO
    assign(reference, x)
    if not np.isfinite(length_of(x)):
        return -1
    for k in range(sizes.size):
        last, before = first + sizes[k], inequalities
        for i in range(first, last):
            s.norm[i], s.doubt[i] = length_of(A[i]), 0.0
            low, up, guess = lower[i], upper[i], s.state[i]
            if not np.isfinite(s.norm[i]) or not low <= up or low == np.inf or up == -np.inf:
                return -1
            if low == up:
                s.state[i] = EQUAL
                continue
            inequalities += 1
            known = (guess == UPPER and up < np.inf) or (guess == LOWER and low > -np.inf)
            s.state[i] = guess if known else FREE
        hard = hard_levels > 0.0 and inequalities - before == sizes[k]
        if sizes[k] > 0:
            hard_levels = hard_levels - 1.0 if hard else 0.0
        fill(s.weight[first:last], np.inf if hard else s.weights[k])
        first = last
    return inequalities


@inlined
def _begin_at(s, x):
    """Activate the soft rows that are violated at x, and no hard row."""
    for i in range(s.state.size):
        if s.state[i] != EQUAL:
            over, under = _beyond(s, x, i)
            s.state[i] = FREE
            if s.weight[i] < np.inf and max(over, under) > 0.0:
                s.state[i] = UPPER if over > 0.0 else LOWER


@inlined
def _beyond(s, x, i):
    """Return the amounts by which row i is above its upper side and below its lower side."""
    value = inner_product(s.A[i], x)
    return value - s.upper[i], s.lower[i] - value


@compiled
def _all_change(s, x):
    """Add violated rows, release rows with an inward multiplier; return whether any changed.

    An active hard row that is missed because others contradict it counts as a change too.
    """
    changed, length = False, length_of(x)
    for i in range(s.state.size):
        if s.state[i] == EQUAL:
            continue
        over, under = _beyond(s, x, i)
        side = s.upper[i] if over >= under else s.lower[i]
        near = s.tolerance * (s.norm[i] * length + abs(side))
        outside = max(over, under) > near
        if s.state[i] == FREE:
            if outside:
                s.state[i] = UPPER if over >= under else LOWER
                changed = True
        elif s.push[i] < -s.noise[i]:
            s.state[i] = FREE
            changed = True
        elif s.weight[i] == np.inf:
            changed |= outside
    return changed


@compiled
def _first_event(s, x):
    """Return the row that first becomes active or inactive on the step from x to goal, and where.

    The share of the step is 1 if there is none. Active hard rows stay active.
    """
    first, share, length = -1, 1.0, length_of(s.goal)
    for i in range(s.state.size):
        state = s.state[i]
        if state == EQUAL or (state != FREE and s.weight[i] == np.inf):
            continue
        over, under = _beyond(s, s.goal, i)
        up = over >= under if state == FREE else state > 0.0
        new, side = over if up else under, s.upper[i] if up else s.lower[i]
        near = s.tolerance * (s.norm[i] * length + abs(side))
        if (state == FREE and new > near) or (state != FREE and new < -near):
            over, under = _beyond(s, x, i)
            old = over if up else under
            at = old / (old - new) if old * new < 0.0 and abs(old) > near else 0.0
            if at < share:
                first, share = i, at
    return first, share


@compiled
def _pulls_most(s):
    """Return the active row with the largest multiplier that is surely inward, -1 for none."""
    most, row = 0.0, -1
    for i in range(s.state.size):
        certain = s.doubt[i] == 0.0 and s.push[i] < -s.noise[i]
        if abs(s.state[i]) == 1.0 and certain:
            pull = -s.push[i] / s.norm[i]
            if pull > most:
                most, row = pull, i
    return row


@compiled
def _no_doubt(s):
    """Release each row whose multiplier may be rounding; return whether none then moves inward.

    A row that does remains free.
    """
    trial = s.trial
    for i in range(s.state.size):
        if abs(s.state[i]) == 1.0 and abs(s.push[i]) <= s.noise[i]:
            s.doubt[i] = 1.0
    for i in range(s.state.size):
        if s.doubt[i] == 0.0 or abs(s.state[i]) != 1.0:
            continue
        side, bound = s.state[i], _side_of(s, i)
        s.state[i] = FREE
        _solve(s, trial)
        over, under = _beyond(s, trial, i)
        outside = over if side > 0.0 else under
        around = s.norm[i] * length_of(trial) + abs(bound)
        if outside < -s.tolerance * around:
            return False
        s.state[i] = side
    return True


@compiled
def _solve(s, x):
    """Write x and the multipliers of active rows; return whether some are nearly parallel.

    Minimises sum_i (w_i e_i)^2 + mu^2 ||x - x_0||^2, e_i the miss of soft row i, on the hard rows.
    In x = x_0 + Q y, Q comes from an LQ factorisation of the hard rows, then the weighted soft
    rows, in pivot order; the hard rows give the first entries of y by substitution, a QR of the
    soft rows and mu I the others. Reflections of columns keep the error of each row in proportion
    to that row, and the pivot order makes the QR do the same (Powell, Reid 1969; Barlow, Handy
    1988; Cox, Higham 1998), so weights may differ by any ratio. Normal equations would square them.
    """
    rows, basis, of_x, y = s.rows, s.basis, s.of_x, s.y
    s.count[0] += 1.0
    hard = _gather(s, ZERO, True)
    end = _gather(s, hard, False)
    p = factor_level(rows, basis, ZERO, hard, ZERO)
    reflect(basis, ZERO, p, rows.W, hard, end)
    for k in range(p):
        y[k] = (rows.miss[k] - inner_product(y[:k], rows.W[k])) / rows.W[k, k]
    rank = factor_level(rows, basis, hard, end, p)
    close = _clean(s, hard, end, p, rank)
    for i in range(hard, end):
        rows.miss[i] -= inner_product(y[:p], rows.W[i])
    at = Block(hard, end, p, rank)
    _least_squares(s, at)
    for c in range(x.size):
        of_x[0, c] = y[c] if c < rank else 0.0
    reflect_back(basis, rank, of_x, ZERO, ZERO + 1)
    for c in range(x.size):
        x[c] = s.reference[c] + of_x[0, c]
    _push_of_hard(s, at)
    _push_of_soft(s, x, at)
    return close


@inlined
def _side_of(s, i):
    """Return the side at which a row is active."""
    return s.lower[i] if s.state[i] == LOWER else s.upper[i]


@compiled
def _gather(s, at, hard):
    """Write the active hard, or soft, rows into W from row `at` on; return where they end."""
    A, reference, rows = s.A, s.reference, s.rows
    for i in range(s.state.size):
        if s.state[i] == FREE or (s.weight[i] == np.inf) != hard:
            continue
        w, miss = 1.0 if hard else s.weight[i], _side_of(s, i)
        for c in range(reference.size):
            rows.W[at, c] = w * A[i, c]
            miss -= A[i, c] * reference[c]
        rows.row[at], rows.miss[at] = i, w * miss
        rows.zero[at] = (s.shared.rank_tolerance * w * s.norm[i]) ** 2
        at += 1
    return at


@inlined
def _clean(s, hard, end, p, rank):
    """Set entries that are rounding to zero; return whether a row is nearly parallel to others."""
    close, rows = False, s.rows
    for i in range(end):
        j = rows.row[i]
        norm = s.norm[j] * (1.0 if i < hard else s.weight[j])
        own = i if i < hard else p + i - hard
        left = _drop_rounding(rows.W[i], own, rows.zero[i], p if i < hard else rank)
        close |= EXACTLY_DEPENDENT * norm < left < NEARLY_DEPENDENT * norm
    return close


@inlined
def _drop_rounding(w, own, zero, rank):
    """Set the negligible entries at the end of a row to zero: a large weight would amplify them.

    own: its column, if it has one. Returns the remainder of the row there, or when it got none.
    """
    square = 0.0
    for c in range(rank, w.size):
        square += w[c] * w[c]
    for c in range(rank - 1, -1, -1):
        more = square + w[c] * w[c]
        if more > zero:
            return abs(w[c]) if c == own else np.sqrt(square)
        square = more
        w[c] = 0.0
    return np.sqrt(square)


@inlined
def _least_squares(s, at):
    """Write into y the minimiser of ||W y - miss||^2 + mu^2 ||y||^2, over the block `at`.

    mu is combined with lambda if the soft rows are damped as one level. miss is the remaining
    residual on return. It comes from the reflections, so that the small residual of a heavy row is
    as accurate as the rest.
    """
    (W, _, _, miss), rows, q = s.rows, at.i1 - at.i0, at.k1 - at.k0
    mu = s.regularisation
    if s.shared.damping > 0.0 and q > 0:
        mu = np.sqrt(mu ** 2 + level_damping(W, at, s.shared, s.of_block) ** 2)
    T, _ = stacked(W, miss, at, mu, rows + q, s.of_block)
    least_squares(T[:q], T[q], s.y[at.k0:])
    for i in range(rows):
        miss[at.i0 + i] = T[q, i]


@compiled
def _push_of_hard(s, at):
    """Write the multipliers of the hard rows; zero for a row that adds no column.

    L^T times them is the force of all other rows on y[:p].
    """
    (W, row, _, miss), y, force, size = s.rows, s.y, s.force, s.size
    hard, p, mu = at.i0, at.k0, s.regularisation
    for k in range(p, hard):
        s.push[row[k]] = s.noise[row[k]] = 0.0
    for k in range(p - 1, -1, -1):
        force[k] = -mu * mu * y[k]
        size[k] = abs(force[k])
        for i in range(hard, at.i1):
            force[k] += W[i, k] * miss[i]
            size[k] += abs(W[i, k] * miss[i])
        for j in range(k + 1, p):
            force[k] -= W[j, k] * force[j]
            size[k] += abs(W[j, k] * force[j])
        force[k] /= W[k, k]
        s.push[row[k]] = s.state[row[k]] * force[k]
        s.noise[row[k]] = TERMS * size[k] / abs(W[k, k])


@compiled
def _push_of_soft(s, x, at):
    """Write w_i times the violation of each soft row; inward is negative."""
    length, rows = length_of(x), s.rows
    for i in range(at.i0, at.i1):
        j = rows.row[i]
        around = s.norm[j] * length + abs(_side_of(s, j))
        s.push[j] = -s.state[j] * rows.miss[i]
        s.noise[j] = TERMS * s.weight[j] * around
