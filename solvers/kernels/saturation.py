"""The Task Priority Matrix with limits: joints that saturate leave the stack's columns.

A first level of bounds low <= x <= high, then levels of equalities. With the joints S at a bound,
what is left is a Task Priority Matrix on the columns of the others, x_F = J_F^# F (b - J_S x_S),
resolved by the staircase (`staircase.py`). S is found level by level:

1. Resolve the whole stack, with S of the tick before or none. Joints beyond a bound are clipped to
   it and saturate. From here on x keeps every bound.
2. Resolve the first open level behind the settled ones, which keep their place (their coordinates
   in y = Q^T x), and go there, up to the first bound in the way. That joint saturates: again 2.
3. If none was in the way, the free joints can do no more for this level. Of the saturated ones that
   hold it back the wrong way, by the sign of their multiplier, the worst is set free: again 2. If
   there are none, those that do hold it back stay for good, the level is settled, and the next one
   is resolved behind it. The last is the reference.

This is a primal active set on one convex problem a level: a step lowers what the level misses, and
cannot touch the settled levels, so no S comes back and it ends with the exact answer. Where steps
of length zero might go in circles joints are set free in order of their number (Bland), and after
PATIENCE no more: then at most n + L + 1 steps follow. A change of S factors the settled levels
again. To keep their reflectors and give each saturated joint one behind them is more to do at 7
joints (a sixth more time, measured) and less at 30 (up to a fifth).
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_block
from solvers.kernels.flat import factor_level, reflect_rows
from solvers.kernels.rows import (
    FREE,
    INACCURATE,
    NEARLY_PARALLEL,
    NUMERICAL_FAILURE,
    ROUNDING,
    SOLVED,
    TOO_SMALL,
    ZERO,
    finish,
)

NO_LIMITS = 9  # no value of solvers.Status: all rows are equalities, `staircase` is to be called
TOLERANCE = 1e-10  # of a level that is met, and of multipliers, relative to the terms they are of
PATIENCE = 5  # steps for each joint and level
BLAND_AFTER = 10  # steps of no length in a row
HALVINGS = 200  # bound; Newton's method needs 2 or 3 steps
# Vectors in W, behind the rows of A: Q^T x, Q^T reference, the way to go, beta of the reflectors,
# y, and the pull on y. Then come the reflectors.
PLACE, REFERENCE, WAY, BETA, Y, PULL, REFLECTORS = 0, 1, 2, 3, 4, 5, 6


@compiled
def saturation_work(m, n, levels):
    """Return how many numbers of work space a hierarchy of m rows needs."""
    return (2 * m + 2 * n + 14) * n + 5 * m + 2 * levels + 2


@compiled
def saturation(A, lower, upper, sizes, x, record, damping, threshold, rank_tolerance, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (n + L + 1,): comes in with the saturation to begin with, or zeros; goes out as what each
    joint does (-1 or +1: at its lower or upper bound, 2: both, 0: free), the scaling of each level,
    and the steps taken. work: at least saturation_work(m, n, L), of any content. Returns SOLVED,
    INACCURATE where PATIENCE ended or rows are nearly parallel, NUMERICAL_FAILURE, TOO_SMALL,
    NO_LIMITS, or -(i + 1) where row i is an inequality that is no bound of the first level.
    """
    m, n = A.shape
    levels, height = sizes.size, m + n + REFLECTORS
    if work.size < saturation_work(m, n, levels):
        return TOO_SMALL
    side, scaling = record[:n], record[n:n + levels]
    of_joints, at = work[:5 * n].reshape((5, n)), 5 * n
    low, high, reference = of_joints[0], of_joints[1], of_joints[2]
    pull, terms = of_joints[3], of_joints[4]
    of_rows, at = work[at:at + 3 * m].reshape((3, m)), at + 3 * m
    square, zero, miss = of_rows[0], of_rows[1], of_rows[2]
    indices = work[at:at + m + 2 * n + 2 * levels + 2].view(np.int64)
    at += indices.size
    row, order, held = indices[:m], indices[m:m + n], indices[m + n:m + 2 * n]
    of_levels = indices[m + 2 * n:].reshape((2, levels + 1))
    first, rank = of_levels[0], of_levels[1]
    room, of_block = work[at:at + height * n], work[at + height * n:]

    top = _first_with_rows(sizes)
    code = _load(A, lower, upper, sizes, top, x, low, high, square, row, scaling)
    if code != SOLVED:
        return code if code == NO_LIMITS else finish(x, code)
    for c in range(n):
        reference[c] = x[c]
        held[c] = _start(x, low, high, side, c)
    for k in range(top + 2):
        first[k], rank[k] = sizes[top], 0
    level, steps, still, share = top + 1, ZERO, ZERO, 0.0
    most = PATIENCE * (n + 1) * (levels + 1)
    while level <= levels and share >= 0.0:
        free = _put_free_first(side, order)
        W = room[:height * free].reshape((height, free))
        _see(x, reference, order, W, m)
        begin = level if steps > 0 else levels
        for k in range(top + 1, levels + 1):
            if k < levels:
                _resolve(A, upper, sizes, x, order, square, W, row, first, rank, zero, miss, k,
                         k < level, damping, threshold, rank_tolerance, of_block)
            if k < begin:
                continue
            share = (_go_to_bound(x, low, high, side, order, W, rank, k, m) if steps > 0
                     else _go_and_clip(x, low, high, side, order, W, rank, m))
            steps += 1
            still = still + 1 if share < ROUNDING else ZERO
            if share < 1.0:
                break
            while level <= k and _holds(A, upper, x, reference, side, held, square, W, row, first,
                                        rank, miss, pull, terms, level, damping,
                                        still > BLAND_AFTER, steps > most):
                level += 1
            if level <= k:
                break
    if share < 0.0:
        return finish(x, NUMERICAL_FAILURE)
    _scale(A, upper, sizes, top, x, square, scaling)
    record[n + levels] = steps
    doubtful = free < n and (steps > most or _nearly_parallel(W, row, first, rank, square))
    code = finish(x, SOLVED)
    return INACCURATE if code == SOLVED and doubtful and damping == 0.0 else code


