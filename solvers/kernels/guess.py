"""Lexicographic least squares with two-sided rows: guess the working set, solve it, verify it.

Given the active rows and their sides, one pass over the levels gives x and the multipliers of every
level. If no other row is violated and no multiplier has the wrong sign, this proves that x is
optimal. Otherwise violated rows join, rows with a wrong sign leave, and the next guess is solved:
the primal-dual active set method (Hintermueller, Ito, Kunisch 2002) on a hierarchy. It may cycle;
`levels.py` always ends, and takes over if this does not.

An active inequality row of level j has a multiplier in every level k >= j, in
A_k^T w_k + sum_i a_i lambda_i = 0, with w_k the miss of level k. Its first nonzero multiplier must
point outward (Escande, Mansard, Wieber 2014). Rows that stay violated and equalities may have any.

All computations use coordinates z = Q^T x. Unknowns that the first level puts on a bound come first
in the basis, and their columns are then skipped.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled, inlined
from solvers.kernels.level import (
    Part,
    balance,
    is_unclear,
    is_uneven,
    pull_of_rows,
    smallest_share,
    solve_part,
    weigh_rows,
)
from solvers.kernels.multipliers import settle
from solvers.kernels.rows import ZERO, all_equal, finish
from solvers.kernels.tableau import (
    ACTING,
    ACTIVE,
    BASE,
    BEGIN,
    COLUMN,
    DOUBT,
    ENTRY,
    EXTENT,
    FIRST,
    FORCE,
    GOAL,
    GUESSES,
    HOLDS,
    LEVELS,
    LIST,
    MULTIPLIER,
    NORM,
    ORDER,
    OVER,
    OWNER,
    PULL,
    PULLED,
    RANKS,
    REFERENCE,
    REMOVED,
    REST,
    ROUNDING,
    SCALE,
    SHARE,
    SIZE,
    STEP,
    UNIT,
    VALUE,
    WORST,
    Z,
    around,
    asks_for_x,
    factor,
    has_dust,
    has_outgrown,
    keep,
    measure,
    missed_side,
    open_tableau,
    prepare,
    side_of,
    value_of,
)
from solvers.kernels.tolerances import CANCELLED, DOUBTFUL, DRIFT, LIGHT
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    NO_LIMITS,
    SOLVED,
    UNPROVED,
)

RIGHT, WRONG = range(2)  # of a guess
CHANGED = 5  # in `count`: rows that the verdict on a guess activates or releases


@compiled
def solve_by_guesses(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (3 m + 3,) is that of an earlier solve on entry; its active set is the first guess. On
    return: the state of each row; the level that each row holds back (its own if it stays violated,
    L for the reference, -1 for none); its multiplier there; guesses tried; steps by levels; the
    unfinished level. settings: those of `Hcod`, in one array because each argument costs time.
    work: any contents. Returns SOLVED, NUMERICAL_FAILURE, TOO_SMALL, NO_LIMITS if all rows are
    equalities, or UNPROVED if `solve_by_levels` must be called.
    """
    if all_equal(lower, upper):
        return NO_LIMITS
    s, code = prepare(A, lower, upper, sizes, x, record, settings, work)
    if code != SOLVED:
        return code
    verdict, fewer, s.count[DOUBT], s.count[CHANGED] = WRONG, True, 0, A.shape[0]
    while (verdict == WRONG and fewer and s.count[DOUBT] == 0
           and s.scalar[GUESSES] < s.settings.guesses):
        s.scalar[GUESSES] += 1.0
        before, s.count[CHANGED] = s.count[CHANGED], 0
        _remove_bounds(s)
        open_tableau(s, ACTING)
        whole = _solve(s)
        _write_x(s)
        verdict = _prove(s, whole)
        fewer = s.count[CHANGED] <= before  # more changes than before seldom lead anywhere
    keep(s, record)
    if verdict == RIGHT:
        code = settle(s, lower, upper, sizes, record,
                      ZERO + (SOLVED if s.count[DOUBT] == 0 else INACCURATE))
        if code == SOLVED:
            return finish(x, SOLVED)
    for c in range(x.size):
        x[c] = s.number[REFERENCE, c]
    return UNPROVED


@inlined
def _remove_bounds(s):
    """Order the unknowns: first those that the first level with rows puts on a bound, each once.

    There are none of these if other rows of that level are active.
    """
    active, unit, order = s.number[ACTIVE], s.index[UNIT], s.index[ORDER]
    seen, n, end = s.number[STEP], s.x.size, ZERO
    for k in range(s.count[LEVELS]):
        end += s.index[EXTENT, k] if end == 0 else 0
    for c in range(n):
        seen[c] = 0.0
    removed = ZERO
    for i in range(end):
        if active[i] != FREE:
            if unit[i] < 0 or seen[unit[i]] != 0.0:
                removed = ZERO
                break
            seen[unit[i]] = 1.0
            order[removed], s.index[OWNER, removed] = unit[i], i
            s.number[Z, removed] = side_of(s.number, i) / s.number[ENTRY, i]
            removed += 1
    at = removed
    for c in range(n):
        if removed == 0 or seen[c] == 0.0:
            order[at] = c
            at += 1
    s.count[REMOVED] = removed


