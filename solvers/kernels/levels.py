"""Lexicographic least squares with two-sided rows, level by level, by a primal active set.

Each level is one convex problem. Its own rows are soft: their violation is minimised. The
inequality rows of the levels above are hard: x satisfies them and moves only as far as the next one
allows, which is then held at its side. When a level cannot improve, a held row with a multiplier of
the wrong sign is released; if there is none, the level is solved. The rows that hold it back become
equalities permanently, the others stay inequalities. The last level moves x to the reference. A
multiplier belongs to one level, so no sign is lexicographic.

A step reduces the miss of the level, so no working set returns after one. If steps of zero length
follow each other, all sides are moved outward by different amounts, so that no two tie, and moved
back at the end; after that, the row of least index enters and leaves, which cannot cycle (Bland
1977; Chang, Cottle 1980).

The basis vectors of the tableau belong, in this order, to rows that are permanently `fixed`, to
`hard` rows held at their side, to the `soft` rows of the level, and to none.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled, inlined
from solvers.kernels.level import (
    Part,
    balance,
    damping_of,
    is_unclear,
    is_uneven,
    least_squares_part,
    nearly_parallel,
    pull_of_rows,
    smallest_share,
    solve_part,
    weigh_rows,
)
from solvers.kernels.multipliers import settle
from solvers.kernels.rows import ZERO, add_multiple, finish
from solvers.kernels.tableau import (
    ACTIVE,
    ALL,
    BASE,
    COLUMN,
    DAMPED,
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
    LOW,
    LOWER,
    MULTIPLIER,
    NORM,
    OVER,
    OWNER,
    PULL,
    PULLED,
    REACH,
    REFERENCE,
    REMOVED,
    REST,
    ROUNDING,
    SCALE,
    SHARE,
    SIZE,
    SPEED,
    START,
    STATE,
    STEP,
    STEPS,
    UNFINISHED,
    UNIT,
    UP,
    UPPER,
    VALUE,
    WEIGHT,
    WORST,
    Z,
    around,
    asks_for_x,
    factor,
    fold,
    has_dust,
    has_outgrown,
    keep,
    left_of,
    measure,
    missed_side,
    open_tableau,
    prepare,
    reflect,
    side_of,
    value_of,
)
from solvers.kernels.tolerances import (
    BLAND_AFTER,
    BRINK,
    CANCELLED,
    DOUBTFUL,
    DRIFT,
    FLOOR,
    LAST,
    LIGHT,
    NO_STEP,
    PATIENCE,
    RELAXATION,
    RELAXATIONS,
    SLIGHT,
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
)

# State of a row, 0 before its level. PARALLEL: the held rows keep it in place.
WATCHED, HELD, SOFT, FIXED, PARALLEL = range(1, 6)
# Entries of `count`: basis vectors of the fixed, hard and soft rows, soft rows, equalities of the
# level that have columns; steps of zero length, steps at a level's optimum, whether sides are moved
# apart, how often that was done; whether the level is missed.
FIX, HARD, RANK, ROWS, EQUALITIES, STILL, TRIES, APART, TIMES, MISSED = range(5, 15)
GOLDEN = 0.6180339887498949


@compiled
def solve_by_levels(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (3 m + 3,) and settings: as for `solve_by_guesses`; only the number of guesses is read
    from the record. At the iteration limit, x is optimal for all levels above the unfinished one,
    and the best found for that one. Returns SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, TOO_SMALL,
    or INACCURATE if rounding leaves a doubt and the multipliers are no proof.
    """
    s, code = prepare(A, lower, upper, sizes, x, record, settings, work)
    if code != SOLVED:
        return code
    _open(s, record)
    first = ZERO
    for k in range(sizes.size + 1):
        last = first + s.index[EXTENT, k] if k < sizes.size else first
        whole = _wants_whole(s, k, first, last)
        solved = not _begin(s, k, first, last, whole)
        while not solved and s.scalar[STEPS] < s.settings.max_iterations:
            s.scalar[STEPS] += 1.0
            part = _aim(s, whole)
            entering = _advance(s, part, last)
            leaving = -1 if entering >= 0 else _held_wrongly(s, part, whole)
            if entering >= 0:
                _enter(s, entering, first, last)
            elif leaving >= 0:
                _leave(s, leaving, last)
            elif s.count[APART] == 1:
                _put_back(s, last)
            else:
                solved = True
                _settle(s, k, whole)
                _order(s, whole)
        first = last
        if not solved:
            code, s.scalar[UNFINISHED] = ITERATION_LIMIT, k
            break
    keep(s, record)
    code = settle(s, lower, upper, sizes, record, _verdict(s, code))
    return code if finish(x, SOLVED) == SOLVED else ZERO + NUMERICAL_FAILURE