@inlined
def _first_with_rows(sizes):
    """The first level that has rows."""
    top = ZERO
    while top < sizes.size and sizes[top] == 0:
        top += 1
    return top


@inlined
def _load(A, lower, upper, sizes, top, x, low, high, square, joint, scaling):
    """Check all data, and intersect the bounds of each joint; joint (m,): that of a bound's row."""
    m, n = A.shape
    end = sizes[top] if top < sizes.size else ZERO
    unequal = ZERO
    while unequal < m and lower[unequal] == upper[unequal]:
        unequal += 1
    if unequal == m:
        return NO_LIMITS
    if unequal >= end:
        return -(unequal + 1) if lower[unequal] < upper[unequal] else NUMERICAL_FAILURE
    sane, refused = True, ZERO
    for c in range(n):
        low[c], high[c] = -np.inf, np.inf
        sane &= np.isfinite(x[c])
    for k in range(sizes.size):
        scaling[k] = 1.0
    for i in range(m):
        square[i] = 0.0
        for c in range(n):
            square[i] += A[i, c] * A[i, c]
        sane &= (np.isfinite(square[i]) and lower[i] <= upper[i] and lower[i] < np.inf
                 and upper[i] > -np.inf)
        alone = i < end and _only_entry(A, joint, i)
        if alone:
            _bound(A, lower, upper, low, high, i, joint[i])
        elif refused == 0 and (i < end or lower[i] < upper[i]):
            refused = -(ZERO + i + 1)
    if not sane:
        return NUMERICAL_FAILURE
    if refused < 0:
        return _an_inequality(lower, upper, -refused - 1, end)
    for c in range(n):
        if low[c] > high[c]:
            scaling[top] = 0.0
            low[c] = high[c] = _least_violation(A, lower, upper, joint, end, c, high[c], low[c])
    return SOLVED


