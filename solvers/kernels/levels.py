"""Lexicographic least squares with two-sided rows, level after level, by a primal active set.

Each level is one convex problem. Its own rows are soft: their violation is minimised. The
inequality rows of the levels above are hard: x satisfies them and moves only as far as the next one
allows, which is then held at its side. Where a level can do no more, a held row with a multiplier
of the wrong sign is released; with none, the level is solved. The rows that hold it back are
equalities for good, the others stay inequalities. The last level brings x to the reference. A
multiplier belongs to one level, so no sign is lexicographic.

A step lowers what the level misses, so no working set comes back after one. Where steps of length
zero follow each other, all sides are moved outward by amounts that differ, so that no two tie, and
put back in the end; after that, the row of least index enters and leaves, which cannot cycle
(Bland 1977; Chang, Cottle 1980).

The basis vectors of the tableau belong, in this order, to rows `fixed` for good, to `hard` rows
held at their side, to the `soft` rows of the level, and to nothing.
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
    damping_of,
    least_squares_part,
    nearly_parallel,
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
    fold,
    left_of,
    length_of,
    look_at_rows,
    open_tableau,
    parts_of,
    reflect,
    value_of,
)
from solvers.kernels.tolerances import (
    BLAND_AFTER,
    DOUBTFUL,
    EPSILON,
    NO_STEP,
    PATIENCE,
    RELAXATION,
    RELAXATIONS,
    STALLED,
    WEAK,
)
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    ITERATION_LIMIT,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
)

# State of a row, 0 while its level is still to come. PARALLEL: the held rows keep it in place.
WATCHED, HELD, SOFT, FIXED, PARALLEL = range(1, 6)
# Entries of `count`: basis vectors of the fixed, hard and soft rows, soft rows, equalities of the
# level that have columns; steps of no length, steps at a level's optimum, sides moved apart, times
# that was done; whether the level is missed, whether an answer is doubtful.
FIX, HARD, RANK, ROWS, EQUALITIES, STILL, TRIES, APART, TIMES, MISSED, DOUBT = range(11)
SIZE, DAMPED, WEIGHT = range(3)  # entries of `number`
GOLDEN = 0.6180339887498949


class Exact(NamedTuple):
    """The settings of `Hcod`, in the order of its array."""

    damping: View
    threshold: View
    rank_tolerance: View
    tolerance: View
    guesses: View
    max_iterations: View


class Working(NamedTuple):
    """The working set: state (m,) of each row, owner (n,) of each basis vector that is held, soft
    (m,) rows in pivot order, low and up (m,) the sides as they are now, counts and numbers.
    """

    state: View
    owner: View
    soft: View
    low: View
    up: View
    count: View
    number: View


class Point(NamedTuple):
    """Where the solve is: x, the x that the level began with and its goal, the step p in x and y in
    basis vectors (n,); value of each row, how fast it changes, what it has too much, what it misses
    (m,); the level's pull.
    """

    x: View
    start: View
    goal: View
    p: View
    y: View
    value: View
    along: View
    w: View
    rest: View
    pull: Pull


class Solve(NamedTuple):
    """All of it."""

    problem: Problem
    T: Tableau
    record: Record
    working: Working
    point: Point
    settings: Exact
    room: View


@inlined
def carve_working(work, at, m, n):
    """Return a Working and where it ends."""
    state, at = integers(work, at, m)
    owner, at = integers(work, at, n)
    soft, at = integers(work, at, m)
    sides, at = matrix(work, at, 2, m)
    count, at = integers(work, at, 11)
    number, at = vector(work, at, 3)
    return Working(state, owner, soft, sides[0], sides[1], count, number), at


@inlined
def carve_pull(work, at, n):
    """Return a Pull and where it ends."""
    of, at = matrix(work, at, 4, n)
    return Pull(of[0], of[1], of[2], of[3]), at


@inlined
def carve_point(work, at, m, n, x):
    """Return a Point at x and where it ends."""
    of, at = matrix(work, at, 4, n)
    of_rows, at = matrix(work, at, 4, m)
    pull, at = carve_pull(work, at, n)
    return Point(x, of[0], of[1], of[2], of[3], of_rows[0], of_rows[1], of_rows[2], of_rows[3],
                 pull), at


@inlined
def end_of_levels(A, lower, upper, sizes, x, work):
    """Return where the work space of `solve_by_levels` ends, at most."""
    m, n = A.shape
    _, at = carve_problem(A, lower, upper, sizes, work, ZERO)
    _, at = carve_working(work, at, m, n)
    _, at = carve_point(work, at, m, n, x)
    _, at = carve_tableau(work, at, m, n, m)
    return at + n + _room(m, n)


@inlined
def _room(m, n):
    """Numbers that a least squares problem and its damping need."""
    return (m + n) * (2 * n + 2)


@compiled
def solve_by_levels(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (3 m + 3,) and settings: as for `solve_by_guesses`; the record is only written. Where the
    iterations end early, x keeps all levels above the unfinished one, which is as good as it got.
    Returns SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, TOO_SMALL, or INACCURATE where a row that
    acts is nearly parallel to others.
    """
    m, n = A.shape
    problem, at = carve_problem(A, lower, upper, sizes, work, ZERO)
    working, at = carve_working(work, at, m, n)
    point, at = carve_point(work, at, m, n, x)
    reference, at = vector(work, at, n)
    if at > work.size:
        return TOO_SMALL
    parts = parts_of(record, m)
    general = look_at_rows(problem, parts, x)
    if general < 0:
        return finish(x, NUMERICAL_FAILURE)
    T, at = carve_tableau(work, at, m, n, general)
    room, at = vector(work, at, _room(m, n))
    if at > work.size:
        return TOO_SMALL
    s = Solve(problem, T, parts, working, point, Exact(settings[0], settings[1], settings[2],
              settings[3], settings[4], settings[5]), room)
    _open(s, reference)
    first = ZERO
    for k in range(sizes.size + 1):
        last = first + sizes[k] if k < sizes.size else first
        whole = _wants_whole(s, k, first, last, reference)
        if _begin(s, k, first, last, whole):
            while parts.counts[1] < s.settings.max_iterations:
                parts.counts[1] += 1.0
                _step(s, whole)
                entering = _advance(s, last)
                leaving = _worst(s, whole) if entering < 0 else -1
                if entering >= 0:
                    _enter(s, entering, first, last)
                elif leaving >= 0:
                    _leave(s, leaving, last)
                elif working.count[APART] == 1:
                    _put_back(s, last)
                else:
                    break
            else:
                parts.counts[2] = k
                code = finish(x, SOLVED)
                return ITERATION_LIMIT if code == SOLVED else code
            _settle(s, k, whole)
        first = last
    code = finish(x, SOLVED)
    doubtful = working.count[DOUBT] == 1 and s.settings.damping == 0.0
    return INACCURATE if doubtful and code == SOLVED else code