@inlined
def _verdict(s, code):
    """Return how the solve ended."""
    doubt = s.count[DOUBT] == 1 or has_outgrown(s) or has_dust(s) or _has_drifted(s)
    if code == SOLVED and doubt and s.settings.damping == 0.0:
        code = ZERO + INACCURATE
    return code


@inlined
def _has_drifted(s):
    """Whether the levels below moved a settled row that counted as dependent, or one past its side.

    Little is left of such a row in the directions of those levels, but x can go far along them.
    """
    number, scale, drifted = s.number, s.scalar[SCALE], False
    for i in range(s.A.shape[0]):
        value = value_of(s, s.x, i)
        if s.index[STATE, i] != FIXED:
            drifted |= missed_side(number, i, value, scale, DRIFT) != 0.0
        else:
            drifted |= abs(value - number[VALUE, i]) > DRIFT * around(
                number[NORM, i], side_of(number, i), scale)
    return drifted


@inlined
def _open(s, record):
    """Start at x = 0 with an empty working set."""
    for i in range(s.A.shape[0]):
        s.index[STATE, i], s.number[VALUE, i] = 0, 0.0
        if s.number[ACTIVE, i] != EQUAL:
            s.number[ACTIVE, i] = FREE
    for c in range(s.x.size):
        s.x[c] = 0.0
    for c in range(REMOVED, s.count.size):
        s.count[c] = 0
    s.scalar[GUESSES] = record[record.size - 3]
    open_tableau(s, ALL)


@inlined
def _wants_whole(s, k, first, last):
    """Whether a level sets all of x: the reference, or a level equivalent to one."""
    if k < s.count[LEVELS]:
        whole = s.settings.damping == 0.0 and asks_for_x(s, first, last)
        s.scalar[WEIGHT] = s.number[ENTRY, first] ** 2 if whole else 1.0
        return whole
    for c in range(s.x.size):
        s.number[GOAL, c] = s.number[REFERENCE, c]
    s.scalar[WEIGHT] = 1.0
    return True


@inlined
def _begin(s, k, first, last, whole):
    """List the rows that a level misses or must meet, watch the others; False if it is finished.

    A row with no remainder outside the fixed rows is settled.
    """
    count, number, n = s.count, s.number, s.x.size
    measure(s)
    s.scalar[DAMPED] = 0.0
    for c in (RANK, ROWS, EQUALITIES, STILL, TRIES, TIMES):
        count[c] = 0
    least = s.settings.rank_tolerance
    for i in range(first, last):
        number[VALUE, i] = value = value_of(s, s.x, i)
        if number[ACTIVE, i] != EQUAL:
            number[ACTIVE, i] = missed_side(number, i, value, s.scalar[SCALE], s.settings.tolerance)
        elif s.index[UNIT, i] < 0:
            count[EQUALITIES] += 1
        s.index[STATE, i] = WATCHED if number[ACTIVE, i] == FREE else FIXED
        if whole:
            number[VALUE, i] = np.nan  # the level itself moves its rows
        if s.index[STATE, i] == WATCHED or whole:
            continue
        left = left_of(s, i, count[FIX], n)
        if left > (least * number[NORM, i]) ** 2:
            s.index[STATE, i] = SOFT
            s.index[LIST, count[ROWS]] = i
            count[ROWS] += 1
            continue
        count[DOUBT] |= left > (BRINK * least * number[NORM, i]) ** 2
        if number[ACTIVE, i] != EQUAL:
            number[HOLDS, i], number[MULTIPLIER, i] = k, value - side_of(number, i)
    for c in range(n):
        number[START, c] = s.x[c]
    _watch_parallel(s, first)
    if count[ROWS] == 0 and not whole:
        count[FIRST] += count[EQUALITIES]
    return count[ROWS] > 0 or (whole and count[FIX] < n)