@inlined
def _only_entry(A, joint, i):
    """Whether row i has one entry that is not zero; joint[i] is its place."""
    entries = ZERO
    for c in range(A.shape[1]):
        if A[i, c] != 0.0:
            joint[i] = c
            entries += 1
    return entries == 1


@inlined
def _bound(A, lower, upper, low, high, i, c):
    """Take the bounds that row i puts on joint c."""
    one, other = lower[i] / A[i, c], upper[i] / A[i, c]
    low[c], high[c] = max(low[c], min(one, other)), min(high[c], max(one, other))


@inlined
def _an_inequality(lower, upper, i, end):
    """Refuse row i, or in its place, where it is an equality among bounds, the first bound."""
    for j in range(end):
        if lower[i] == upper[i] and lower[j] < upper[j]:
            return -(j + 1)
    return -(i + 1)


@inlined
def _least_violation(A, lower, upper, joint, end, c, below, above):
    """The place between two sides of a joint where all its bounds together are violated least.

    That is where the slope of the squared violation is zero: Newton's method, with halving.
    """
    place = 0.5 * (below + above)
    for _ in range(HALVINGS):
        slope = curvature = 0.0
        for i in range(end):
            if joint[i] == c:
                value = A[i, c] * place
                beyond = max(value - upper[i], 0.0) - max(lower[i] - value, 0.0)
                if beyond != 0.0:
                    slope += A[i, c] * beyond
                    curvature += A[i, c] * A[i, c]
        if slope > 0.0:
            above = place
        else:
            below = place
        best = place - slope / curvature if curvature > 0.0 else place
        if not below <= best <= above:
            best = 0.5 * (below + above)
        if best == place:
            break
        place = best
    return place


@inlined
def _start(x, low, high, side, c):
    """Put a joint on the bound where it is said to be; return whether it cannot leave it."""
    fixed = low[c] == high[c]
    if fixed or (side[c] > 0.0 and high[c] < np.inf):
        side[c], x[c] = 2.0 if fixed else 1.0, high[c]
    elif side[c] < 0.0 and low[c] > -np.inf:
        side[c], x[c] = -1.0, low[c]
    else:
        side[c], x[c] = FREE, 0.0
    return fixed


@inlined
def _put_free_first(side, order):
    """List the joints that are free, then the saturated ones; return how many are free."""
    free, behind = ZERO, side.size
    for c in range(side.size):
        if side[c] == FREE:
            order[free] = c
            free += 1
        else:
            behind -= 1
            order[behind] = c
    return free


@inlined
def _see(x, reference, order, W, m):
    """Begin Q^T x and Q^T reference."""
    for p in range(W.shape[1]):
        W[m + PLACE, p], W[m + REFERENCE, p] = x[order[p]], reference[order[p]]


@inlined
def _resolve(A, b, sizes, x, order, square, W, row, first, rank, zero, miss, k, settled, damping,
             threshold, rank_tolerance, of_block):
    """Resolve level k behind those above it, on the columns of the free joints.

    A settled level keeps its place. first, rank (L + 1,): where the rows of a level and its columns
    of Q begin. miss: what is left for these columns, in pivot order like row.
    """
    m, n = A.shape
    free, beta, y, V = W.shape[1], W[m + BETA], W[m + Y], m + REFLECTORS
    begin, end, above = first[k], first[k] + sizes[k], rank[k]
    for i in range(begin, end):
        row[i], zero[i], miss[i] = i, rank_tolerance * rank_tolerance * square[i], b[i]
        for p in range(free):
            W[i, p] = A[i, order[p]]
        for p in range(free, n):
            miss[i] -= A[i, order[p]] * x[order[p]]
    reflect_rows(W, beta, V, ZERO, above, begin, end)
    below = factor_level(W, row, zero, miss, beta, V, begin, end, above)
    reflect_rows(W, beta, V, above, below, m + PLACE, m + REFERENCE + 1)
    first[k + 1], rank[k + 1] = end, below
    if settled:
        for c in range(above, below):
            y[c] = W[m + PLACE, c]
    else:
        for i in range(begin, end):
            for c in range(above):
                miss[i] -= W[i, c] * y[c]
        solve_block(W, miss, y, begin, end, above, below, damping, threshold, of_block)