@inlined
def _solve(s):
    """Solve the active rows as equalities; return the level that sets all of x, or -1."""
    rank, rows, removed = ZERO, ZERO, s.count[REMOVED]
    levels, n, first, whole = s.count[LEVELS], s.x.size, ZERO, -1
    s.scalar[SIZE] = 0.0
    for k in range(levels):
        s.index[BEGIN, k], s.index[RANKS, k] = rows, rank
        last = first + s.index[EXTENT, k]
        if rows == 0 and removed > 0 and last > first:  # bounds, which are met
            for t in range(removed):
                s.index[LIST, t], s.number[OVER, t] = s.index[OWNER, t], 0.0
            rows = rank = removed
        elif whole < 0 and asks_for_x(s, first, last):
            s.index[LIST, rows] = first
            rows += 1
            _take_all(s, s.number[GOAL], rank)
            whole, rank = k, ZERO + n
        else:
            rows = _list(s, first, last, rows, rank)
            rank = _solve_level(s, s.index[BEGIN, k], rows, rank)
        first = last
    s.index[BEGIN, levels], s.index[RANKS, levels] = rows, rank
    _take_all(s, s.number[REFERENCE], rank)
    return whole


@inlined
def _take_all(s, goal, rank):
    """Write the coordinates of the goal in the remaining basis vectors."""
    base, removed, n = s.count[BASE], s.count[REMOVED], s.M.shape[0]
    for t in range(rank, n):
        value = 0.0
        for c in range(removed, n):
            value += s.M[t, base + c - removed] * goal[s.index[ORDER, c]]
        s.number[Z, t], s.index[OWNER, t] = value, -1


@inlined
def _list(s, first, last, rows, rank):
    """Append the active rows of a level and their residuals; return the end of the list."""
    for i in range(first, last):
        if s.number[ACTIVE, i] != FREE:
            value, column, entry = side_of(s.number, i), s.index[COLUMN, i], s.number[ENTRY, i]
            for t in range(rank):
                value -= entry * s.M[t, column] * s.number[Z, t]
            s.index[LIST, rows], s.number[VALUE, i] = i, value
            rows += 1
    return rows


@inlined
def _solve_level(s, q0, q1, begin):
    """Give rows q0 .. q1 - 1 basis vectors and solve them there; return the rank of all so far."""
    rank = factor(s, q0, q1, begin, ZERO)
    for q in range(q0, q1):
        i = s.index[LIST, q]
        s.number[REST, q] = s.number[VALUE, i]
        s.count[FIRST] += s.number[ACTIVE, i] == EQUAL and s.index[UNIT, i] < 0
    size = solve_part(s, Part(q0, q1, begin, rank))
    s.scalar[SIZE] = max(s.scalar[SIZE], size)
    for t in range(rank):
        s.index[OWNER, begin + t] = s.index[LIST, q0 + t]
    return begin + rank


@inlined
def _write_x(s):
    """Write x = Q z."""
    z, x, order, scratch = s.number[Z], s.x, s.index[ORDER], s.number[STEP]
    base, removed, n, size = s.count[BASE], s.count[REMOVED], s.M.shape[0], s.scalar[SIZE]
    for c in range(n):
        scratch[c] = 0.0
    for t in range(removed, n):
        for c in range(n - removed):
            scratch[c] += z[t] * s.M[t, base + c]
    for t in range(n):
        size = max(size, abs(z[t]))
        x[order[t]] = z[t] if t < removed else scratch[t - removed]
    s.scalar[SIZE] = size
    measure(s)


@inlined
def _prove(s, whole):
    """Judge a guess; if it is wrong, make the next: add violated rows, release those that pull.

    A guess in which a row is nearly dependent on others is in doubt.
    """
    levels = s.count[LEVELS]
    verdict = _add_violated(s)
    s.count[DOUBT] |= has_outgrown(s) or has_dust(s)
    s.count[DOUBT] |= smallest_share(s, ZERO, s.index[RANKS, levels]) < DOUBTFUL
    for k in range(levels + 1 if verdict == RIGHT or s.count[DOUBT] == 0 else 0):
        above = s.index[RANKS, k]
        at_goal = k in (whole, levels)
        if at_goal:
            goal = s.number[GOAL if k == whole else REFERENCE]
            weight = s.number[ENTRY, s.index[LIST, s.index[BEGIN, k]]] ** 2 if k == whole else 1.0
            missed = above > 0 and _pull_of_goal(s, goal, weight, above)
        elif s.index[BEGIN, k + 1] - s.index[BEGIN, k] == s.index[RANKS, k + 1] - above:
            continue
        else:
            s.count[DOUBT] |= _is_unclear_level(s, k)
            missed, said = _pull_of_level(s, k, above)
            verdict = max(verdict, said)
        if missed:
            verdict = max(verdict, _check_forces(s, k, above, at_goal))
        if verdict != RIGHT:
            break
    return verdict