@inlined
def _watch_parallel(s, last):
    """Watch again the rows that held rows kept in place, because the held rows have changed."""
    for i in range(last):
        if s.index[STATE, i] == PARALLEL:
            s.index[STATE, i] = WATCHED
            s.number[VALUE, i] = value_of(s, s.x, i)


@inlined
def _aim(s, whole):
    """Write the step of a level from the current x, in basis vectors; return the level's part."""
    part = _factor(s, whole)
    if whole:
        _head_for_goal(s, part)
    else:
        _damp(s, part)
        _meet_rows(s, part)
    return part


@inlined
def _held_wrongly(s, part, whole):
    """Write the forces of the held rows; return a row whose force has the wrong sign, or -1."""
    _pull(s, part, whole)
    balance(s, s.count[FIX], part.begin, ZERO)
    _forgive(s, part, whole)
    return _worst(s)


@inlined
def _factor(s, whole):
    """Give the soft rows basis vectors after those of the held rows; return the level's part.

    A level that sets all of x takes all that remain.
    """
    begin, rows = s.count[FIX] + s.count[HARD], s.count[ROWS]
    if whole:
        return Part(ZERO, ZERO, begin, s.x.size - begin)
    s.count[RANK] = factor(s, ZERO, rows, begin, s.count[RANK])
    for q in range(rows):
        i = s.index[LIST, q]
        s.number[VALUE, i] = value_of(s, s.x, i)
        s.number[REST, q] = rest = side_of(s.number, i) - s.number[VALUE, i]
        s.scalar[SIZE] = max(s.scalar[SIZE], abs(rest) / s.number[NORM, i])
    return Part(ZERO, rows, begin, s.count[RANK])


@inlined
def _head_for_goal(s, part):
    """Write the step towards the goal, in basis vectors."""
    goal, x, base = s.number[GOAL], s.x, s.count[BASE]
    s.scalar[REACH] = 0.0
    for t in range(part.begin, x.size):
        total = 0.0
        for c in range(x.size):
            total += s.M[t, base + c] * (goal[c] - x[c])
        s.number[Z, t] = total
        s.scalar[SIZE] = max(s.scalar[SIZE], abs(total))


@inlined
def _damp(s, part):
    """Write the damping of a level: the largest over its steps. Bounds are not damped."""
    if s.settings.damping == 0.0 or part.rank == 0:
        return
    box = part.begin == 0
    for q in range(part.q1):
        box &= s.index[UNIT, s.index[LIST, q]] >= 0
    if not box:
        s.scalar[DAMPED] = max(s.scalar[DAMPED], damping_of(s, part))


@inlined
def _meet_rows(s, part):
    """Write the step of the soft rows, in basis vectors."""
    if s.scalar[DAMPED] == 0.0:
        s.scalar[REACH] = solve_part(s, part)
    else:
        for t in range(part.begin, part.begin + part.rank):
            s.number[Z, t] = -_gone(s, t)
        s.scalar[REACH] = least_squares_part(s, part, s.scalar[DAMPED])


