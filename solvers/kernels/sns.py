"""Saturation in the null space: task after task, joints that would pass a bound taken out.

For task k (Flacco, De Luca, Khatib 2015) let x_{k-1} be the answer of the tasks above and P_{k-1}
the projector into their null space. A diagonal W_k has ones for the joints that are not saturated,
Pbar_k = (I - ((I - W_k) P_{k-1})^#) P_{k-1} is what tasks above and saturated joints leave, and

    x_k(s) = x' + (J_k Pbar_k)^# (s b_k - J_k x'),   x' = x_{k-1} + ((I - W_k) P_{k-1})^# x_N,

x_N being the ways of the saturated joints to their bounds. So x_k(s) = s a + c. While x_k(1) leaves
the box, the joint that leaves it at the smallest s, the most critical one, is saturated too; when
J_k Pbar_k loses rank, the set with the largest s is the answer. Each task begins with W_k = I.

No projector is formed here: saturated joints and the task have columns of Q, see `held`.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import solve_block
from solvers.kernels.flat import factor_level
from solvers.kernels.held import (
    NO_JOINT,
    SLACK,
    enter,
    hold,
    hold_again,
    leave,
    places,
    to_reference,
)
from solvers.kernels.rows import ZERO, finish, load_rows
from solvers.kernels.staircase import staircase
from solvers.status import NUMERICAL_FAILURE, SOLVED, TOO_SMALL

CONTRADICTION = 9  # no value of solvers.Status: two bounds of one unknown exclude each other


@compiled
def sns_work(m, n):
    """Return how many numbers of work space a hierarchy needs, m rows without the bounds."""
    return (2 * m + 3 * n + 9) * n + 5 * m + n + (m + n) * (n + 1) + 3 * n


@compiled
def sns(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (n + L + 1,) goes out as: +1, -1, 2 where x is at its upper, lower, only bound, else 0;
    the scaling of each level; the saturated sets tried. settings: damping, threshold,
    rank_tolerance, whether saturated joints are released, and whether s scales what a task misses
    in place of b. work: at least sns_work(m, n), of any content. Returns SOLVED, NUMERICAL_FAILURE,
    TOO_SMALL, CONTRADICTION with the row at the end of the record, or -(i + 1) where row i is an
    inequality that is not handled.
    """
    n = A.shape[1]
    bounds = _bounds_above(lower, upper, sizes)
    J, b, b_up, tasks = A[bounds:], lower[bounds:], upper[bounds:], sizes[min(bounds, 1):]
    size = sns_work(b.size, n)
    if work.size < size:
        return TOO_SMALL
    box = work[size - 3 * n:size].reshape((3, n))  # lower and upper side, and the reference
    for i in range(record.size):
        record[i] = 1.0 if i >= n else 0.0
    code = _read_box(A, lower, upper, bounds, box, record)
    if code < 0 or code == CONTRADICTION:
        return code
    if code != SOLVED:
        return finish(x, code)
    for c in range(n):
        box[2, c] = x[c]
    if bounds == 0:
        code = staircase(J, b, b_up, tasks, x, settings[0], settings[1], settings[2], work)
    else:
        code = _saturate(J, b, b_up, tasks, x, box, record[n + 1:], settings, work)
    if code != SOLVED:
        return code - bounds if code < 0 else finish(x, code)
    for c in range(n):
        if _touches(x[c], box[1, c]):
            x[c], record[c] = box[1, c], 2.0 if box[0, c] == box[1, c] else 1.0
        elif _touches(x[c], box[0, c]):
            x[c], record[c] = box[0, c], -1.0
    return finish(x, SOLVED)


@inlined
def _touches(x, side):
    """Whether x is at this side of the box, to rounding."""
    return abs(side) < np.inf and abs(x - side) <= SLACK * (1.0 + abs(side))


@inlined
def _bounds_above(lower, upper, sizes):
    """Rows of the first level if there is an inequality in it, else 0."""
    if sizes.size > 0:
        for i in range(sizes[0]):
            if lower[i] < upper[i]:
                return sizes[0]
    return ZERO


@inlined
def _read_box(A, lower, upper, bounds, box, record):
    """Write the sides of the box into box[:2]; returns as `sns`."""
    n = A.shape[1]
    for c in range(n):
        box[0, c], box[1, c] = -np.inf, np.inf
    refused = bounds  # the first inequality, where an equality beside it does not fit
    for i in range(bounds - 1, -1, -1):
        refused = i if lower[i] < upper[i] else refused
    for i in range(bounds):
        low, up = lower[i], upper[i]
        if not low <= up or low == np.inf or up == -np.inf:
            return NUMERICAL_FAILURE
        at, entries = 0, 0
        for c in range(n):
            if not np.isfinite(A[i, c]):
                return NUMERICAL_FAILURE
            if A[i, c] != 0.0:
                at, entries = c, entries + 1
        if entries != 1:
            return -((i if low < up else refused) + 1)
        low, up = low / A[i, at], up / A[i, at]
        box[0, at] = max(min(low, up), box[0, at])
        box[1, at] = min(max(low, up), box[1, at])
        if box[0, at] > box[1, at]:
            if box[0, at] - box[1, at] > SLACK * (1.0 + abs(box[0, at])):
                record[record.size - 1] = i
                return CONTRADICTION
            box[0, at] = box[1, at]
    return SOLVED


