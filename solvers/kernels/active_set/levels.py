"""A working set found level by level, by a primal active set.

Each level is one convex problem. Its own rows are soft: their violation is minimised. The
inequality rows of the levels above are hard: x satisfies them and moves only as far as the next one
allows, which is then held at its side. When a level cannot improve, a held row with a multiplier of
the wrong sign is released; if there is none, the level is solved. The rows that hold it back become
equalities permanently, the others stay inequalities. The last level moves x to the reference.

A seed, an x and rows that act, saves steps: the rows that it holds are held before the level that
they hold back, or before the first that its x does not solve.

This finds the working set of most problems in few steps, but nothing keeps it from cycling or from
mistaking rounding for a sign: its steps are limited, and what it claims must be verified.

The basis vectors of the tableau belong, in this order, to rows that are permanently `fixed`, to
`hard` rows held at their side, to the `soft` rows of the level, and to none.
"""

import numpy as np

from hierarchy.jit import add_multiple, inlined, internal
from solvers.kernels.active_set.tableau import (
    BASE,
    COLUMN,
    FIX,
    FORCE,
    GOAL,
    HARD,
    KIND,
    LIST,
    MISSED,
    OVER,
    OWNER,
    PULL,
    QUEUE,
    RANKS,
    REACH,
    REST,
    ROUNDING,
    ROW,
    ROWS,
    SCALE,
    SETTLED,
    SIZE,
    SPEED,
    STEP,
    STEPS,
    TURNING,
    VALUE,
    WEIGHT,
    Z,
    add_column,
    around,
    balance,
    fold,
    is_independent,
    left_of,
    measure,
    missed_side,
    open_tableau,
    pivot_rows,
    push_by,
    reflect_columns,
    step_of_rows,
    weigh_rows,
)
from solvers.kernels.active_set.working_set import (
    ACTED,
    ENTRY,
    FIRST,
    HOLDS,
    LOWER,
    NORM,
    REFERENCE,
    STATE,
    UNIT,
    UPPER,
    WHOLE,
    gives_all,
    product_with,
    side_at,
)
from solvers.kernels.linalg.space import assign, fill
from solvers.kernels.tolerances import CANCELLED, FLOOR, REPIVOT
from solvers.status import EQUAL, FREE, SOLVED, UNPROVED

# Kind of a row, 0 before its level. PARALLEL: the held rows keep it in place.
WATCHED, HELD, SOFT, FIXED, PARALLEL = range(1, 6)


@internal
def pass_through_levels(t, tolerance, limit, seeded):
    """Write x, and the claims of the working set; return SOLVED, or UNPROVED if steps ran out.

    And the level at which they did, -1 for none.

    t: a `Tableau`. tolerance: of violations. limit: on the steps. seeded: whether to start from x
    and the rows that act, not from zero and none. On return count[STEPS] has the number of steps.
    """
    s = t.of
    levels = s.multiplier.shape[0] - 1
    open_tableau(t, seeded)
    for k in range(levels + 1):
        first = s.index[FIRST, k]
        last = s.index[FIRST, k + 1] if k < levels else first
        whole = _sets_goal(t, k)
        if seeded:
            _hold_seeded(t, k, first, tolerance)
        begun = _begin(t, k, last, whole, tolerance)
        missed = not whole and s.multiplier[k, first:last].any()
        while begun:
            if t.count[STEPS] >= limit:
                return UNPROVED, k
            t.count[STEPS] += 1
            rank = _aim(t, whole)
            entering = _advance(t, rank, last, tolerance)
            leaving = -1 if entering >= 0 else _held_wrongly(t, whole, tolerance)
            if entering >= 0:
                _enter(t, entering, first)
            elif leaving >= 0:
                _leave(t, leaving, last, tolerance)
            else:
                _settle(t, k)
                missed = missed or t.count[MISSED] == 1
                break
        if missed:
            _write_multipliers(t, k, whole)
        if begun:
            _order(t, whole)
        _close_columns(t)
        if whole and k < levels:
            s.count[WHOLE] = k
            for i in range(first, last):
                s.multiplier[k, i] = s.number[ENTRY, i] * s.x[s.index[UNIT, i]] - side_at(s, i)
            break
    return SOLVED, -1