@inlined
def _open(s, reference):
    """Begin at x = 0 with no row in the working set."""
    for i in range(s.working.state.size):
        s.working.state[i], s.point.value[i] = 0, 0.0
        s.working.low[i], s.working.up[i] = s.problem.lower[i], s.problem.upper[i]
        if s.record.active[i] != EQUAL:
            s.record.active[i] = FREE
    for c in range(reference.size):
        reference[c], s.point.x[c] = s.point.x[c], 0.0
        s.T.order[c] = c
    for c in range(s.working.count.size):
        s.working.count[c] = 0
    s.working.number[SIZE] = 0.0
    s.T.at[REMOVED] = 0
    open_tableau(s.problem, s.record.active, s.T, False)
    s.record.counts[1], s.record.counts[2] = 0.0, -1.0


@inlined
def _wants_whole(s, k, first, last, reference):
    """Whether a level asks for x as a whole: the reference, or one that is like it."""
    if k < s.problem.sizes.size:
        whole = s.settings.damping == 0.0 and asks_for_x(
            s.problem, s.record.active, first, last, s.point.goal, s.point.p)
        s.working.number[WEIGHT] = s.problem.entry[first] ** 2 if whole else 1.0
        return whole
    for c in range(reference.size):
        s.point.goal[c] = reference[c]
    s.working.number[WEIGHT] = 1.0
    return True


