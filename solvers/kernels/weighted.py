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

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.acting import (
    Acting,
    Factors,
    Problem,
    carve_acting,
    carve_factors,
    side_of,
    solve_acting,
)
from solvers.kernels.rows import ZERO, finish, length_of
from solvers.kernels.space import Settings, View, shared, vector
from solvers.kernels.tolerances import LONGEST
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


class Options(NamedTuple):
    """The settings that all resolvers share, and those of `Weighted`."""

    shared: Settings
    regularisation: View
    tolerance: View
    hard_levels: View
    guesses: View
    max_iterations: View
    weights: View


class Space(NamedTuple):
    """Intermediate results; count (1,) is the number of factorisations, goal and trial (n,)."""

    problem: Problem
    acting: Acting
    factors: Factors
    options: Options
    goal: View
    trial: View
    count: View


@inlined
def _carve(A, lower, upper, record, settings, work):
    """Return Space, and where it ends in the work space."""
    m, n = A.shape
    options = Options(shared(settings), settings[3], settings[4], settings[5], settings[6],
                      settings[7], settings[OWN_SETTINGS:])
    acting, at = carve_acting(record, work, 0, m)
    factors, at = carve_factors(work, at, m, n)
    reference, at = vector(work, at, n)
    goal, at = vector(work, at, n)
    trial, at = vector(work, at, n)
    problem = Problem(A, lower, upper, reference)
    return Space(problem, acting, factors, options, goal, trial, record[2 * m:]), at