@inlined
def _hold_seeded(t, k, end, tolerance):
    """Hold the rows of the levels above that the seed holds from level k on, if x is there."""
    s, t.count[RANKS] = t.of, 0
    for i in range(end):
        if s.index[HOLDS, i] != k or s.index[KIND, i] != WATCHED:
            continue
        s.index[STATE, i] = s.index[ACTED, i]
        side = side_at(s, i)
        if abs(product_with(s, i, s.x) - side) <= tolerance * around(s, i, side, t.scalar[SCALE]):
            _enter(t, i, end)
        else:
            s.index[STATE, i] = FREE


@inlined
def _sets_goal(t, k):
    """Whether a level sets all of x, with its goal: the reference, or a level equivalent to one."""
    s = t.of
    levels = s.multiplier.shape[0] - 1
    if k < levels:
        whole = t.count[FIX] < s.x.size and gives_all(s, k, s.number[GOAL], s.number[STEP])
        t.scalar[WEIGHT] = s.number[NORM, s.index[FIRST, k]] ** 2 if whole else 1.0
        return whole
    assign(s.number[GOAL, :s.x.size], s.number[REFERENCE])
    t.scalar[WEIGHT] = 1.0
    return True


@inlined
def _begin(t, k, last, whole, tolerance):
    """List the violated rows of a level and its equalities, watch the others; False if finished.

    A row with no remainder outside the fixed rows is settled.
    """
    s, count, n = t.of, t.count, t.of.x.size
    measure(t)
    count[RANKS] = count[ROWS] = 0
    for i in range(s.index[FIRST, k] if k < s.multiplier.shape[0] - 1 else last, last):
        value = product_with(s, i, s.x)
        s.number[VALUE, i] = value
        if s.number[NORM, i] <= 0.0:
            s.index[KIND, i] = FIXED
            continue
        if s.index[STATE, i] != EQUAL:
            s.index[STATE, i] = missed_side(s, i, value, t.scalar[SCALE], tolerance)
        s.index[KIND, i] = WATCHED if s.index[STATE, i] == FREE else FIXED
        if s.index[KIND, i] == WATCHED or whole:
            continue
        add_column(t, i)
        if is_independent(t, i, left_of(t, i, count[FIX], n)):
            s.index[KIND, i] = SOFT
            s.index[LIST, count[ROWS]] = i
            count[ROWS] += 1
        else:
            s.multiplier[k, i] = value - side_at(s, i)
    _watch_parallel(t, last)
    return count[ROWS] > 0 or whole


@inlined
def _write_multipliers(t, k, whole):
    """Write the multipliers in level k of all rows that own a basis vector."""
    s, end, largest = t.of, t.count[FIX] + t.count[HARD], 0.0
    fill(s.number[PULL, :end], 0.0)
    if whole:
        _pull_of_goal(t, 0, end)
    for i in range(0 if whole else s.index[FIRST, k], 0 if whole else s.index[FIRST, k + 1]):
        push = s.multiplier[k, i]
        if push != 0.0:
            largest = max(largest, abs(push) * s.number[NORM, i])
            push_by(t, i, push, 0, end)
    t.scalar[ROUNDING] = t.scalar[ROUNDING] if whole else CANCELLED * largest
    balance(t, 0, end)
    for c in range(end):
        if s.index[OWNER, c] >= 0:
            s.multiplier[k, s.index[OWNER, c]] = s.number[FORCE, c]


@inlined
def _pull_of_goal(t, begin, end):
    """Add the step from the goal, weighted, in the basis vectors begin .. end - 1."""
    for r in range(begin, end):
        t.of.number[PULL, r] -= t.scalar[WEIGHT] * _way_to_goal(t, r)


@inlined
def _way_to_goal(t, r):
    """Return the step from x to the goal in basis vector r."""
    s, total, base = t.of, 0.0, t.count[BASE]
    for c in range(s.x.size):
        total += t.M[r, base + c] * (s.number[GOAL, c] - s.x[c])
    return total


