"""Lexicographic least squares with two-sided rows: guess the working set, solve it, prove it.

Given which rows act, and at which side, one pass over the levels gives x and the multipliers of
every level. If no other row is violated and no multiplier has the wrong sign, x is optimal, and
that is the proof. Otherwise the violated rows join, those with a wrong sign leave, and the next
guess is solved: the primal-dual active set method (Hintermueller, Ito, Kunisch 2002) on a
hierarchy. It may cycle; `levels.py` always ends, and is called where this does not.

An inequality row of level j that acts has a multiplier in every level k >= j, in
A_k^T w_k + sum_i a_i lambda_i = 0, w_k being what level k misses. The first that is not zero must
push outward (Escande, Mansard, Wieber 2014). Rows that stay violated, and equalities, may have any.

All is done in coordinates z = Q^T x. Unknowns that the first level puts on a bound come first in
the basis, and their columns take no further part.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.level import (
    Part,
    Pull,
    balance,
    pull_of_rows,
    smallest_share,
    solve_part,
)
from solvers.kernels.rows import ZERO, finish
from solvers.kernels.space import View, integers, matrix, vector
from solvers.kernels.tableau import (
    BASE,
    FIRST,
    REMOVED,
    Problem,
    Record,
    Tableau,
    asks_for_x,
    carve_problem,
    carve_tableau,
    factor,
    length_of,
    look_at_rows,
    open_tableau,
    parts_of,
    value_of,
)
from solvers.kernels.tolerances import DOUBTFUL, EPSILON
from solvers.status import EQUAL, FREE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL, UNPROVED

RIGHT, WRONG, UNCLEAR = range(3)  # of a guess
SIZE = 0


class Guess(NamedTuple):
    """One guess, solved.

    rows (m,): the acting rows, level by level, each level in pivot order; what they miss before
    their level is solved, and have too much after (m,). first, rank (L + 1,): where a level begins
    in rows and in the basis. owner (n,): the row of a basis vector, -1 for none. z (n,): x in the
    basis, the goal of the level that asks for x, the reference (n,), its pull.
    """

    rows: View
    rest: View
    w: View
    first: View
    rank: View
    owner: View
    z: View
    x: View
    goal: View
    reference: View
    scratch: View
    pull: Pull


class Solve(NamedTuple):
    """All of it. number (1,): the size of the numbers met."""

    problem: Problem
    T: Tableau
    record: Record
    guess: Guess
    number: View
    tolerance: View
    rank_tolerance: View
    room: View


@inlined
def carve_guess(work, at, m, n, levels, x):
    """Return a Guess at x and where it ends."""
    rows, at = integers(work, at, m)
    of_rows, at = matrix(work, at, 2, m)
    of_levels, at = integers(work, at, 2 * levels + 2)
    owner, at = integers(work, at, n)
    of, at = matrix(work, at, 8, n)
    pull = Pull(of[4], of[5], of[6], of[7])
    return Guess(rows, of_rows[0], of_rows[1], of_levels[:levels + 1], of_levels[levels + 1:],
                 owner, of[0], x, of[1], of[2], of[3], pull), at


@compiled
def solve_by_guesses(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (3 m + 3,) comes in as that of an earlier solve, whose active set is the first guess. It
    goes out as: what each row does; the level that each row holds back (its own if it stays
    violated, L for the reference, -1 for none); its multiplier there; guesses tried; steps by
    levels; the level that was not finished. settings: those of `Hcod`, in one array because each
    argument costs time. work: of any content. Returns SOLVED, NUMERICAL_FAILURE, TOO_SMALL, or
    UNPROVED where `solve_by_levels` must be called.
    """
    m, n = A.shape
    problem, at = carve_problem(A, lower, upper, sizes, work, ZERO)
    guess, at = carve_guess(work, at, m, n, sizes.size, x)
    number, at = vector(work, at, 1)
    if at > work.size:
        return TOO_SMALL
    parts = parts_of(record, m)
    parts.counts[0], parts.counts[1], parts.counts[2] = 0.0, 0.0, -1.0
    general = look_at_rows(problem, parts, x)
    if general < 0:
        return finish(x, NUMERICAL_FAILURE)
    T, at = carve_tableau(work, at, m, n, general)
    room, at = vector(work, at, (m + 1) * (n + 2))
    if at > work.size:
        return TOO_SMALL
    s = Solve(problem, T, parts, guess, number, settings[3], settings[2], room)
    for c in range(n):
        guess.reference[c] = x[c]
    verdict = WRONG
    while verdict == WRONG and parts.counts[0] < settings[4]:
        parts.counts[0] += 1.0
        _remove_bounds(s)
        open_tableau(problem, parts.active, T, True)
        whole = _solve(s)
        verdict = _prove(s, whole)
    if verdict == RIGHT:
        return finish(x, SOLVED)
    for c in range(n):
        x[c] = guess.reference[c]
    return UNPROVED


@inlined
def _side(s, i):
    """The side at which row i acts."""
    return s.problem.upper[i] if s.record.active[i] > 0.0 else s.problem.lower[i]