@compiled
def weighted(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (2 m + 1,): on entry zeros, or the row states of an earlier solve first; on return the
    state of each row (FREE, EQUAL, UPPER, LOWER), its weight, infinite for a hard row, and the
    number of factorisations. settings: those of `Options`, the weights last. work: any contents.
    Returns SOLVED, INACCURATE if an active row is nearly parallel to others, NUMERICAL_FAILURE,
    TOO_SMALL, or UNPROVED, when x has no meaning.
    """
    space, end = _carve(A, lower, upper, record, settings, work)
    if end > work.size:
        return TOO_SMALL
    inequalities = _prepare(space, sizes, x)
    if inequalities < 0:
        return finish(x, NUMERICAL_FAILURE)
    space.count[0] = 0.0
    while space.count[0] < space.options.guesses:
        close = _solve(space, x)
        if inequalities == 0:
            return _found(x, False)
        if not _all_change(space, x) and _no_doubt(space):
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
    space, end = _carve(A, lower, upper, record, settings, work)
    if end > work.size:
        return TOO_SMALL
    x, reference = x[0], x[1]
    _prepare(space, sizes, reference)
    _begin_at(space, x)
    freed = -1
    for _ in range(np.int64(space.options.max_iterations)):
        close = _solve(space, space.goal)
        row, share = _first_event(space, x)
        for c in range(x.size):
            x[c] = x[c] + share * (space.goal[c] - x[c]) if share < 1.0 else space.goal[c]
        if share < 1.0:
            if row == freed and share == 0.0:
                space.acting.doubt[row] = 1.0  # only the rounding of its multiplier released it
            _turn(space, row)
            freed = -1
            continue
        freed = _pulls_most(space.acting)
        if freed >= 0:
            space.acting.state[freed] = FREE
        elif _no_doubt(space):
            return _found(x, close)
    return finish(x, SOLVED) if not np.isfinite(length_of(x)) else ITERATION_LIMIT


@compiled
def _solve(space, x):
    """Write x and the multipliers of active rows; return whether some are nearly parallel."""
    space.count[0] += 1.0
    return solve_acting(space.problem, x, space.acting, space.factors, space.options.shared,
                        space.options.regularisation)


@compiled
def _prepare(space, sizes, x):
    """Check the data and start the record; return the number of inequality rows, -1 if bad."""
    (A, lower, upper, reference), acting = space.problem, space.acting
    hard_levels, inequalities, first = space.options.hard_levels, ZERO, ZERO
    for c in range(x.size):
        reference[c] = x[c]
    if not np.isfinite(length_of(x)):
        return -1
    for k in range(sizes.size):
        last, before = first + sizes[k], inequalities
        for i in range(first, last):
            acting.norm[i], acting.doubt[i] = length_of(A[i]), 0.0
            low, up, guess = lower[i], upper[i], acting.state[i]
            if not np.isfinite(acting.norm[i]) or not low <= up or low == np.inf or up == -np.inf:
                return -1
            if low == up:
                acting.state[i] = EQUAL
                continue
            inequalities += 1
            known = (guess == UPPER and up < np.inf) or (guess == LOWER and low > -np.inf)
            acting.state[i] = guess if known else FREE
        hard = hard_levels > 0.0 and inequalities - before == sizes[k]
        if sizes[k] > 0:
            hard_levels = hard_levels - 1.0 if hard else 0.0
        for i in range(first, last):
            acting.weight[i] = np.inf if hard else space.options.weights[k]
        first = last
    return inequalities


@inlined
def _begin_at(space, x):
    """Activate the soft rows that are violated at x, and no hard row."""
    acting = space.acting
    for i in range(acting.state.size):
        if acting.state[i] != EQUAL:
            over, under = _beyond(space.problem, x, i)
            acting.state[i] = FREE
            if acting.weight[i] < np.inf and max(over, under) > 0.0:
                acting.state[i] = UPPER if over > 0.0 else LOWER


@inlined
def _turn(space, row):
    """Toggle a row: activate it at the side that the goal violates, or release it."""
    over, under = _beyond(space.problem, space.goal, row)
    state = space.acting.state
    state[row] = FREE if state[row] != FREE else (UPPER if over > under else LOWER)


@inlined
def _beyond(problem, x, i):
    """Return the amounts by which row i is above its upper side and below its lower side."""
    value = inner_product(problem.A[i], x)
    return value - problem.upper[i], problem.lower[i] - value


@compiled
def _all_change(space, x):
    """Add violated rows, release rows with an inward multiplier; return whether any changed.

    An active hard row that is missed because others contradict it counts as a change too.
    """
    problem, acting = space.problem, space.acting
    changed, length = False, length_of(x)
    for i in range(acting.state.size):
        if acting.state[i] == EQUAL:
            continue
        over, under = _beyond(problem, x, i)
        side = problem.upper[i] if over >= under else problem.lower[i]
        near = space.options.tolerance * (acting.norm[i] * length + abs(side))
        outside = max(over, under) > near
        if acting.state[i] == FREE:
            if outside:
                acting.state[i] = UPPER if over >= under else LOWER
                changed = True
        elif acting.push[i] < -acting.noise[i]:
            acting.state[i] = FREE
            changed = True
        elif acting.weight[i] == np.inf:
            changed |= outside
    return changed


@compiled
def _first_event(space, x):
    """Return the row that first becomes active or inactive on the step from x to goal, and where.

    The share of the step is 1 if there is none. Active hard rows stay active.
    """
    problem, acting = space.problem, space.acting
    first, share, length = -1, 1.0, length_of(space.goal)
    for i in range(acting.state.size):
        state = acting.state[i]
        if state == EQUAL or (state != FREE and acting.weight[i] == np.inf):
            continue
        over, under = _beyond(problem, space.goal, i)
        up = over >= under if state == FREE else state > 0.0
        new, side = over if up else under, problem.upper[i] if up else problem.lower[i]
        near = space.options.tolerance * (acting.norm[i] * length + abs(side))
        if (state == FREE and new > near) or (state != FREE and new < -near):
            over, under = _beyond(problem, x, i)
            old = over if up else under
            at = old / (old - new) if old * new < 0.0 and abs(old) > near else 0.0
            if at < share:
                first, share = i, at
    return first, share


@compiled
def _pulls_most(acting):
    """Return the active row with the largest multiplier that is surely inward, -1 for none."""
    most, row = 0.0, -1
    for i in range(acting.state.size):
        certain = acting.doubt[i] == 0.0 and acting.push[i] < -acting.noise[i]
        if abs(acting.state[i]) == 1.0 and certain:
            pull = -acting.push[i] / acting.norm[i]
            if pull > most:
                most, row = pull, i
    return row


@compiled
def _no_doubt(space):
    """Release each row whose multiplier may be rounding; return whether none then moves inward.

    A row that does remains free.
    """
    problem, acting, trial = space.problem, space.acting, space.trial
    for i in range(acting.state.size):
        if abs(acting.state[i]) == 1.0 and abs(acting.push[i]) <= acting.noise[i]:
            acting.doubt[i] = 1.0
    for i in range(acting.state.size):
        if acting.doubt[i] == 0.0 or abs(acting.state[i]) != 1.0:
            continue
        side, bound = acting.state[i], side_of(problem, acting, i)
        acting.state[i] = FREE
        _solve(space, trial)
        over, under = _beyond(problem, trial, i)
        outside = over if side > 0.0 else under
        around = acting.norm[i] * length_of(trial) + abs(bound)
        if outside < -space.options.tolerance * around:
            return False
        acting.state[i] = side
    return True