@inlined
def _watch_parallel(t, last):
    """Watch again the rows that held rows had fixed, because the held rows have changed."""
    for i in range(last):
        if t.of.index[KIND, i] == PARALLEL:
            t.of.index[KIND, i] = WATCHED
            t.of.number[VALUE, i] = product_with(t.of, i, t.of.x)


@inlined
def _aim(t, whole):
    """Write the step of a level from the current x, in basis vectors; return their number."""
    s, begin = t.of, t.count[FIX] + t.count[HARD]
    if whole:
        t.scalar[REACH] = 0.0
        for r in range(begin, s.x.size):
            s.number[Z, r] = step = _way_to_goal(t, r)
            t.scalar[SIZE] = max(t.scalar[SIZE], abs(step))
        return s.x.size - begin
    t.count[RANKS] = pivot_rows(t, begin, t.count[RANKS])
    for q in range(t.count[ROWS]):
        i = s.index[LIST, q]
        s.number[VALUE, i] = product_with(s, i, s.x)
        s.number[REST, q] = rest = side_at(s, i) - s.number[VALUE, i]
        t.scalar[SIZE] = max(t.scalar[SIZE], abs(rest) / s.number[NORM, i])
    t.scalar[REACH] = step_of_rows(t, begin, t.count[RANKS])
    return t.count[RANKS]


@inlined
def _advance(t, rank, last, tolerance):
    """Move along the step up to the first watched row; return it, or -1 if there is none."""
    s, x, p, value, speed = t.of, t.of.x, t.of.number[STEP], t.of.number[VALUE], t.of.number[SPEED]
    begin, size, square = t.count[FIX] + t.count[HARD], t.scalar[REACH], 0.0
    entering, side, length = -1, 0, 1.0
    fill(p[:x.size], 0.0)
    for r in range(begin, begin + rank):
        size = max(size, abs(s.number[Z, r]))
        add_multiple(p[:x.size], s.number[Z, r], t.M[r, t.count[BASE]:])
    for c in range(x.size):
        square += (x[c] + p[c]) ** 2
    # A step of a level that is nearly singular is long, and cut short by the first row in its way:
    # so its end sets no tolerance before it is reached.
    t.scalar[REACH] = size = max(size, np.sqrt(square))
    scale = max(t.scalar[SCALE], np.sqrt(square), FLOOR * max(size, t.scalar[SIZE]))
    for i in range(last):
        if s.index[KIND, i] != WATCHED:
            continue
        speed[i] = v = product_with(s, i, p)
        bound = s.number[UPPER, i] if v > 0.0 else s.number[LOWER, i]
        over = value[i] + v - bound if v > 0.0 else bound - value[i] - v
        if v == 0.0 or over <= tolerance * around(s, i, bound, scale) or not np.isfinite(bound):
            continue
        part = max((bound - value[i]) / v, 0.0)
        if part < length:
            entering, side, length = i, (1 if v > 0.0 else -1), part
    for c in range(x.size):
        x[c] += length * p[c]
    for i in range(last):
        if s.index[KIND, i] == WATCHED:
            value[i] += length * speed[i]
    t.scalar[SIZE] = max(t.scalar[SIZE], length * t.scalar[REACH])
    t.scalar[SCALE] = max(t.scalar[SCALE], length * scale, FLOOR * t.scalar[SIZE])
    if entering >= 0:
        s.index[STATE, entering] = side
    return entering


