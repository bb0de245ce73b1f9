"""Lexicographic least squares with two-sided rows, level after level, by a primal active set.

One stage a level. Its rows are soft: what they miss is minimised. The inequality rows of the levels
above are hard, and x, which satisfies them, moves only as far as the next one allows. Those that
hold the level back (positive multiplier) are then equalities for good, like the rows of the level
itself; those that do not stay inequalities. The last stage brings x to the reference.

Every step lowers what the level misses, or frees a row that pulls, so a stage ends; where steps of
length zero might cycle, rows are taken by Bland's rule. Slower than guessing (`hcod.py`), but it
needs no luck: each stage is a convex problem, and no multiplier spans more than one level.

Coordinates: the reflectors in rows V, V + 1, ... of W make Q^T. The first `fixed` belong to rows
that are equalities for good, the next `h` to hard rows held at their side, then those of the level.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_damped, variable_damping
from solvers.kernels.flat import factor_level, make_reflector, reflect_rows
from solvers.kernels.rows import (
    DOUBT,
    EQUAL,
    INACCURATE,
    ITERATION_LIMIT,
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

# State of a row; 0 while its level is still to come. PARALLEL: the held rows keep it where it is.
WATCHED, HELD, SOFT, FIXED, PARALLEL = 1, 2, 3, 4, 5
BLAND_AFTER = 20  # steps of length zero in one stage
PATIENCE = 10  # steps of one stage for each of its rows, after which small multipliers are noise


@compiled
def stages_work(m, n):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return (4 * m + 3 * n + 1) * n + 12 * m + 8 * n


@compiled
def solve_by_stages(A, lower, upper, sizes, x, record, settings, work):
    """Solve; arguments and results as those of `hcod`, but record is only written.

    Where the iterations end early, x keeps all levels above the unfinished one, and that level is
    as good as it got. Returns SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, or INACCURATE where
    nearly parallel rows, or rows of very different scale, leave a doubt.
    """
    m, n = A.shape
    levels = sizes.size
    if work.size < stages_work(m, n):
        return TOO_SMALL
    active, held, multiplier = record[:m], record[m:2 * m], record[2 * m:3 * m]
    counts = record[3 * m:]
    damping, threshold, rank_tolerance = settings[0], settings[1], settings[2]
    tolerance, max_iterations = settings[3], settings[5]
    counts[1], counts[2] = 0.0, -1.0
    # The level's rows being factored, behind the held rows, and behind the fixed ones; then the
    # held rows, the reflectors, and one vector.
    at = (3 * m + 2 * n + 1) * n
    W = work[:at].reshape((3 * m + 2 * n + 1, n))
    behind, base, held_at, V, X = m, 2 * m, 3 * m, 3 * m + n, 3 * m + 2 * n
    of_rows, at = work[at:at + 6 * m].reshape((6, m)), at + 6 * m
    of_columns, at = work[at:at + 7 * n].reshape((7, n)), at + 7 * n
    value, along, zero, miss, w = of_rows[0], of_rows[1], of_rows[2], of_rows[3], of_rows[4]
    beta, y, start, p, g, force = (of_columns[0], of_columns[1], of_columns[2], of_columns[3],
                                   of_columns[4], of_columns[5])
    scale, reference = of_rows[5], of_columns[6]
    of_row, of_block = work[at:at + 5 * m].view(np.int64).reshape((5, m)), work[at + 5 * m:]
    state, unit, soft, order, hard = of_row[0], of_row[1], of_row[2], of_row[3], of_row[4]
    if prepare(A, lower, upper, x, active, held, multiplier, scale) < 0:
        return finish(x, NUMERICAL_FAILURE)
    for c in range(n):
        reference[c], x[c] = x[c], 0.0
    for i in range(m):
        state[i], unit[i] = 0, _only_column(A, i)
        if active[i] != EQUAL:
            active[i] = 0.0
    fixed = first = ZERO
    doubtful = False
    for k in range(levels + 1):
        at_reference = k == levels
        last = first if at_reference else first + sizes[k]
        s = _take_soft(A, lower, upper, x, active, state, unit, scale, value, soft, first, last,
                       tolerance)
        if s == 0 and not at_reference:
            first = last
            continue
        for c in range(n):
            start[c] = x[c]
        _watch_parallel(A, unit, x, state, value, first)
        _reflect_soft(A, W, soft, ZERO, s, base, V, beta, ZERO, fixed)
        h = _hold_from(A, lower, upper, W, active, state, value, hard, ZERO,
                       _list_held(state, hard, first), held_at, V, beta, fixed, scale,
                       rank_tolerance)
        _copy_soft(W, ZERO, s, base, behind, V, beta, fixed, h)
        still = steps = ZERO
        damped = 0.0
        while True:
            if counts[1] >= max_iterations:
                counts[2] = k
                code = finish(x, SOLVED)
                return ITERATION_LIMIT if code == SOLVED else code
            counts[1] += 1
            bland = still > BLAND_AFTER
            # The best point that the held rows leave, as seen from where the stage began.
            _step_of_held(A, lower, upper, active, unit, start, W, hard, h, held_at, fixed, y)
            if at_reference:
                rank = _step_to_reference(W, V, X, beta, reference, start, y, g, fixed, h)
            else:
                rank, damped = _step_of_soft(A, lower, upper, active, unit, scale, start, W, soft,
                                             order, s, behind, V, beta, zero, miss, w, y, g, fixed,
                                             h, damping, threshold, rank_tolerance, damped,
                                             of_block)
            _back_to_x(W, V, X, beta, y, start, x, p, fixed, rank, at_reference)
            block, side, length = _first_block(A, lower, upper, state, unit, scale, value, along, x,
                                               p, last, tolerance, bland)
            still = still + 1 if length < 1e-12 else ZERO
            for c in range(n):
                x[c] += length * p[c]
            for i in range(last):
                if state[i] == WATCHED:
                    value[i] += length * along[i]
            if block >= 0:
                active[block] = side
                if block >= first:
                    state[block], soft[s] = SOFT, block
                    s += 1
                    _reflect_soft(A, W, soft, s - 1, s, base, V, beta, ZERO, fixed)
                    _copy_soft(W, s - 1, s, base, behind, V, beta, fixed, h)
                elif _hold(A, W, hard, h, block, held_at, V, beta, fixed, scale, rank_tolerance):
                    state[block] = HELD
                    h += 1
                    reflect_rows(W, beta, V, fixed + h - 1, fixed + h, behind, behind + s)
                else:
                    state[block], active[block] = PARALLEL, 0
                continue
            size = _norm(x)
            if at_reference:
                missed, sure, coarse, doubt = _pull_to_reference(x, reference, size,
                                                                 tolerance)
            else:
                missed, sure, coarse, doubt = _pull_of_soft(lower, upper, active, scale, soft,
                                                            order, s, w, size, tolerance)
            steps += 1
            inside = ROUNDING
            if steps > PATIENCE * (h + s + 1):
                sure, inside = max(sure, coarse), tolerance
            if missed:
                _forces(W, h, held_at, fixed, g, force)
            else:
                for q in range(h):
                    force[q] = 0.0
            drop = _worst_pull(lower, upper, active, scale, hard, h, force, soft, order, s, w, size,
                               sure, inside, bland)
            if drop < 0:
                break
            was = active[drop]
            value[drop] = _value(A, unit, x, drop)
            active[drop] = _side_missed(lower, upper, scale, value, drop, size, tolerance)
            if drop >= first and active[drop] == -was:
                continue  # beyond its other side now: it stays soft, and its target is that side
            active[drop], state[drop] = 0, WATCHED
            _watch_parallel(A, unit, x, state, value, last)
            if drop >= first:
                s = _without(W, soft, s, base, drop)
            else:
                place = _release(hard, h, drop)
                h = _hold_from(A, lower, upper, W, active, state, value, hard, place, h - 1,
                               held_at, V, beta, fixed, scale, rank_tolerance)
            _copy_soft(W, ZERO, s, base, behind, V, beta, fixed, h)
        doubtful |= _is_doubtful(W, scale, hard, h, held_at, force, soft, order, fixed, rank, sure,
                                 doubt)
        whole = _settle(lower, upper, active, state, held, multiplier, scale, hard, h, force, soft,
                        order, s, w, size, sure, tolerance, k)
        if whole and not at_reference:
            fixed = rank
        elif not at_reference:
            fixed = _fix_again(A, W, state, scale, hard, h, soft, s, V, beta, fixed, rank_tolerance)
        first = last
    doubtful |= grown(lower, upper, active, scale, x, reference)
    doubtful &= damping == 0.0  # damping is for such cases, and makes them well-posed
    code = finish(x, SOLVED)
    return INACCURATE if doubtful and code == SOLVED else code


@inlined
def _only_column(A, i):
    """The column of the only entry of row i that is not zero, -1 if there is not just one."""
    only = -1
    for c in range(A.shape[1]):
        if A[i, c] != 0.0:
            if only >= 0:
                return -1
            only = c
    return only


@inlined
def _value(A, unit, x, i):
    """Row i of A times x."""
    if unit[i] >= 0:
        return A[i, unit[i]] * x[unit[i]]
    total = 0.0
    for c in range(A.shape[1]):
        total += A[i, c] * x[c]
    return total


@inlined
def _norm(x):
    square = 0.0
    for c in range(x.size):
        square += x[c] * x[c]
    return np.sqrt(square)


@inlined
def _watch_parallel(A, unit, x, state, value, last):
    """Watch again the rows that were kept in place by held rows, as those are no more the same."""
    for i in range(last):
        if state[i] == PARALLEL:
            state[i], value[i] = WATCHED, _value(A, unit, x, i)


@inlined
def _side_missed(lower, upper, scale, value, i, size, tolerance):
    """+1 where row i is above its upper side, -1 where it is below its lower, 0 within."""
    if value[i] > upper[i] + tolerance * (scale[i] * size + abs(upper[i])):
        return 1
    if value[i] < lower[i] - tolerance * (scale[i] * size + abs(lower[i])):
        return -1
    return 0


@inlined
def _take_soft(A, lower, upper, x, active, state, unit, scale, value, soft, first, last, tolerance):
    """List the rows that a level misses or must meet; the others are watched. Return how many."""
    size, s = _norm(x), 0
    for i in range(first, last):
        value[i] = _value(A, unit, x, i)
        if active[i] != EQUAL:
            active[i] = _side_missed(lower, upper, scale, value, i, size, tolerance)
        state[i] = SOFT if active[i] != 0 else WATCHED
        if active[i] != 0:
            soft[s] = i
            s += 1
    return s


@inlined
def _reflect_soft(A, W, soft, q0, q1, base, V, beta, k0, k1):
    """Copy soft rows q0 .. q1 - 1 from A and apply reflectors k0 .. k1 - 1."""
    for q in range(q0, q1):
        for c in range(A.shape[1]):
            W[base + q, c] = A[soft[q], c]
    reflect_rows(W, beta, V, k0, k1, base + q0, base + q1)


@inlined
def _copy_soft(W, q0, q1, base, behind, V, beta, fixed, h):
    """Put soft rows, known behind the fixed rows, behind the held ones too."""
    for q in range(q0, q1):
        for c in range(W.shape[1]):
            W[behind + q, c] = W[base + q, c]
    reflect_rows(W, beta, V, fixed, fixed + h, behind + q0, behind + q1)


@inlined
def _without(W, soft, s, base, row):
    """Take a row out of the soft ones; the last takes its place. Return how many are left."""
    for q in range(s):
        if soft[q] == row:
            soft[q] = soft[s - 1]
            for c in range(W.shape[1]):
                W[base + q, c] = W[base + s - 1, c]
            break
    return s - 1


@inlined
def _hold(A, W, hard, h, i, held_at, V, beta, fixed, scale, rank_tolerance):
    """Hold row i behind h others, if it is independent of them and of the fixed rows."""
    at, k, n = held_at + h, fixed + h, A.shape[1]
    if k >= n:
        return False
    for c in range(n):
        W[at, c] = A[i, c]
    reflect_rows(W, beta, V, 0 * h, k, at, at + 1)
    square = 0.0
    for c in range(k, n):
        square += W[at, c] * W[at, c]
    if square <= (rank_tolerance * scale[i]) ** 2:
        return False
    make_reflector(W, beta, V, k, at, square)
    reflect_rows(W, beta, V, k, k + 1, at, at + 1)
    hard[h] = i
    return True


@inlined
def _list_held(state, hard, first):
    """List the rows in that state; return how many."""
    h = 0
    for i in range(first):
        if state[i] == HELD:
            hard[h] = i
            h += 1
    return h


@inlined
def _hold_from(A, lower, upper, W, active, state, value, hard, q, h, held_at, V, beta, fixed, scale,
               rank_tolerance):
    """Hold again the listed rows q .. h - 1 behind those before; return how many hold in all.

    A row that depends on those before it is watched instead.
    """
    at = q
    for place in range(q, h):
        i = hard[place]
        if _hold(A, W, hard, at, i, held_at, V, beta, fixed, scale, rank_tolerance):
            at += 1
        else:
            value[i] = upper[i] if active[i] > 0 else lower[i]
            state[i], active[i] = WATCHED, 0
    return at


@inlined
def _release(hard, h, row):
    """Take a row out of the list of held ones; return the place where it was."""
    place = 0
    while hard[place] != row:
        place += 1
    for q in range(place, h - 1):
        hard[q] = hard[q + 1]
    return place


@inlined
def _step_of_held(A, lower, upper, active, unit, start, W, hard, h, held_at, fixed, y):
    """Write the step that brings the held rows to their sides."""
    for q in range(h):
        i = hard[q]
        rest = (upper[i] if active[i] > 0 else lower[i]) - _value(A, unit, start, i)
        for c in range(fixed, fixed + q):
            rest -= W[held_at + q, c] * y[c]
        y[fixed + q] = rest / W[held_at + q, fixed + q]


@inlined
def _step_of_soft(A, lower, upper, active, unit, scale, start, W, soft, order, s, behind, V, beta,
                  zero, miss, w, y, g, fixed, h, damping, threshold, rank_tolerance, damped,
                  of_block):
    """Write the step of the level behind the held rows, what it still misses, and its pull.

    Returns the rank, and the damping of the stage, which grows only: so the stage remains convex,
    min ||what is missed||^2 + damped^2 ||the step from where the stage began||^2, and ends.
    """
    free = fixed + h
    for q in range(s):
        i = soft[q]
        order[q], zero[q] = q, (rank_tolerance * scale[i]) ** 2
        miss[q] = (upper[i] if active[i] > 0 else lower[i]) - _value(A, unit, start, i)
        for c in range(fixed, W.shape[1]):
            W[q, c] = W[behind + q, c]
        for c in range(fixed, free):
            miss[q] -= W[q, c] * y[c]
    rank = factor_level(W, order, zero, miss, beta, V, 0 * s, s, free)
    if damping > 0.0 and rank > free:
        damped = max(damped, variable_damping(W, 0 * s, s, free, rank, damping, threshold,
                                              of_block))
    solve_damped(W, miss, y, 0 * s, s, free, rank, damped, of_block)
    for c in range(h):
        g[c] = damped * damped * y[fixed + c]
    for q in range(s):
        w[q] = 0.0
        if s > rank - free or damping > 0.0:  # else the rows are independent, and met
            w[q] = -miss[q]
            for c in range(free, rank):
                w[q] += W[q, c] * y[c]
            for c in range(h):
                g[c] += w[q] * W[q, fixed + c]
    return rank, damped


@inlined
def _step_to_reference(W, V, X, beta, reference, start, y, g, fixed, h):
    """Write the step to the reference behind the held rows, and its pull on them."""
    n = W.shape[1]
    for c in range(n):
        W[X, c] = reference[c] - start[c]
    reflect_rows(W, beta, V, 0 * h, fixed + h, X, X + 1)
    for c in range(h):
        g[c] = y[fixed + c] - W[X, fixed + c]
    for c in range(fixed + h, n):
        y[c] = W[X, c]
    return fixed + h


@inlined
def _back_to_x(W, V, X, beta, y, start, x, p, fixed, rank, all_columns):
    """Write into p the way from x to start + Q y."""
    n = W.shape[1]
    end = n if all_columns else rank
    for c in range(n):
        W[X, c] = y[c] if fixed <= c < end else 0.0
    for k in range(rank - 1, -1, -1):
        reflect_rows(W, beta, V, k, k + 1, X, X + 1)
    for c in range(n):
        p[c] = start[c] + W[X, c] - x[c]


@inlined
def _first_block(A, lower, upper, state, unit, scale, value, along, x, p, last, tolerance, bland):
    """Find the watched row that x + t p meets first; return it, its side, and t. -1, 0, 1 if none.

    `along` receives the rows' speeds.
    """
    size = 0.0
    for c in range(x.size):
        size += (x[c] + p[c]) ** 2
    size = np.sqrt(size)
    block, side, length = -1, 0, 1.0
    for i in range(last):
        if state[i] != WATCHED:
            continue
        speed = along[i] = _value(A, unit, p, i)
        if speed == 0.0:
            continue
        bound = upper[i] if speed > 0.0 else lower[i]
        over = value[i] + speed - bound
        if speed < 0.0:
            over = -over
        if over <= tolerance * (scale[i] * size + abs(bound)) or not np.isfinite(bound):
            continue
        t = max((bound - value[i]) / speed, 0.0)
        if t < length and not (bland and block >= 0 and t >= length - 1e-12):
            block, side, length = i, (1 if speed > 0.0 else -1), t
    return block, side, length


@inlined
def _pull_of_soft(lower, upper, active, scale, soft, order, s, w, size, tolerance):
    """Whether a level is missed, and the size of multipliers that are sure, that are sure even if
    rows are nearly parallel, and that matter: -1 where the level is missed so slightly that it may
    be attainable.
    """
    noise = pulled = worst = 0.0
    for q in range(s):
        i = soft[order[q]]
        around = scale[i] * size + abs(upper[i] if active[i] > 0 else lower[i])
        noise = max(noise, scale[i] * around)
        pulled += abs(w[q]) * scale[i]
        if scale[i] > 0.0 and abs(w[q]) > worst * around:
            worst = abs(w[q]) / around
    return (worst > tolerance, max(tolerance * pulled, ROUNDING * noise), tolerance * noise,
            -1.0 if tolerance < worst < SLIGHT else DOUBT * pulled)


@inlined
def _pull_to_reference(x, reference, size, tolerance):
    """Like `_pull_of_soft`, for the last stage."""
    pulled = 0.0
    for c in range(x.size):
        pulled += (x[c] - reference[c]) ** 2
    pulled, noise = np.sqrt(pulled), max(size, _norm(reference))
    return (pulled > tolerance * noise, max(tolerance * pulled, ROUNDING * noise),
            tolerance * noise, DOUBT * pulled)


@inlined
def _is_doubtful(W, scale, hard, h, held_at, force, soft, order, fixed, rank, sure, doubt):
    """Whether a stage may be wrong: multipliers that matter cannot be told from rounding, the level
    may be attainable after all, or little is left of a row behind those before.
    """
    doubtful = doubt < 0.0 or (h > 0 and sure > doubt > 0.0)
    for q in range(h):
        doubtful |= sure < abs(force[q]) * scale[hard[q]] < doubt
        doubtful |= abs(W[held_at + q, fixed + q]) < NEARLY_PARALLEL * scale[hard[q]]
    for q in range(rank - fixed - h):
        doubtful |= abs(W[q, fixed + h + q]) < NEARLY_PARALLEL * scale[soft[order[q]]]
    return doubtful


@inlined
def _forces(W, h, held_at, fixed, g, force):
    """Write the multipliers of the held rows; g is used up."""
    for q in range(h - 1, -1, -1):
        force[q] = -g[q] / W[held_at + q, fixed + q]
        for c in range(q):
            g[c] += force[q] * W[held_at + q, fixed + c]


@inlined
def _worst_pull(lower, upper, active, scale, hard, h, force, soft, order, s, w, size, sure, inside,
                bland):
    """The row that holds x back the wrong way most, or by Bland's rule the first; -1 if none.

    How much is counted in `sure` for the held rows, and in `inside` times the size of its terms for
    a soft row that is within its side.
    """
    worst, drop = -1.0, -1
    for q in range(h + s):
        if q < h:
            i = hard[q]
            push = active[i] * force[q] * scale[i] / sure if sure > 0.0 else 0.0
        else:
            i = soft[order[q - h]]
            if active[i] == EQUAL:
                continue
            bound = upper[i] if active[i] > 0 else lower[i]
            around = inside * (scale[i] * size + abs(bound))
            push = active[i] * w[q - h] / around if around > 0.0 else 0.0
        if bland:
            if push < -1.0 and (drop < 0 or i < drop):
                drop = i
        elif push < worst:
            worst, drop = push, i
    return drop


@inlined
def _settle(lower, upper, active, state, held, multiplier, scale, hard, h, force, soft, order, s, w,
            size, sure, tolerance, k):
    """Make the rows that a stage decided equalities for good; return whether it decided all."""
    whole = True
    for q in range(h):
        i = hard[q]
        if active[i] * force[q] * scale[i] > sure:
            state[i], held[i], multiplier[i] = FIXED, k, force[q]
        else:
            whole = False
    for q in range(s):
        i = soft[order[q]]
        bound = upper[i] if active[i] > 0 else lower[i]
        if active[i] == EQUAL:
            state[i] = FIXED
        elif active[i] * w[q] > tolerance * (scale[i] * size + abs(bound)):
            state[i], held[i], multiplier[i] = FIXED, k, w[q]
        else:
            state[i] = HELD
            whole = False
    return whole


@inlined
def _fix_again(A, W, state, scale, hard, h, soft, s, V, beta, fixed, rank_tolerance):
    """Give reflectors to the rows just fixed, without those between them; return how many."""
    n = A.shape[1]
    for q in range(h + s):
        i = hard[q] if q < h else soft[q - h]
        if state[i] != FIXED or fixed >= n:
            continue
        for c in range(n):
            W[0, c] = A[i, c]
        reflect_rows(W, beta, V, 0 * h, fixed, 0 * h, 0 * h + 1)
        square = 0.0
        for c in range(fixed, n):
            square += W[0, c] * W[0, c]
        if square > (rank_tolerance * scale[i]) ** 2:
            make_reflector(W, beta, V, fixed, 0 * h, square)
            fixed += 1
    return fixed