@inlined
def _gone(s, t):
    """Return the distance that x has moved along basis vector t since the start of the level."""
    total = 0.0
    for c in range(s.x.size):
        total += s.M[t, s.count[BASE] + c] * (s.x[c] - s.number[START, c])
    return total


@inlined
def _advance(s, part, last):
    """Move along the step up to the first watched row; return it, or -1 if there is none.

    Of several rows reached at once Bland's rule takes the first.
    """
    x, p, value, speed = s.x, s.number[STEP], s.number[VALUE], s.number[SPEED]
    count, tolerance = s.count, s.settings.tolerance
    scale, rates, first = _write_step(s, part), s.room, count[FIRST]
    bland = count[STILL] > BLAND_AFTER
    entering, side, length = -1, 0.0, 1.0
    for i in range(last):
        if s.index[STATE, i] != WATCHED:
            continue
        speed[i] = v = s.number[ENTRY, i] * rates[s.index[COLUMN, i] - first]
        bound = s.number[UP, i] if v > 0.0 else s.number[LOW, i]
        over = value[i] + v - bound if v > 0.0 else bound - value[i] - v
        least = tolerance * around(s.number[NORM, i], bound, scale)
        if v == 0.0 or over <= least or not np.isfinite(bound):
            continue
        t = max((bound - value[i]) / v, 0.0)
        if t < length and not (bland and entering >= 0 and t >= length - NO_STEP):
            entering, side, length = i, (1.0 if v > 0.0 else -1.0), t
    for c in range(x.size):
        x[c] += length * p[c]
    for i in range(last):
        if s.index[STATE, i] == WATCHED:
            value[i] += length * speed[i]
    s.scalar[SIZE] = max(s.scalar[SIZE], length * s.scalar[REACH])
    s.scalar[SCALE] = max(s.scalar[SCALE], length * scale, FLOOR * s.scalar[SIZE])
    count[STILL] = count[STILL] + 1 if length < NO_STEP else 0
    if entering >= 0:
        s.number[ACTIVE, entering] = side
    return entering


@inlined
def _write_step(s, part):
    """Write the step in x, given the step in basis vectors; return the scale at its end.

    Writes the rates of all columns from FIRST on into the room. A step of a level that is nearly
    singular is long, and cut short by the first row in its way: so its end sets no tolerance before
    it is reached.
    """
    x, p, z, size, square = s.x, s.number[STEP], s.number[Z], s.scalar[REACH], 0.0
    first, base = s.count[FIRST], s.count[BASE]
    rates = s.room[:s.M.shape[1] - first]
    for c in range(rates.size):
        rates[c] = 0.0
    for t in range(part.begin, part.begin + part.rank):
        size = max(size, abs(z[t]))
        add_multiple(rates, z[t], s.M[t, first:])
    for c in range(x.size):
        p[c] = rates[base - first + c]
        square += (x[c] + p[c]) ** 2
    s.scalar[REACH] = size = max(size, np.sqrt(square))
    return max(s.scalar[SCALE], np.sqrt(square), FLOOR * max(size, s.scalar[SIZE]))


@inlined
def _enter(s, i, first, last):
    """Add row i to the working set, as a soft row of the level or as a held row."""
    count = s.count
    if count[STILL] > STALLED and count[APART] == 0 and count[TIMES] < RELAXATIONS:
        _move_apart(s, last)
    if i >= first:
        s.index[STATE, i] = SOFT
        s.index[LIST, count[ROWS]] = i
        count[ROWS] += 1
        return
    M, n, begin = s.M, s.x.size, count[FIX] + count[HARD]
    column, lo = s.index[COLUMN, i], count[FIRST]
    if left_of(s, i, begin, n) <= (s.settings.rank_tolerance * s.number[NORM, i]) ** 2:
        s.index[STATE, i], s.number[ACTIVE, i] = PARALLEL, FREE
        return
    free = min(begin + count[RANK], n - 1)
    reflect(M, free, n, column, lo, s.room)
    for t in range(free - 1, begin - 1, -1):
        fold(M, t, column, lo)
    s.index[OWNER, begin], s.index[STATE, i] = i, HELD
    count[HARD] += 1
    count[RANK] = min(count[RANK], n - begin - 1)
    for q in range(count[RANK]):  # pivot again from the first row that lost its basis vector
        j, t = s.index[LIST, q], begin + 1 + q
        if left_of(s, j, t, t + 1) <= (WEAK * s.number[NORM, j]) ** 2:
            count[RANK] = q
            break