@inlined
def _begin(s, k, first, last, whole):
    """List the rows that a level misses or must meet, and watch the others; False if it is done.

    A row of which nothing is left behind the fixed ones is settled.
    """
    count, number, state, value = s.working.count, s.working.number, s.working.state, s.point.value
    number[SIZE] = max(number[SIZE], length_of(s.point.x))
    number[DAMPED] = 0.0
    for c in (RANK, ROWS, EQUALITIES, STILL, TRIES, TIMES):
        count[c] = 0
    n = s.point.x.size
    least = s.settings.rank_tolerance
    for i in range(first, last):
        value[i] = value_of(s.problem, s.point.x, i)
        if s.record.active[i] != EQUAL:
            s.record.active[i] = _missed_side(s, i, s.settings.tolerance)
        elif s.problem.unit[i] < 0:
            count[EQUALITIES] += 1
        state[i] = WATCHED if s.record.active[i] == FREE else FIXED
        if state[i] == WATCHED or whole:
            continue
        if left_of(s.problem, s.T, i, count[FIX], n) > (least * s.problem.norm[i]) ** 2:
            state[i] = SOFT
            s.working.soft[count[ROWS]] = i
            count[ROWS] += 1
        elif s.record.active[i] != EQUAL:
            s.record.held[i], s.record.multiplier[i] = k, value[i] - _side(s, i)
    for c in range(n):
        s.point.start[c] = s.point.x[c]
    _watch_parallel(s, first)
    if count[ROWS] == 0 and not whole:
        s.T.at[FIRST] += count[EQUALITIES]
    return count[ROWS] > 0 or (whole and count[FIX] < n)


@inlined
def _side(s, i):
    """The side at which row i acts."""
    return s.working.up[i] if s.record.active[i] > 0.0 else s.working.low[i]


@inlined
def _around(s, i, side):
    """What a tolerance for row i at a side is taken of; see `tolerances.py`."""
    return s.problem.norm[i] * s.working.number[SIZE] + abs(side)


@inlined
def _missed_side(s, i, tolerance):
    """+1 where row i is above its upper side, -1 where it is below its lower, 0 within."""
    low, up, value = s.working.low[i], s.working.up[i], s.point.value[i]
    if value > up + tolerance * _around(s, i, up):
        return 1.0
    return -1.0 if value < low - tolerance * _around(s, i, low) else 0.0


@inlined
def _watch_parallel(s, last):
    """Watch the rows again that held rows kept in place, as those are no more the same."""
    for i in range(last):
        if s.working.state[i] == PARALLEL:
            s.working.state[i] = WATCHED
            s.point.value[i] = value_of(s.problem, s.point.x, i)


@inlined
def _step(s, whole):
    """Write the step to the best point that the held rows leave: y in basis vectors, p in x."""
    M, base, p, y = s.T.M, s.T.at[BASE], s.point.p, s.point.y
    n, begin = M.shape[0], s.working.count[FIX] + s.working.count[HARD]
    if whole:
        for c in range(n):
            p[c] = s.point.goal[c] - s.point.x[c]
        for t in range(begin, n):
            total = 0.0
            for c in range(n):
                total += M[t, base + c] * p[c]
            y[t - begin] = total
        rank = n - begin
    else:
        rank = _step_of_rows(s, begin)
    size = s.working.number[SIZE]
    for c in range(n):
        p[c] = 0.0
    for t in range(rank):
        size = max(size, abs(y[t]))
        for c in range(n):
            p[c] += y[t] * M[begin + t, base + c]
    s.working.number[SIZE] = size


@inlined
def _step_of_rows(s, begin):
    """Write the step of the soft rows in their basis vectors; return their rank."""
    count, number, point, soft = s.working.count, s.working.number, s.point, s.working.soft
    rows = count[ROWS]
    rank = factor(s.problem, s.T, soft, ZERO, rows, begin, count[RANK], s.settings.rank_tolerance)
    count[RANK] = rank
    for q in range(rows):
        i = soft[q]
        point.value[i] = value_of(s.problem, point.x, i)
        point.rest[q] = _side(s, i) - point.value[i]
    part = Part(ZERO, rows, begin, rank)
    if s.settings.damping > 0.0 and rank > 0 and not _is_box(s, begin):
        damped = damping_of(s.problem, s.T, soft, part, s.settings, s.room)
        number[DAMPED] = max(number[DAMPED], damped)
    if number[DAMPED] == 0.0:
        size = solve_part(s.problem, s.T, soft, part, point.rest, point.y, point.w, s.room)
    else:
        for t in range(rank):
            point.y[t] = -_gone(s, begin + t)
        size = least_squares_part(s.problem, s.T, soft, part, point.rest, point.y, point.w, s.room,
                                  number[DAMPED])
    number[SIZE] = max(number[SIZE], size)
    return rank


@inlined
def _is_box(s, begin):
    """Whether nothing but bounds act so far, which are not damped."""
    box = begin == 0
    for q in range(s.working.count[ROWS]):
        box &= s.problem.unit[s.working.soft[q]] >= 0
    return box