@inlined
def _enter(t, i, first):
    """Add row i to the working set, as a soft row of the level or as a held row."""
    s, count, n = t.of, t.count, t.of.x.size
    add_column(t, i)
    if i >= first:
        s.index[KIND, i] = SOFT
        s.index[LIST, count[ROWS]] = i
        count[ROWS] += 1
        return
    begin = count[FIX] + count[HARD]
    if not is_independent(t, i, left_of(t, i, begin, n)):
        s.index[KIND, i], s.index[STATE, i] = PARALLEL, FREE
        return
    free = min(begin + count[RANKS], n - 1)
    reflect_columns(t.M, free, n, s.index[COLUMN, i], count[TURNING], t.room)
    for r in range(free - 1, begin - 1, -1):
        fold(t.M, r, s.index[COLUMN, i], count[TURNING])
    s.index[OWNER, begin], s.index[KIND, i] = i, HELD
    count[HARD] += 1
    count[RANKS] = min(count[RANKS], n - begin - 1)
    for q in range(count[RANKS]):  # pivot again from the first row that lost its basis vector
        j, r = s.index[LIST, q], begin + 1 + q
        if left_of(t, j, r, r + 1) <= (REPIVOT * s.number[NORM, j]) ** 2:
            count[RANKS] = q
            break


@inlined
def _held_wrongly(t, whole, tolerance):
    """Write the forces of the held rows; return the row whose force is wrong the most, or -1."""
    s, begin, end = t.of, t.count[FIX], t.count[FIX] + t.count[HARD]
    measure(t)
    fill(s.number[PULL, begin:end], 0.0)
    fill(s.number[FORCE, begin:end], 0.0)
    t.count[MISSED] = _misses_goal(t, tolerance) if whole else not weigh_rows(t) <= tolerance
    if t.count[MISSED] == 0:
        return -1
    if whole:
        _pull_of_goal(t, begin, end)
    for q in range(0 if whole else t.count[ROWS]):
        if s.number[OVER, q] != 0.0:
            push_by(t, s.index[LIST, q], s.number[OVER, q], begin, end)
    balance(t, begin, end)
    return _worst(t)


@inlined
def _misses_goal(t, tolerance):
    """Whether x is not at the goal."""
    s, gap, square = t.of, 0.0, 0.0
    for c in range(s.x.size):
        gap += (s.x[c] - s.number[GOAL, c]) ** 2
        square += s.number[GOAL, c] ** 2
    size, scale = max(t.scalar[SIZE], np.sqrt(square)), max(t.scalar[SCALE], np.sqrt(square))
    t.scalar[ROUNDING] = CANCELLED * t.scalar[WEIGHT] * size
    return not np.sqrt(gap) <= tolerance * scale


@inlined
def _worst(t):
    """Return the row whose force has the worst wrong sign; -1 if there is none."""
    s, fixed, hard, least, leaving = t.of, t.count[FIX], t.count[HARD], 0.0, -1
    for q in range(hard + t.count[ROWS]):
        i = s.index[OWNER, fixed + q] if q < hard else s.index[LIST, q - hard]
        force = s.number[FORCE, fixed + q] if q < hard else s.number[OVER, q - hard]
        push = s.index[STATE, i] * force * s.number[NORM, i]
        if s.index[STATE, i] == EQUAL or push >= (0.0 if q < hard else -t.scalar[ROUNDING]):
            continue
        if push < least:
            least, leaving = push, i
    return leaving


@inlined
def _leave(t, i, last, tolerance):
    """Remove row i from the working set, and watch it.

    A soft row that is now beyond its other side stays, at that side.
    """
    s, was, value = t.of, t.of.index[STATE, i], product_with(t.of, i, t.of.x)
    s.number[VALUE, i] = value
    if s.index[KIND, i] == SOFT:
        side = missed_side(s, i, value, t.scalar[SCALE], tolerance)
        s.index[STATE, i] = side
        if side == -was:
            return
    _remove(t, i)
    s.index[STATE, i], s.index[KIND, i] = FREE, WATCHED
    _watch_parallel(t, last)