@inlined
def _around(s, i, side):
    """What a tolerance for row i at a side is taken of; see `tolerances.py`."""
    return s.problem.norm[i] * s.number[SIZE] + abs(side)


@inlined
def _remove_bounds(s):
    """Order the unknowns: those first that the first level with rows puts on a bound, each once.

    None are if other rows of that level act.
    """
    sizes, active, unit, order = s.problem.sizes, s.record.active, s.problem.unit, s.T.order
    seen, n, level = s.guess.scratch, s.T.order.size, 0
    while level < sizes.size - 1 and sizes[level] == 0:
        level += 1
    end = sizes[level] if sizes.size > 0 else ZERO
    for c in range(n):
        seen[c] = 0.0
    removed = ZERO
    for i in range(end):
        if active[i] != FREE:
            if unit[i] < 0 or seen[unit[i]] != 0.0:
                removed = ZERO
                break
            seen[unit[i]] = 1.0
            order[removed], s.guess.owner[removed] = unit[i], i
            s.guess.z[removed] = _side(s, i) / s.problem.entry[i]
            removed += 1
    at = removed
    for c in range(n):
        if removed == 0 or seen[c] == 0.0:
            order[at] = c
            at += 1
    s.T.at[REMOVED] = removed


@inlined
def _solve(s):
    """Solve the acting rows as equalities, write x; return the level that asks for x, or -1."""
    guess, rank, rows, removed = s.guess, ZERO, ZERO, s.T.at[REMOVED]
    levels, n, first, whole = s.problem.sizes.size, s.T.M.shape[0], ZERO, -1
    s.number[SIZE] = 0.0
    for k in range(levels):
        guess.first[k], guess.rank[k] = rows, rank
        last = first + s.problem.sizes[k]
        if rows == 0 and removed > 0 and last > first:  # bounds, which are met
            for t in range(removed):
                guess.rows[t], guess.w[t] = guess.owner[t], 0.0
            rows = rank = removed
        elif whole < 0 and asks_for_x(s.problem, s.record.active, first, last, guess.goal,
                                      guess.scratch):
            guess.rows[rows] = first
            rows += 1
            _take_all(s, guess.goal, rank)
            whole, rank = k, ZERO + n
        else:
            rows = _list(s, first, last, rows, rank)
            rank = _solve_level(s, guess.first[k], rows, rank)
        first = last
    guess.first[levels], guess.rank[levels] = rows, rank
    _take_all(s, guess.reference, rank)
    _write_x(s)
    return whole


@inlined
def _take_all(s, goal, rank):
    """Give all basis vectors that are left what they have of the goal."""
    base, removed, n = s.T.at[BASE], s.T.at[REMOVED], s.T.M.shape[0]
    for t in range(rank, n):
        value = 0.0
        for c in range(removed, n):
            value += s.T.M[t, base + c - removed] * goal[s.T.order[c]]
        s.guess.z[t], s.guess.owner[t] = value, -1


@inlined
def _list(s, first, last, rows, rank):
    """Append the acting rows of a level and what they miss; return the end of the list."""
    guess, M = s.guess, s.T.M
    for i in range(first, last):
        if s.record.active[i] != FREE:
            value, column, entry = _side(s, i), s.T.column[i], s.problem.entry[i]
            for t in range(rank):
                value -= entry * M[t, column] * guess.z[t]
            guess.rows[rows], guess.rest[i] = i, value
            rows += 1
    return rows


@inlined
def _solve_level(s, q0, q1, begin):
    """Give rows q0 .. q1 - 1 basis vectors and solve them there; return the rank of all so far."""
    guess, rest = s.guess, s.room
    rank = factor(s.problem, s.T, guess.rows, q0, q1, begin, ZERO, s.rank_tolerance)
    for q in range(q0, q1):
        i = guess.rows[q]
        rest[q] = guess.rest[i]
        s.T.at[FIRST] += s.record.active[i] == EQUAL and s.problem.unit[i] < 0
    size = solve_part(s.problem, s.T, guess.rows, Part(q0, q1, begin, rank), rest,
                      guess.z[begin:], guess.w, s.room[q1:])
    s.number[SIZE] = max(s.number[SIZE], size)
    for t in range(rank):
        guess.owner[begin + t] = guess.rows[q0 + t]
    return begin + rank


@inlined
def _write_x(s):
    """Write x = Q z."""
    z, x, order, scratch = s.guess.z, s.guess.x, s.T.order, s.guess.scratch
    base, removed, n, size = s.T.at[BASE], s.T.at[REMOVED], s.T.M.shape[0], s.number[SIZE]
    for c in range(n):
        scratch[c] = 0.0
    for t in range(removed, n):
        for c in range(n - removed):
            scratch[c] += z[t] * s.T.M[t, base + c]
    for t in range(n):
        size = max(size, abs(z[t]))
        x[order[t]] = z[t] if t < removed else scratch[t - removed]
    s.number[SIZE] = max(size, length_of(x))