@inlined
def _back(W, rank, m):
    """Write Q times what is in the row of the way into that row."""
    for k in range(rank - 1, -1, -1):
        reflect_rows(W, W[m + BETA], m + REFLECTORS, k, k + 1, m + WAY, m + WAY + 1)


@inlined
def _go_and_clip(x, low, high, side, order, W, ranks, m):
    """Go to Q [y; rest of the reference]; what is beyond a bound is clipped to it and saturates.

    Return 1 where nothing was, 0 where something was, -1 at a number that is not finite.
    """
    share, rank = 1.0, ranks[ranks.size - 1]
    for c in range(W.shape[1]):
        W[m + PLACE, c] = W[m + Y, c] if c < rank else W[m + REFERENCE, c]
        W[m + WAY, c] = W[m + PLACE, c]
    _back(W, rank, m)
    for p in range(W.shape[1]):
        c, aim = order[p], W[m + WAY, p]
        x[c] = min(max(aim, low[c]), high[c])
        if not np.isfinite(aim):
            return -1.0
        if abs(aim - x[c]) > ROUNDING * abs(x[c]):
            side[c], share = 1.0 if aim > x[c] else -1.0, 0.0
    return share


@inlined
def _go_to_bound(x, low, high, side, order, W, rank, k, m):
    """Go to what level k wants, or for k = L the reference, up to the first bound in the way.

    That joint saturates. Return the share of the way; 1 where no bound was in the way, -1 at a
    number that is not finite.
    """
    at_reference = k == rank.size - 1
    above = rank[k]
    below = W.shape[1] if at_reference else rank[k + 1]
    for c in range(W.shape[1]):
        W[m + WAY, c] = 0.0
    for c in range(above, below):
        aim = W[m + REFERENCE, c] if at_reference else W[m + Y, c]
        W[m + WAY, c], W[m + PLACE, c] = aim - W[m + PLACE, c], aim
    _back(W, above if at_reference else below, m)
    block, share = -1, 1.0
    for p in range(W.shape[1]):
        c, step = order[p], W[m + WAY, p]
        if not np.isfinite(step):
            return -1.0
        bound = high[c] if step > 0.0 else low[c]
        if abs(step) - abs(bound - x[c]) > ROUNDING * (abs(bound) + abs(x[c])):
            there = abs(bound - x[c]) / abs(step)
            if there < share:
                block, share = p, there
    for p in range(W.shape[1]):
        c, step = order[p], W[m + WAY, p]
        x[c] = min(max(x[c] + share * step, low[c]), high[c])
        if p == block:
            x[c] = high[c] if step > 0.0 else low[c]
            side[c] = 1.0 if step > 0.0 else -1.0
    return share


@inlined
def _holds(A, b, x, reference, side, held, square, W, row, first, rank, miss, pull, terms, k,
           damping, bland, impatient):
    """Whether no saturated joint holds level k back the wrong way; else the worst is set free.

    held (n,): 1 where a joint holds a settled level back; -k where it was set free for level k,
    which with damping is done once only, as the signs of multipliers need not come right.
    """
    if W.shape[1] == x.size or not _pull_of_level(
            A, b, x, reference, square, W, row, first, rank, miss, pull, terms, k, damping):
        return True
    worst, most = -1, 0.0
    for c in range(x.size):
        if side[c] != FREE and held[c] != -k and held[c] <= 0:
            wrong = side[c] * pull[c]
            if wrong > TOLERANCE * terms[c] and wrong > most and not (bland and worst >= 0):
                worst, most = c, wrong
    if worst >= 0 and not impatient:
        side[worst] = FREE
        if damping > 0.0:
            held[worst] = -k
        return False
    for c in range(x.size):
        if -side[c] * pull[c] > TOLERANCE * terms[c]:
            held[c] = 1
    return True