@inlined
def _move_apart(s, last):
    """Move the sides of the inequalities outward by small different amounts, to break ties."""
    count, low, up = s.count, s.number[LOW], s.number[UP]
    count[APART], count[STILL] = 1, 0
    count[TIMES] += 1
    for i in range(last):
        if s.number[ACTIVE, i] != EQUAL and s.index[STATE, i] != FIXED:
            share = RELAXATION * (1.0 + (GOLDEN * (i + count[TIMES])) % 1.0)
            up[i] += share * around(s.number[NORM, i], up[i], s.scalar[SCALE])
            low[i] -= share * around(s.number[NORM, i], low[i], s.scalar[SCALE])


@inlined
def _leave(s, i, last):
    """Remove row i from the working set, and watch it.

    A soft row that is now beyond its other side stays, at that side.
    """
    was, value = s.number[ACTIVE, i], value_of(s, s.x, i)
    s.number[VALUE, i] = value
    if s.index[STATE, i] == SOFT:
        side = missed_side(s.number, i, value, s.scalar[SCALE], s.settings.tolerance)
        s.number[ACTIVE, i] = side
        if side == -was:
            return
        _drop(s, i)
    else:
        _release(s, i)
    s.number[ACTIVE, i], s.index[STATE, i] = FREE, WATCHED
    _watch_parallel(s, last)


@inlined
def _release(s, i):
    """Release the held row i: its basis vector goes to the soft rows."""
    count, owner, place = s.count, s.index[OWNER], s.count[FIX]
    while owner[place] != i:
        place += 1
    count[HARD] -= 1
    end = count[FIX] + count[HARD]
    for t in range(place, end):
        owner[t] = owner[t + 1]
        fold(s.M, t, s.index[COLUMN, owner[t]], count[FIRST])
    for q in range(count[RANK]):
        fold(s.M, end + q, s.index[COLUMN, s.index[LIST, q]], count[FIRST])


@inlined
def _drop(s, i):
    """Remove row i from the soft rows."""
    count, soft, place = s.count, s.index[LIST], 0
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
        fold(s.M, begin + q, s.index[COLUMN, soft[q]], count[FIRST])


@inlined
def _put_back(s, last):
    """Restore the original sides, and put the held rows on them."""
    count, x, M, number = s.count, s.x, s.M, s.number
    count[APART] = count[STILL] = 0
    for i in range(last):
        number[LOW, i], number[UP, i] = number[LOWER, i], number[UPPER, i]
    for t in range(count[FIX], count[FIX] + count[HARD]):
        i = s.index[OWNER, t]
        step = (side_of(number, i) - value_of(s, x, i)) / (
            number[ENTRY, i] * M[t, s.index[COLUMN, i]])
        for c in range(x.size):
            x[c] += step * M[t, count[BASE] + c]
    for i in range(last):
        if s.index[STATE, i] == WATCHED:
            number[VALUE, i] = value = value_of(s, x, i)
            if missed_side(number, i, value, s.scalar[SCALE], 10.0 * s.settings.tolerance) != 0.0:
                count[DOUBT] = 1