@inlined
def _gone(s, t):
    """How far x has gone along basis vector t since the level began."""
    total = 0.0
    for c in range(s.point.x.size):
        total += s.T.M[t, s.T.at[BASE] + c] * (s.point.x[c] - s.point.start[c])
    return total


@inlined
def _advance(s, last):
    """Move along the step to the first watched row in the way; return it, or -1 if there is none.

    Of those that are reached at once Bland's rule takes the first.
    """
    x, p, value, along, state = s.point.x, s.point.p, s.point.value, s.point.along, s.working.state
    number, count, tolerance = s.working.number, s.working.count, s.settings.tolerance
    size = 0.0
    for c in range(x.size):
        size += (x[c] + p[c]) ** 2
    number[SIZE] = max(number[SIZE], np.sqrt(size))
    bland = count[STILL] > BLAND_AFTER
    entering, side, length = -1, 0.0, 1.0
    for i in range(last):
        if state[i] != WATCHED:
            continue
        along[i] = speed = value_of(s.problem, p, i)
        bound = s.working.up[i] if speed > 0.0 else s.working.low[i]
        over = value[i] + speed - bound
        over = over if speed > 0.0 else -over
        if speed == 0.0 or over <= tolerance * _around(s, i, bound) or not np.isfinite(bound):
            continue
        t = max((bound - value[i]) / speed, 0.0)
        if t < length and not (bland and entering >= 0 and t >= length - NO_STEP):
            entering, side, length = i, (1.0 if speed > 0.0 else -1.0), t
    for c in range(x.size):
        x[c] += length * p[c]
    for i in range(last):
        if state[i] == WATCHED:
            value[i] += length * along[i]
    count[STILL] = count[STILL] + 1 if length < NO_STEP else 0
    if entering >= 0:
        s.record.active[entering] = side
    return entering


@inlined
def _enter(s, i, first, last):
    """Take row i into the working set: as a soft row of the level, or as one that is held."""
    count = s.working.count
    if count[STILL] > STALLED and count[APART] == 0 and count[TIMES] < RELAXATIONS:
        _move_apart(s, last)
    if i >= first:
        s.working.state[i] = SOFT
        s.working.soft[count[ROWS]] = i
        count[ROWS] += 1
        return
    M, n, begin = s.T.M, s.T.M.shape[0], count[FIX] + count[HARD]
    least, column, lo = s.settings.rank_tolerance * s.problem.norm[i], s.T.column[i], s.T.at[FIRST]
    if left_of(s.problem, s.T, i, begin, n) <= least * least:
        s.working.state[i], s.record.active[i] = PARALLEL, FREE
        return
    free = min(begin + count[RANK], n - 1)
    reflect(M, free, n, column, lo, s.T.total)
    for t in range(free - 1, begin - 1, -1):
        fold(M, t, column, lo)
    s.working.owner[begin], s.working.state[i] = i, HELD
    count[HARD] += 1
    count[RANK] = min(count[RANK], n - begin - 1)
    for q in range(count[RANK]):  # pivot again from where a row lost its own basis vector
        j, t = s.working.soft[q], begin + 1 + q
        if left_of(s.problem, s.T, j, t, t + 1) <= (WEAK * s.problem.norm[j]) ** 2:
            count[RANK] = q
            break


@inlined
def _leave(s, i, last):
    """Take row i out of the working set, and watch it.

    A soft row that is now beyond its other side stays, for that side.
    """
    state, was = s.working.state, s.record.active[i]
    s.point.value[i] = value_of(s.problem, s.point.x, i)
    if state[i] == SOFT:
        s.record.active[i] = _missed_side(s, i, s.settings.tolerance)
        if s.record.active[i] == -was:
            return
        _drop_soft(s, i)
    else:
        _release(s, i)
    s.record.active[i], state[i] = FREE, WATCHED
    _watch_parallel(s, last)


@inlined
def _release(s, i):
    """Let go of the held row i: its basis vector goes to the soft rows."""
    count, owner, place = s.working.count, s.working.owner, s.working.count[FIX]
    while owner[place] != i:
        place += 1
    count[HARD] -= 1
    end = count[FIX] + count[HARD]
    for t in range(place, end):
        owner[t] = owner[t + 1]
        fold(s.T.M, t, s.T.column[owner[t]], s.T.at[FIRST])
    for q in range(count[RANK]):
        fold(s.T.M, end + q, s.T.column[s.working.soft[q]], s.T.at[FIRST])