@inlined
def _remove(t, i):
    """Remove row i from the held rows, or the soft ones; its basis vector goes behind the soft."""
    s, count, owner, soft = t.of, t.count, t.of.index[OWNER], t.of.index[LIST]
    held = s.index[KIND, i] == HELD
    place, begin = 0, count[FIX] + count[HARD] - held
    if held:
        place = count[FIX]
        while owner[place] != i:
            place += 1
        for r in range(place, begin):
            owner[r] = owner[r + 1]
        count[HARD] -= 1
    else:
        while soft[place] != i:
            place += 1
        count[ROWS] -= 1
        if place >= count[RANKS]:
            soft[place] = soft[count[ROWS]]
            return
        for q in range(place, count[ROWS]):
            soft[q] = soft[q + 1]
        count[RANKS] -= 1
        place += begin
    for r in range(place, begin + count[RANKS]):
        row = owner[r] if r < begin else soft[r - begin]
        fold(t.M, r, s.index[COLUMN, row], count[TURNING])


@inlined
def _settle(t, k):
    """Turn the rows that a level decided into permanent equalities; its other rows stay held."""
    s, count, number, kind = t.of, t.count, t.of.number, t.of.index[KIND]
    fixed, end = count[FIX], count[FIX] + count[HARD]
    missed = count[MISSED] == 1
    for r in range(fixed, end):
        i = s.index[OWNER, r]
        if missed and s.index[STATE, i] * number[FORCE, r] > 0.0:
            kind[i] = FIXED
    for q in range(count[ROWS]):
        i, over = s.index[LIST, q], number[OVER, q]
        kind[i], s.multiplier[k, i] = FIXED, over if missed else 0.0
        if q >= count[RANKS]:
            is_independent(t, i, left_of(t, i, end + count[RANKS], s.x.size))
        if s.index[STATE, i] != EQUAL and not s.index[STATE, i] * s.multiplier[k, i] > 0.0:
            kind[i], s.multiplier[k, i] = HELD, 0.0


@inlined
def _order(t, whole):
    """Give the level's basis vectors to the fixed rows first, then to the held rows."""
    s, count, owner, kind = t.of, t.count, t.of.index[OWNER], t.of.index[KIND]
    listed, fixed, hard, held = s.index[QUEUE], count[FIX], count[HARD], 0
    rows, at = 0 if whole else hard + count[ROWS], fixed  # all of x is settled: no row is open
    end = s.x.size if whole else fixed + hard + count[RANKS]
    for q in range(rows):
        listed[q] = owner[fixed + q] if q < hard else s.index[LIST, q - hard]
        held += kind[listed[q]] == HELD
    if held == 0:
        for r in range(fixed + hard, end):
            owner[r] = -1 if whole else s.index[LIST, r - fixed - hard]
        at = end
    for q in range(rows if held > 0 else 0):
        if kind[listed[q]] == FIXED:
            at = _own(t, listed[q], at, end)
    count[FIX] = at
    for q in range(rows if held > 0 else 0):
        i, before = listed[q], at
        if kind[i] == HELD:
            at = _own(t, i, at, end)
            if at == before:
                kind[i], s.index[STATE, i] = WATCHED, FREE
                s.number[VALUE, i] = product_with(s, i, s.x)
    count[HARD] = at - count[FIX]


@inlined
def _close_columns(t):
    """Settle the columns of the fixed rows, and close those of rows that no longer act.

    The first that turns fills the place.
    """
    s, M, count = t.of, t.M, t.count
    for at in range(count[TURNING], count[BASE]):
        i, first, to = s.index[ROW, at], count[TURNING], count[SETTLED]
        other, settled = s.index[ROW, first], s.index[KIND, i] == FIXED
        if not settled and s.index[KIND, i] not in (WATCHED, PARALLEL):
            continue
        for r in range(s.x.size):
            entry = M[r, at]
            M[r, at] = M[r, first]
            if settled:
                M[r, to] = entry
        s.index[COLUMN, other], s.index[ROW, at] = at, other
        s.index[COLUMN, i] = to if settled else -1
        count[TURNING] += 1
        count[SETTLED] += settled


@inlined
def _own(t, i, at, end):
    """Give row i the basis vector `at` if it is independent of those before; return the next."""
    s, left = t.of, left_of(t, i, at, end)
    if at < end and is_independent(t, i, left):
        reflect_columns(t.M, at, end, s.index[COLUMN, i], t.count[TURNING], t.room)
        s.index[OWNER, at] = i
        return at + 1
    return at