@inlined
def _is_unclear_level(s, k):
    """Whether a row of a level is nearly dependent on those above, or moved by levels below."""
    begin, end, rank = s.index[BEGIN, k], s.index[BEGIN, k + 1], s.index[RANKS, k + 1]
    unclear = False
    for q in range(begin + rank - s.index[RANKS, k], end):
        i = s.index[LIST, q]
        side = side_of(s.number, i)
        gone = abs(value_of(s, s.x, i) - side - s.number[OVER, q])
        unclear |= gone > DRIFT * around(s.number[NORM, i], side, s.scalar[SCALE])
        unclear |= is_unclear(s, i, s.index[RANKS, k], rank)
    return unclear


@inlined
def _add_violated(s):
    """Activate the rows that x violates; return whether there are none."""
    verdict, number = RIGHT, s.number
    for i in range(s.A.shape[0]):
        number[HOLDS, i], number[MULTIPLIER, i] = -1.0, 0.0
        if number[ACTIVE, i] == FREE:
            value = value_of(s, s.x, i)
            side = missed_side(number, i, value, s.scalar[SCALE], s.settings.tolerance)
            if side != 0.0:
                number[ACTIVE, i], verdict = side, WRONG
                s.count[CHANGED] += 1
    return verdict


@inlined
def _pull_of_goal(s, goal, weight, above):
    """Write the pull of the step to a goal on the basis vectors above; False if x is there."""
    order, removed = s.index[ORDER], s.count[REMOVED]
    n, base, gap, square = s.x.size, s.count[BASE], 0.0, 0.0
    for c in range(n):
        gap += (s.x[c] - goal[c]) ** 2
        square += goal[c] ** 2
    if np.sqrt(gap) <= s.settings.tolerance * max(s.scalar[SCALE], np.sqrt(square)):
        return False
    s.scalar[ROUNDING] = CANCELLED * weight * max(s.scalar[SIZE], np.sqrt(square))
    for t in range(above):
        value = goal[order[t]] if t < removed else 0.0
        if t >= removed:
            for c in range(removed, n):
                value += s.M[t, base + c - removed] * goal[order[c]]
        s.number[PULL, t] = weight * (s.number[Z, t] - value)
    return True


@inlined
def _pull_of_level(s, k, above):
    """Write the pull of the miss of a level; return whether it has a miss, and a verdict.

    Its own rows that are inside their side are released.
    """
    active, over, verdict = s.number[ACTIVE], s.number[OVER], RIGHT
    part = Part(s.index[BEGIN, k], s.index[BEGIN, k + 1], above, ZERO)
    weigh_rows(s, part)
    worst = s.scalar[WORST]
    if worst < DOUBTFUL:
        s.count[DOUBT] |= worst > s.settings.tolerance
        return False, RIGHT
    s.count[DOUBT] |= is_uneven(s, part, LIGHT)
    for q in range(part.q0, part.q1):
        i = s.index[LIST, q]
        push = active[i] * over[q]
        scale = around(s.number[NORM, i], side_of(s.number, i), s.scalar[SCALE])
        if active[i] != EQUAL and push < 0.0:
            active[i], verdict = FREE, WRONG
            s.count[CHANGED] += 1
        elif active[i] != EQUAL and push > s.settings.tolerance * scale:
            s.number[HOLDS, i], s.number[MULTIPLIER, i] = k, over[q]
    for t in range(above):
        s.number[PULL, t] = 0.0
    pull_of_rows(s, part, ZERO, above)
    return True, verdict


@inlined
def _check_forces(s, k, above, whole):
    """Write the multipliers of the rows above level k in it; release those that pull."""
    active, held = s.number[ACTIVE], s.number[HOLDS]
    verdict, small = RIGHT, 0.0 if whole else s.settings.rank_tolerance * s.scalar[PULLED]
    balance(s, ZERO, above, s.count[REMOVED])
    for t in range(above):
        i, force = s.index[OWNER, t], s.number[FORCE, t]
        if i < 0 or force == 0.0 or active[i] == EQUAL or active[i] == FREE or held[i] >= 0.0:
            continue
        s.count[DOUBT] |= not whole and s.number[SHARE, t] < DOUBTFUL * s.scalar[PULLED]
        if s.number[SHARE, t] <= small:
            s.count[DOUBT] = 1
        elif active[i] * force > 0.0:
            held[i], s.number[MULTIPLIER, i] = k, force
        else:
            active[i], verdict = FREE, max(verdict, WRONG)
            s.count[CHANGED] += 1
    return verdict