@compiled
def _saturate(J, b, b_up, sizes, x, box, record, settings, work):
    """Solve level after level inside the box, then go to the reference; see `sns`."""
    m, n = J.shape
    rows = 2 * m + 3 * n + 9
    W, at = work[:rows * n].reshape((rows, n)), rows * n
    of_rows, at = work[at:at + 4 * m].reshape((4, m)), at + 4 * m
    row, joint = work[at:at + m].view(np.int64), work[at + m:at + m + n].view(np.int64)
    of_block = work[at + m + n:]
    code = load_rows(W, of_rows[0], J, b, b_up, box[2], settings[2])
    if code != SOLVED:
        return code
    for c in range(n):
        x[c] = min(max(0.0, box[0, c]), box[1, c])  # x_0, which the paper takes to be zero
    first = above = tried = ZERO
    for k in range(sizes.size):
        last = first + sizes[k]
        record[k], above, sets = _level(J, b, x, box, W, of_rows, row, joint, first, last, above,
                                        settings, of_block)
        first, tried = last, tried + sets
    record[sizes.size] = tried + to_reference(m, x, box, W, joint, above, settings[3] > 0.0)
    return SOLVED


@compiled
def _level(J, b, x, box, W, of_rows, row, joint, first, last, above, settings, of_block):
    """Move x by one task: rows first .. last - 1 of J, behind columns 0 .. above - 1 of Q.

    Returns its scaling, the columns of Q with those of the task alone, and the sets tried.
    """
    m, n = J.shape
    V, S, E, U, X = places(m, n)
    a, c, y_a, y, best, trial = W[X], W[X + 1], W[X + 2], W[X + 3], W[X + 4], W[X + 8]
    beta, held = W[X + 5], W[X + 6]
    zero, miss, now = of_rows[1], of_rows[2], of_rows[3]
    for j in range(n):
        held[j] = 0.0
    for i in range(first, last):
        now[i] = 0.0
        for j in range(n):
            now[i] += J[i, j] * x[j]
    _see(J, W, beta, S, U, first, last, above)
    rank, taken, largest, sets = above, ZERO, -1.0, 0
    release = settings[3] > 0.0
    while sets < 2 * n + 2:  # the basic form saturates n joints at most
        sets += 1
        begin = above + taken
        for i in range(first, last):
            row[i], zero[i] = i, of_rows[0, i]
            for j in range(n):
                W[i, j] = W[S + i, j]
        end = factor_level(W, row, zero, miss, beta, U, first, last, begin)
        if sets == 1:
            rank = end
            _copy_reflectors(W, U, V, above, rank)
            for k in range(above, rank):
                W[X + 7, k] = beta[k]
        elif end - begin < rank - above:  # rank(J_k Pbar_k) < rank(J_k P_{k-1})
            break
        _line(b, x, W, beta, U, X, row, miss, now, first, last, above, begin, end, settings,
              of_block)
        s, critical = _scaling(a, c, box, held)
        if s >= max(largest, 0.0):
            for k in range(n):
                trial[k] = 0.0
                if above <= k < end:
                    trial[k] = y[k] + s * y_a[k] if k >= begin else y[k]
            leave(W, beta, U, end, X + 8, X + 9)
            if _fits(x, trial, box):
                largest = s
                for k in range(n):
                    best[k] = trial[k]
        at = s if s >= 0.0 else 1.0
        if release and _release(W, E, y, y_a, at, joint, held, first, above, begin, end):
            _see(J, W, beta, S, U, first, last, above)
            taken = hold_again(W, m, x, box, beta, y, held, joint, above, taken, first, last,
                               settings[2])
            continue
        if s == 1.0 or critical == NO_JOINT:
            break
        held[critical] = 1.0 if a[critical] + c[critical] > box[1, critical] else -1.0
        side = box[1, critical] if held[critical] > 0.0 else box[0, critical]
        taken = hold(W, m, beta, y, held, joint, critical, side - x[critical], above, taken, first,
                     last, settings[2])
        if above + taken == begin:  # tasks above and saturated joints hold it already
            break
    _copy_reflectors(W, V, U, above, rank)
    for k in range(above, rank):
        beta[k] = W[X + 7, k]
    if largest >= 0.0:
        for j in range(n):
            x[j] = min(max(x[j] + best[j], box[0, j]), box[1, j])
    return max(largest, 0.0), rank, sets