@inlined
def _drop_soft(s, i):
    """Take row i out of the soft rows."""
    count, soft, place = s.working.count, s.working.soft, 0
    while soft[place] != i:
        place += 1
    count[ROWS] -= 1
    if place >= count[RANK]:
        soft[place] = soft[count[ROWS]]
        return
    for q in range(place, count[ROWS]):
        soft[q] = soft[q + 1]
    count[RANK] -= 1
    begin = count[FIX] + count[HARD]
    for q in range(place, count[RANK]):
        fold(s.T.M, begin + q, s.T.column[soft[q]], s.T.at[FIRST])


@inlined
def _move_apart(s, last):
    """Move the sides of the inequalities outward, each by another little, so that no two tie."""
    count, low, up = s.working.count, s.working.low, s.working.up
    count[APART], count[STILL] = 1, 0
    count[TIMES] += 1
    for i in range(last):
        if s.record.active[i] != EQUAL and s.working.state[i] != FIXED:
            share = RELAXATION * (1.0 + (GOLDEN * (i + count[TIMES])) % 1.0)
            up[i] += share * _around(s, i, up[i])
            low[i] -= share * _around(s, i, low[i])


@inlined
def _put_back(s, last):
    """Put the sides back where they were, and the held rows on them."""
    count, x, M = s.working.count, s.point.x, s.T.M
    count[APART] = count[STILL] = 0
    for i in range(last):
        s.working.low[i], s.working.up[i] = s.problem.lower[i], s.problem.upper[i]
    for t in range(count[FIX], count[FIX] + count[HARD]):
        i = s.working.owner[t]
        step = (_side(s, i) - value_of(s.problem, x, i)) / (
            s.problem.entry[i] * M[t, s.T.column[i]])
        for c in range(x.size):
            x[c] += step * M[t, s.T.at[BASE] + c]
    for i in range(last):
        if s.working.state[i] == WATCHED:
            s.point.value[i] = value_of(s.problem, x, i)
            if _missed_side(s, i, 10.0 * s.settings.tolerance) != 0.0:
                count[DOUBT] = 1


@inlined
def _worst(s, whole):
    """Return the row that holds x back the wrong way most, or the first by Bland; -1 if none."""
    count, owner, soft = s.working.count, s.working.owner, s.working.soft
    fixed, hard = count[FIX], count[HARD]
    s.working.number[SIZE] = max(s.working.number[SIZE], length_of(s.point.x))
    count[TRIES] += 1
    for t in range(fixed, fixed + hard):
        s.point.pull.force[t] = 0.0
    if whole:
        count[MISSED] = _force_of_whole(s)
    else:
        count[MISSED] = _force_of_rows(s)
    bland = count[STILL] > BLAND_AFTER
    least, leaving = 0.0, -1
    if count[MISSED] == 1:
        for q in range(hard + count[ROWS]):
            i = owner[fixed + q] if q < hard else soft[q - hard]
            force = s.point.pull.force[fixed + q] if q < hard else s.point.w[q - hard]
            push = s.record.active[i] * force * s.problem.norm[i]
            if s.record.active[i] == EQUAL or push >= 0.0:
                continue
            if bland and (leaving < 0 or i < leaving):
                leaving = i
            elif not bland and push < least:
                least, leaving = push, i
    return leaving


@inlined
def _force_of_whole(s):
    """Write the forces of the held rows against the way to the goal; 0 if x is there."""
    x, goal, pull, count = s.point.x, s.point.goal, s.point.pull, s.working.count
    base, end, weight = s.T.at[BASE], count[FIX] + count[HARD], s.working.number[WEIGHT]
    gap = square = 0.0
    for c in range(x.size):
        gap += (x[c] - goal[c]) ** 2
        square += goal[c] ** 2
    size = max(s.working.number[SIZE], np.sqrt(square))
    if np.sqrt(gap) <= s.settings.tolerance * size:
        return 0
    for t in range(count[FIX], end):
        g = terms = 0.0
        for c in range(x.size):
            term = s.T.M[t, base + c] * (x[c] - goal[c])
            g += term
            terms += abs(term)
        pull.g[t], pull.terms[t] = weight * g, weight * terms
    balance(s.problem, s.T, s.working.owner, pull, count[FIX], end, ZERO)
    return 1