@inlined
def _pull_of_level(A, b, x, reference, square, W, row, first, rank, miss, pull, terms, k, damping):
    """Write the derivative of half the squared violation of level k by each saturated joint.

    The free joints move along so that the levels above keep their place: it is minus the multiplier
    of the joint's bound. terms: the sizes that it is summed from. False where the level is met.
    """
    m, n = A.shape
    y, g = W[m + Y], W[m + PULL]
    at_reference = k == rank.size - 1
    if not at_reference and damping == 0.0 and first[k + 1] - first[k] == rank[k + 1] - rank[k]:
        return False
    missed = False
    size = noise = 0.0
    for c in range(n):
        pull[c] = x[c] - reference[c] if at_reference else 0.0
        terms[c] = abs(x[c]) + abs(reference[c]) if at_reference else 0.0
        missed |= abs(pull[c]) > TOLERANCE * terms[c]
        noise = max(noise, terms[c])
        size += x[c] * x[c]
    for c in range(rank[k]):
        g[c] = W[m + PLACE, c] - W[m + REFERENCE, c] if at_reference else 0.0
    if not at_reference:
        for q in range(first[k], first[k + 1]):
            i, w = row[q], -miss[q]
            for c in range(rank[k], rank[k + 1]):
                w += W[q, c] * y[c]
            around = np.sqrt(square[i] * size) + abs(b[i])
            missed |= abs(w) > TOLERANCE * around
            noise = max(noise, np.sqrt(square[i]) * around)
            for c in range(rank[k]):
                g[c] += w * W[q, c]
            for c in range(n):
                pull[c] += w * A[i, c]
                terms[c] += abs(w * A[i, c])
    if missed:
        for c in range(n):
            terms[c] += ROUNDING / TOLERANCE * noise
        _balance(A, W, row, first, rank, g, pull, terms, k)
    return missed


@inlined
def _balance(A, W, row, first, rank, g, pull, terms, k):
    """Add the forces of the rows above level k that balance g, the pull on their columns of Q."""
    for j in range(k - 1, -1, -1):
        for c in range(rank[j + 1] - 1, rank[j] - 1, -1):
            q = first[j] + c - rank[j]
            force = -g[c] / W[q, c]
            for d in range(c):
                g[d] += force * W[q, d]
            for d in range(pull.size):
                pull[d] += force * A[row[q], d]
                terms[d] += abs(force * A[row[q], d])


@inlined
def _nearly_parallel(W, row, first, rank, square):
    """Whether so little is left of a row behind those before it that x is worth a doubt."""
    nearly = False
    for k in range(rank.size - 1):
        for c in range(rank[k], rank[k + 1]):
            q = first[k] + c - rank[k]
            nearly |= W[q, c] * W[q, c] < NEARLY_PARALLEL * NEARLY_PARALLEL * square[row[q]]
    return nearly


@inlined
def _scale(A, b, sizes, top, x, square, scaling):
    """Write how much of its target each level gets: 1 - |A_k x - b_k| / |b_k|, not below zero."""
    size, begin = 0.0, ZERO + sizes[top]
    for c in range(x.size):
        size += x[c] * x[c]
    for k in range(top + 1, sizes.size):
        missed = asked = 0.0
        met = True
        for i in range(begin, begin + sizes[k]):
            over = -b[i]
            for c in range(x.size):
                over += A[i, c] * x[c]
            met &= abs(over) <= TOLERANCE * (np.sqrt(square[i] * size) + abs(b[i]))
            missed += over * over
            asked += b[i] * b[i]
        begin += sizes[k]
        if not met:
            scaling[k] = 1.0 - np.sqrt(missed / asked) if missed < asked else 0.0