@compiled
def _line(b, x, W, beta, U, X, row, miss, now, first, last, above, begin, end, settings, of_block):
    """Write a, c with x_k(s) = s a + c and the steps y_a, y in Q behind them into W[X:X + 4].

    Columns above .. begin - 1 of y, those of the saturated joints, come in.
    """
    a, c, y_a, y = W[X], W[X + 1], W[X + 2], W[X + 3]
    of_miss = settings[4] > 0.0
    for i in range(first, last):
        miss[i] = b[row[i]] - (now[row[i]] if of_miss else 0.0)
    solve_block(W, miss, y_a, first, last, begin, end, settings[0], settings[1], of_block)
    for i in range(first, last):
        miss[i] = 0.0 if of_miss else -now[row[i]]
        for k in range(above, begin):
            miss[i] -= W[i, k] * y[k]
    solve_block(W, miss, y, first, last, begin, end, settings[0], settings[1], of_block)
    for k in range(a.size):
        a[k] = y_a[k] if begin <= k < end else 0.0
        c[k] = y[k] if above <= k < end else 0.0
    leave(W, beta, U, end, X, X + 2)
    for j in range(a.size):
        c[j] += x[j]


@inlined
def _see(J, W, beta, S, U, first, last, above):
    """Write the task's rows, as seen in the columns of the tasks above, into W[S:]."""
    for i in range(first, last):
        for j in range(J.shape[1]):
            W[S + i, j] = J[i, j]
    enter(W, beta, U, above, S + first, S + last)


@inlined
def _copy_reflectors(W, source, target, k0, k1):
    """Copy reflectors k0 .. k1 - 1."""
    for k in range(k0, k1):
        for j in range(k, W.shape[1]):
            W[target + k, j] = W[source + k, j]


@inlined
def _fits(x, step, box):
    """Whether x + step is in the box, to what cancellation in a large step leaves of it."""
    for j in range(x.size):
        low, up = box[0, j], box[1, j]
        if x[j] + step[j] > up + 10.0 * SLACK * (1.0 + abs(up)):
            return False
        if x[j] + step[j] < low - 10.0 * SLACK * (1.0 + abs(low)):
            return False
    return True


@compiled
def _scaling(a, c, box, held):
    """The largest s <= 1 for which s a + c is in the box, or -1, and the most critical joint.

    A joint that is out at s = 1 is critical at the largest s at which it is still in; where all
    such joints come in only beyond s = 1, the last of them to come in is.
    """
    smallest, largest, critical, late = -np.inf, np.inf, NO_JOINT, NO_JOINT
    for j in range(a.size):
        if not np.isfinite(a[j] + c[j]):
            return -1.0, NO_JOINT
        if held[j] != 0.0:
            continue
        low = box[0, j] - c[j] - SLACK * (1.0 + abs(box[0, j])) if box[0, j] > -np.inf else -np.inf
        up = box[1, j] - c[j] + SLACK * (1.0 + abs(box[1, j])) if box[1, j] < np.inf else np.inf
        if a[j] != 0.0:
            s_min, s_max = min(low / a[j], up / a[j]), max(low / a[j], up / a[j])
        else:
            inside = low <= 0.0 <= up
            s_min, s_max = -np.inf, np.inf if inside else -np.inf
        if s_max < largest:
            largest, critical = s_max, j
        if s_min > smallest:
            smallest, late = s_min, j
    if largest >= 1.0:
        critical = late if smallest > 1.0 else NO_JOINT
    feasible = smallest <= largest and largest >= 0.0 and smallest <= 1.0
    return (min(largest, 1.0) if feasible else -1.0), critical


@compiled
def _release(W, E, y, y_a, s, joint, held, first, above, begin, end):
    """Release the saturated joints whose multiplier has the wrong sign; return whether any had.

    The multipliers are those of the least ||x_k - x_{k-1}|| with J_k x_k and the joints as they
    are: y + F^T nu + E^T mu = 0, where mu must push a joint against its bound.
    """
    size = 0.0
    for k in range(above, end):
        size = max(size, abs(y[k] + s * y_a[k]) if k >= begin else abs(y[k]))
    for k in range(end - 1, above - 1, -1):  # nu, then mu, take the place of y_a
        pull = -y[k] - s * y_a[k] if k >= begin else -y[k]
        for i in range(max(k + 1, begin), end):
            pull -= W[first + i - begin, k] * y_a[i]
        for i in range(k + 1, begin):
            pull -= W[E + i - above, k] * y_a[i]
        y_a[k] = pull / (W[first + k - begin, k] if k >= begin else W[E + k - above, k])
    wrong = False
    for t in range(begin - above):
        if y_a[above + t] * held[joint[t]] < -SLACK * size:
            held[joint[t]] = 0.0
            wrong = True
    return wrong