@inlined
def _force_of_rows(s):
    """Write the forces of the held rows against the level's; 0 if it misses nothing.

    Where rows of the level are parallel but for less than rank_tolerance, they count as parallel,
    and what they miss by, or pull with, for that reason alone is none.
    """
    count, pull, w, soft = s.working.count, s.point.pull, s.point.w, s.working.soft
    fixed, end = count[FIX], count[FIX] + count[HARD]
    worst = pulled = 0.0
    for q in range(count[ROWS]):
        around = _around(s, soft[q], _side(s, soft[q]))
        if abs(w[q]) <= EPSILON * around:
            w[q] = 0.0
        else:
            worst = max(worst, abs(w[q]) / around)
        pulled += s.problem.norm[soft[q]] * abs(w[q])
    if worst <= s.settings.tolerance:
        return 0
    for t in range(fixed, end):
        damped = s.working.number[DAMPED]
        pull.g[t] = damped * damped * _gone(s, t) if damped > 0.0 else 0.0
        pull.terms[t] = abs(pull.g[t])
    part = Part(ZERO, count[ROWS], end, count[RANK])
    pull_of_rows(s.problem, s.T, soft, part, w, pull, fixed, end)
    balance(s.problem, s.T, s.working.owner, pull, fixed, end, ZERO)
    small = s.settings.rank_tolerance * pulled
    unclear = worst <= s.settings.rank_tolerance
    for t in range(fixed, end):
        unclear |= pull.force[t] != 0.0 and pull.share[t] <= small
    if not unclear or (count[TRIES] <= PATIENCE * (count[HARD] + count[ROWS] + 1)
                       and not nearly_parallel(s.problem, s.T, soft, part, fixed, s.point.p,
                                               s.settings.rank_tolerance)):
        return 1
    for t in range(fixed, end):
        if pull.share[t] <= small:
            pull.force[t] = 0.0
    return 1 if worst > s.settings.rank_tolerance else 0


@inlined
def _settle(s, k, whole):
    """Make the rows that a level decided equalities for good; its other rows stay held."""
    count, state, record, owner = s.working.count, s.working.state, s.record, s.working.owner
    fixed, end, n = count[FIX], count[FIX] + count[HARD], s.T.M.shape[0]
    least = smallest_share(s.problem, s.T, owner, fixed, end)
    for t in range(fixed, end):
        i, force = owner[t], s.point.pull.force[t]
        if record.active[i] * force > 0.0:
            state[i], record.held[i], record.multiplier[i] = FIXED, k, force
    for q in range(count[ROWS]):
        i = s.working.soft[q]
        around = s.settings.tolerance * _around(s, i, _side(s, i))
        state[i] = FIXED
        if q < count[RANK]:
            left = left_of(s.problem, s.T, i, end + q, end + q + 1)
            least = min(least, np.sqrt(left) / s.problem.norm[i])
        if record.active[i] == EQUAL:
            continue
        if count[MISSED] == 1 and record.active[i] * s.point.w[q] > around:
            record.held[i], record.multiplier[i] = k, s.point.w[q]
        else:
            state[i] = HELD
    if least < DOUBTFUL:
        count[DOUBT] = 1
    _order(s, n if whole else end + count[RANK])
    s.T.at[FIRST] += count[EQUALITIES]


@inlined
def _order(s, end):
    """Give the basis vectors up to `end` to the rows that are fixed first, then to those held."""
    count, owner, soft, state = s.working.count, s.working.owner, s.working.soft, s.working.state
    fixed, hard, rows, held = count[FIX], count[HARD], count[ROWS], s.point.along
    at, least, open_rows = fixed, s.settings.rank_tolerance, 0
    for q in range(hard + rows):
        i = owner[fixed + q] if q < hard else soft[q - hard]
        if state[i] == HELD:
            held[open_rows] = i
            open_rows += 1
    count[FIX], count[HARD] = end, 0
    if open_rows == 0:
        return
    for q in range(hard + rows):
        i = owner[fixed + q] if q < hard else soft[q - hard]
        if state[i] == FIXED and left_of(s.problem, s.T, i, at, end) > (
                least * s.problem.norm[i]) ** 2:
            reflect(s.T.M, at, end, s.T.column[i], s.T.at[FIRST], s.T.total)
            at += 1
    count[FIX] = at
    for q in range(open_rows):
        i = np.int64(held[q])
        if left_of(s.problem, s.T, i, at, end) > (least * s.problem.norm[i]) ** 2:
            reflect(s.T.M, at, end, s.T.column[i], s.T.at[FIRST], s.T.total)
            owner[at] = i
            at += 1
        else:
            state[i], s.record.active[i] = WATCHED, FREE
            s.point.value[i] = value_of(s.problem, s.point.x, i)
    count[HARD] = at - count[FIX]