@inlined
def _prove(s, whole):
    """Say whether a guess is right; if not, make the next: violated rows act, rows that pull rest.

    A guess in which a row is hardly independent of others is unclear.
    """
    guess, levels = s.guess, s.problem.sizes.size
    verdict = _add_violated(s)
    if smallest_share(s.problem, s.T, guess.owner, ZERO, guess.rank[levels]) < DOUBTFUL:
        return UNCLEAR
    for k in range(levels + 1):
        above = guess.rank[k]
        at_goal = k in (whole, levels)
        if at_goal:
            goal = guess.goal if k == whole else guess.reference
            weight = s.problem.entry[guess.rows[guess.first[k]]] ** 2 if k == whole else 1.0
            missed = above > 0 and _pull_of_goal(s, goal, weight, above)
        elif guess.first[k + 1] - guess.first[k] == guess.rank[k + 1] - above:
            continue
        else:
            missed, said = _pull_of_level(s, k, above)
            verdict = max(verdict, said)
        if missed:
            verdict = max(verdict, _check_forces(s, k, above, at_goal))
        if verdict != RIGHT:
            break
    return verdict


@inlined
def _add_violated(s):
    """Let the rows that x violates act; say whether there are none."""
    verdict, x = RIGHT, s.guess.x
    for i in range(s.problem.unit.size):
        s.record.held[i], s.record.multiplier[i] = -1.0, 0.0
        if s.record.active[i] == FREE:
            value = value_of(s.problem, x, i)
            low, up = s.problem.lower[i], s.problem.upper[i]
            if value > up + s.tolerance * _around(s, i, up):
                s.record.active[i], verdict = 1.0, WRONG
            elif value < low - s.tolerance * _around(s, i, low):
                s.record.active[i], verdict = -1.0, WRONG
    return verdict


@inlined
def _pull_of_goal(s, goal, weight, above):
    """Write the pull of the way to a goal on the basis vectors above it; False if x is there."""
    guess, order, removed = s.guess, s.T.order, s.T.at[REMOVED]
    n, base, gap, square = order.size, s.T.at[BASE], 0.0, 0.0
    for c in range(n):
        gap += (guess.x[c] - goal[c]) ** 2
        square += goal[c] ** 2
    if np.sqrt(gap) <= s.tolerance * max(s.number[SIZE], np.sqrt(square)):
        return False
    for t in range(above):
        value = goal[order[t]] if t < removed else 0.0
        if t >= removed:
            for c in range(removed, n):
                value += s.T.M[t, base + c - removed] * goal[order[c]]
        guess.pull.g[t] = weight * (guess.z[t] - value)
        guess.pull.terms[t] = weight * (abs(guess.z[t]) + abs(value))
    return True


@inlined
def _pull_of_level(s, k, above):
    """Write the pull of what a level misses; return whether it misses anything, and a verdict.

    Its own rows that are inside their side rest from now on.
    """
    guess, active, verdict, worst = s.guess, s.record.active, RIGHT, 0.0
    for q in range(guess.first[k], guess.first[k + 1]):
        i = guess.rows[q]
        around = _around(s, i, _side(s, i))
        if abs(guess.w[q]) <= EPSILON * around:
            guess.w[q] = 0.0
        else:
            worst = max(worst, abs(guess.w[q]) / around)
    if worst <= s.rank_tolerance:
        return False, UNCLEAR if worst > s.tolerance else RIGHT
    for q in range(guess.first[k], guess.first[k + 1]):
        i = guess.rows[q]
        push = active[i] * guess.w[q]
        if active[i] != EQUAL and push < 0.0:
            active[i], verdict = FREE, WRONG
        elif active[i] != EQUAL and push > s.tolerance * _around(s, i, _side(s, i)):
            s.record.held[i], s.record.multiplier[i] = k, guess.w[q]
    for t in range(above):
        guess.pull.g[t] = guess.pull.terms[t] = 0.0
    part = Part(guess.first[k], guess.first[k + 1], above, ZERO)
    pull_of_rows(s.problem, s.T, guess.rows, part, guess.w, guess.pull, ZERO, above)
    return True, verdict


@inlined
def _check_forces(s, k, above, whole):
    """Give the rows above level k their multipliers in it; those that pull rest from now on."""
    guess, pull, active, held = s.guess, s.guess.pull, s.record.active, s.record.held
    small, verdict = 0.0, RIGHT
    if not whole:
        for q in range(guess.first[k], guess.first[k + 1]):
            small += s.rank_tolerance * abs(guess.w[q]) * s.problem.norm[guess.rows[q]]
    balance(s.problem, s.T, guess.owner, pull, ZERO, above, s.T.at[REMOVED])
    for t in range(above):
        i, force = guess.owner[t], pull.force[t]
        if i < 0 or force == 0.0 or active[i] == EQUAL or active[i] == FREE or held[i] >= 0.0:
            continue
        if pull.share[t] <= small:
            verdict = UNCLEAR
        elif active[i] * force > 0.0:
            held[i], s.record.multiplier[i] = k, force
        else:
            active[i], verdict = FREE, max(verdict, WRONG)
    return verdict