@inlined
def _pull(s, part, whole):
    """Write the pull of the level on the held rows, zero if the level has no miss."""
    fixed, damped = s.count[FIX], s.scalar[DAMPED]
    measure(s)
    s.count[TRIES] += 1
    s.count[MISSED] = _misses_goal(s) if whole else _misses_rows(s, part)
    for t in range(fixed, part.begin):
        s.number[PULL, t] = 0.0
        if s.count[MISSED] == 1 and whole:
            for c in range(s.x.size):
                s.number[PULL, t] += s.scalar[WEIGHT] * s.M[t, s.count[BASE] + c] * (
                    s.x[c] - s.number[GOAL, c])
        elif s.count[MISSED] == 1 and damped > 0.0:
            s.number[PULL, t] = damped * damped * _gone(s, t)
    if s.count[MISSED] == 1 and not whole:
        pull_of_rows(s, part, fixed, part.begin)


@inlined
def _misses_goal(s):
    """Whether x is not at the goal, as 0 or 1."""
    gap = square = 0.0
    for c in range(s.x.size):
        gap += (s.x[c] - s.number[GOAL, c]) ** 2
        square += s.number[GOAL, c] ** 2
    size, scale = max(s.scalar[SIZE], np.sqrt(square)), max(s.scalar[SCALE], np.sqrt(square))
    s.scalar[ROUNDING] = CANCELLED * s.scalar[WEIGHT] * size
    return 0 if np.sqrt(gap) <= s.settings.tolerance * scale else 1


@inlined
def _misses_rows(s, part):
    """Whether a soft row misses its side by more than rounding, as 0 or 1."""
    weigh_rows(s, part)
    s.scalar[ROUNDING] += CANCELLED * s.scalar[DAMPED] ** 2 * s.scalar[SIZE]
    return 0 if s.scalar[WORST] <= s.settings.tolerance else 1


@inlined
def _forgive(s, part, whole):
    """Set forces to zero that rows of the level have only because they are not quite parallel.

    Rows that are parallel up to rank_tolerance count as parallel, and a miss or pull that they have
    for that reason alone counts as zero.
    """
    count, force, share = s.count, s.number[FORCE], s.number[SHARE]
    fixed, least = count[FIX], s.settings.rank_tolerance
    if whole or count[MISSED] == 0:
        return
    small = least * s.scalar[PULLED]
    unclear = s.scalar[WORST] <= least
    for t in range(fixed, part.begin):
        unclear |= force[t] != 0.0 and share[t] <= small
    patient = count[TRIES] <= PATIENCE * (count[HARD] + count[ROWS] + 1)
    if not unclear or (patient and not nearly_parallel(s, part, fixed)):
        return
    count[DOUBT] = 1 if not patient else count[DOUBT]
    for t in range(fixed, part.begin):
        if share[t] <= small:
            force[t] = 0.0
    count[MISSED] = 1 if s.scalar[WORST] > least else 0


@inlined
def _worst(s):
    """Return the row whose force has the worst wrong sign, or the first by Bland; -1 if none.

    After many tries only rounding chooses: then the level ends as it is, in doubt.
    """
    count, fixed, hard = s.count, s.count[FIX], s.count[HARD]
    bland = count[STILL] > BLAND_AFTER
    least, leaving = 0.0, -1
    if count[MISSED] == 0:
        return leaving
    if count[TRIES] > LAST * (hard + count[ROWS] + 1):
        count[DOUBT] = 1
        return leaving
    for q in range(hard + count[ROWS]):
        i = s.index[OWNER, fixed + q] if q < hard else s.index[LIST, q - hard]
        force = s.number[FORCE, fixed + q] if q < hard else s.number[OVER, q - hard]
        push = s.number[ACTIVE, i] * force * s.number[NORM, i]
        if s.number[ACTIVE, i] == EQUAL or push >= (0.0 if q < hard else -s.scalar[ROUNDING]):
            continue
        if bland and (leaving < 0 or i < leaving):
            leaving = i
        elif not bland and push < least:
            least, leaving = push, i
    return leaving


@inlined
def _settle(s, k, whole):
    """Turn the rows that a level decided into permanent equalities; its other rows stay held.

    So do unclear rows: a row that the level needs at its side cannot leave while the rows of the
    level keep their values.
    """
    count, number, state, owner = s.count, s.number, s.index[STATE], s.index[OWNER]
    fixed, end, unclear = count[FIX], count[FIX] + count[HARD], s.settings.rank_tolerance
    least, missed = smallest_share(s, fixed, end), s.scalar[WORST] > unclear
    for t in range(fixed, end):
        i, force = owner[t], number[FORCE, t]
        share = number[SHARE, t] / s.scalar[PULLED] if missed and not whole else 1.0
        clear = whole or (missed and share > unclear)
        count[DOUBT] |= clear and share < DOUBTFUL
        if clear and number[ACTIVE, i] * force > 0.0:
            state[i], number[HOLDS, i], number[MULTIPLIER, i] = FIXED, k, force
            number[VALUE, i] = value_of(s, s.x, i)
    for q in range(count[ROWS]):
        i, over = s.index[LIST, q], number[OVER, q]
        scale = around(number[NORM, i], side_of(number, i), s.scalar[SCALE])
        state[i], number[VALUE, i] = FIXED, value_of(s, s.x, i)
        if q < count[RANK]:
            left = left_of(s, i, end + q, end + q + 1)
            least = min(least, np.sqrt(left) / number[NORM, i])
        else:
            count[DOUBT] |= is_unclear(s, i, end, end + count[RANK])
        if number[ACTIVE, i] == EQUAL:
            continue
        if count[MISSED] == 1 and number[ACTIVE, i] * over > unclear * scale:
            count[DOUBT] |= number[ACTIVE, i] * over < DOUBTFUL * scale
            number[HOLDS, i], number[MULTIPLIER, i] = k, over
        else:
            state[i] = HELD
    slight = not whole and SLIGHT * unclear < s.scalar[WORST] < DOUBTFUL
    part = Part(ZERO, count[ROWS], end, ZERO)
    if least < DOUBTFUL or slight or (missed and is_uneven(s, part, LIGHT)):
        count[DOUBT] = 1


@inlined
def _order(s, whole):
    """Give the level's basis vectors to the fixed rows first, then to the held rows."""
    count, owner, soft, state = s.count, s.index[OWNER], s.index[LIST], s.index[STATE]
    fixed, hard, rows, held = count[FIX], count[HARD], count[ROWS], s.number[SPEED]
    end = s.x.size if whole else fixed + hard + count[RANK]
    at, least, open_rows = fixed, s.settings.rank_tolerance, 0
    for q in range(0 if whole else hard + rows):  # all of x is settled: no row is open
        i = owner[fixed + q] if q < hard else soft[q - hard]
        if state[i] == HELD:
            held[open_rows] = i
            open_rows += 1
    for q in range(hard + rows if open_rows > 0 else 0):
        i = owner[fixed + q] if q < hard else soft[q - hard]
        left = np.sqrt(left_of(s, i, at, end)) / s.number[NORM, i]
        if state[i] == FIXED and left > least:
            count[DOUBT] |= left < DOUBTFUL
            reflect(s.M, at, end, s.index[COLUMN, i], count[FIRST], s.room)
            at += 1
        elif state[i] == FIXED:
            count[DOUBT] |= left > BRINK * least
    count[FIX] = at if open_rows > 0 else end
    for q in range(open_rows):
        i = np.int64(held[q])
        left = left_of(s, i, at, end)
        if left > (least * s.number[NORM, i]) ** 2:
            count[DOUBT] |= left < (DOUBTFUL * s.number[NORM, i]) ** 2
            reflect(s.M, at, end, s.index[COLUMN, i], count[FIRST], s.room)
            owner[at] = i
            at += 1
        else:
            state[i], s.number[ACTIVE, i] = WATCHED, FREE
            s.number[VALUE, i] = value_of(s, s.x, i)
    count[HARD] = at - count[FIX] if open_rows > 0 else 0
    count[FIRST] += count[EQUALITIES]
