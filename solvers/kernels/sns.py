"""Saturation in the null space: task by task, joints that would pass a bound are saturated.

For task k (Flacco, De Luca, Khatib 2015) let x_{k-1} be the answer of the tasks above and P_{k-1}
the projector onto their null space. A diagonal W_k has ones for the joints that are not saturated,
Pbar_k = (I - ((I - W_k) P_{k-1})^#) P_{k-1} is the freedom of the remaining joints, and

    x_k(s) = x' + (J_k Pbar_k)^# (s b_k - J_k x'),   x' = x_{k-1} + ((I - W_k) P_{k-1})^# x_N,

x_N the steps of the saturated joints to their bounds. So x_k(s) = s a + c. While x_k(1) leaves the
box, the joint that leaves it at the smallest s, the most critical one, is saturated too; when
J_k Pbar_k loses rank, the set with the largest s is the answer. Each task starts with W_k = I.

No projector is formed here: saturated joints and the task have columns of Q, see `held`.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.block import solve_level
from solvers.kernels.held import (
    NO_JOINT,
    Held,
    carve_box,
    carve_held,
    hold,
    hold_again,
    side_of_box,
    to_reference,
)
from solvers.kernels.rows import ZERO, factor_level, finish, load_rows, reflect, reflect_back
from solvers.kernels.space import (
    Block,
    Rows,
    Settings,
    View,
    carve_rows,
    matrix,
    shared,
    vector,
)
from solvers.kernels.staircase import carve_staircase, climb
from solvers.kernels.tolerances import BOUND_KEPT
from solvers.status import CONTRADICTION, NUMERICAL_FAILURE, SOLVED, TOO_SMALL


class Options(NamedTuple):
    """The settings that all resolvers share, and two more.

    release: whether saturated joints are released. of_miss: whether s scales the residual of a
    task instead of b.
    """

    shared: Settings
    release: View
    of_miss: View


class Tasks(NamedTuple):
    """Rows of all levels below the bounds."""

    J: View
    lower: View
    upper: View
    sizes: View


class Task(NamedTuple):
    """The rows of one task: J (p, n), b (p,); zero (p,): squared norms that count as zero."""

    J: View
    b: View
    zero: View


class Columns(NamedTuple):
    """Ends of the columns of Q: of the tasks above, the saturated joints, the task."""

    above: View
    joints: View
    task: View


class Space(NamedTuple):
    """Intermediate results.

    held: saturated joints, and Q. kept: the reflectors of the tasks alone. rows: the factored rows
    of the task. seen (m, n): the same in Q, not factored. now (m,): J_k x_{k-1}. zero (m,): of all
    tasks. line (2, n): a and c of x_k(s) = s a + c. y_a (n,): a in Q. trial (1, n), best (n,):
    steps. of_block: work space of `solve_level`.
    """

    held: Held
    kept: View
    rows: Rows
    seen: View
    now: View
    zero: View
    line: View
    y_a: View
    trial: View
    best: View
    of_block: View


@inlined
def _carve(work, at, m, n):
    """Return Space for m rows of n joints, and where it ends."""
    held, at = carve_held(work, at, n)
    kept, at = matrix(work, at, n, n)
    rows, at = carve_rows(work, at, m, n)
    seen, at = matrix(work, at, m, n)
    now, at = vector(work, at, m)
    zero, at = vector(work, at, m)
    line, at = matrix(work, at, 2, n)
    y_a, at = vector(work, at, n)
    trial, at = matrix(work, at, 1, n)
    best, at = vector(work, at, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Space(held, kept, rows, seen, now, zero, line, y_a, trial, best, of_block), at


@compiled
def sns(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (n + L + 1,) on return: +1, -1, 2 where x is at its upper, lower, only bound, else 0; the
    scaling of each level; the number of saturated sets tried. settings: damping, threshold,
    rank_tolerance, and the rest of `Options`. work: any contents. Returns SOLVED,
    NUMERICAL_FAILURE, TOO_SMALL, CONTRADICTION with the row at the end of the record, or -(i + 1)
    if row i is an inequality that is not handled.
    """
    m, n = A.shape
    bounds = _bounds_above(lower, upper, sizes)
    tasks = Tasks(A[bounds:], lower[bounds:], upper[bounds:], sizes[min(bounds, 1):])
    box, at = carve_box(work, 0, n)
    _, of_equalities = carve_staircase(work, at, m - bounds, n)
    _, of_tasks = _carve(work, at, m - bounds, n)
    if max(of_equalities, of_tasks) > work.size:
        return TOO_SMALL
    for i in range(record.size):
        record[i] = 1.0 if i >= n else 0.0
    code = _read_box(A, lower, upper, bounds, box, record)
    if code < 0 or code == CONTRADICTION:
        return code
    if code != SOLVED:
        return finish(x, code)
    for c in range(n):
        box.reference[c] = x[c]
    if bounds == 0:
        code, _ = climb(A, lower, upper, sizes, x, settings, work[at:])
    else:
        code = _saturate(tasks, x, box, record[n + 1:], settings, work[at:])
    if code != SOLVED:
        return code - bounds if code < 0 else finish(x, code)
    _record_bounds(x, box, record)
    return finish(x, SOLVED)


@inlined
def _record_bounds(x, box, record):
    """Put x exactly on the bounds that it touches, and write which."""
    for c in range(x.size):
        if _touches(x[c], box.up[c]):
            x[c], record[c] = box.up[c], 2.0 if box.low[c] == box.up[c] else 1.0
        elif _touches(x[c], box.low[c]):
            x[c], record[c] = box.low[c], -1.0


@inlined
def _touches(x, side):
    """Whether x is at this side of the box, up to rounding."""
    return abs(side) < np.inf and abs(x - side) <= BOUND_KEPT * (1.0 + abs(side))


@inlined
def _bounds_above(lower, upper, sizes):
    """Return the number of rows of the first level if it has an inequality, else 0."""
    if sizes.size > 0:
        for i in range(sizes[0]):
            if lower[i] < upper[i]:
                return sizes[0]
    return ZERO


@inlined
def _read_box(A, lower, upper, bounds, box, record):
    """Write the sides of the box; return a code of `sns`."""
    for c in range(A.shape[1]):
        box.low[c], box.up[c] = -np.inf, np.inf
    refused = bounds  # the first inequality, if an equality of the level is no bound
    for i in range(bounds - 1, -1, -1):
        refused = i if lower[i] < upper[i] else refused
    for i in range(bounds):
        low, up = lower[i], upper[i]
        if not low <= up or low == np.inf or up == -np.inf:
            return NUMERICAL_FAILURE
        at, entries = 0, 0
        for c in range(A.shape[1]):
            if not np.isfinite(A[i, c]):
                return NUMERICAL_FAILURE
            if A[i, c] != 0.0:
                at, entries = c, entries + 1
        if entries != 1:
            return -((i if low < up else refused) + 1)
        low, up = low / A[i, at], up / A[i, at]
        box.low[at] = max(min(low, up), box.low[at])
        box.up[at] = min(max(low, up), box.up[at])
        if box.low[at] > box.up[at]:
            if box.low[at] - box.up[at] > BOUND_KEPT * (1.0 + abs(box.low[at])):
                record[record.size - 1] = i
                return CONTRADICTION
            box.low[at] = box.up[at]
    return SOLVED


@compiled
def _saturate(tasks, x, box, record, settings, work):
    """Solve level by level inside the box, then move to the reference; see `sns`."""
    m, n = tasks.J.shape
    space, _ = _carve(work, 0, m, n)
    options = Options(shared(settings), settings[3] > 0.0, settings[4] > 0.0)
    code = load_rows(space.rows.W, space.zero, tasks.J, tasks.lower, tasks.upper, box.reference,
                     options.shared.rank_tolerance)
    if code != SOLVED:
        return code
    for c in range(n):
        x[c] = min(max(0.0, box.low[c]), box.up[c])  # x_0, zero in the paper
    first = above = tried = ZERO
    for k in range(tasks.sizes.size):
        last = first + tasks.sizes[k]
        task = Task(tasks.J[first:last], tasks.lower[first:last], space.zero[first:last])
        record[k], above, sets = _level(task, x, box, space, above, options)
        first, tried = last, tried + sets
    steps = to_reference(space.held, box, x, space.line, above, options.release)
    record[tasks.sizes.size] = tried + steps
    return SOLVED


@inlined
def _level(task, x, box, space, above, options):
    """Move x by one task, in the columns of Q from `above` on.

    Returns its scaling, the columns of Q including those of the task alone, and the sets tried.
    """
    held, tolerance = space.held, options.shared.rank_tolerance
    seen = space.seen[:task.b.size]
    _begin(task, x, space)
    _see(task, held.basis, seen, above)
    rank, taken, largest, sets = above, ZERO, -1.0, 0
    while sets < 2 * x.size + 2:  # the basic form saturates at most n joints
        sets += 1
        begin = above + taken
        end = _factor(task, space, begin)  # J_k Pbar_k
        if sets == 1:
            rank = end
            _copy_reflectors(held.basis, space.kept, above, rank)
        elif end - begin < rank - above:  # rank(J_k Pbar_k) < rank(J_k P_{k-1})
            break
        at = Columns(above, begin, end)
        _write_line(task, x, space, at, options)
        s, critical = _scaling(space.line[0], space.line[1], box, held.side)
        if s >= max(largest, 0.0) and _improves(x, box, space, at, s):
            largest = s
        if options.release and _release(space, at, s if s >= 0.0 else 1.0):
            _see(task, held.basis, seen, above)
            taken = hold_again(held, seen, x, box, above, taken, tolerance)
            continue
        if s == 1.0 or critical == NO_JOINT:
            break
        taken = _hold_critical(critical, x, box, space, seen, at, tolerance)
        if above + taken == begin:  # tasks above and saturated joints already hold it
            break
    _copy_reflectors(space.kept, held.basis, above, rank)
    if largest >= 0.0:
        for j in range(x.size):
            x[j] = min(max(x[j] + space.best[j], box.low[j]), box.up[j])
    return max(largest, 0.0), rank, sets


@inlined
def _begin(task, x, space):
    """Start with no joint saturated, W_k = I; write the current value of the task."""
    for j in range(x.size):
        space.held.side[j] = 0.0
    for i in range(task.b.size):
        space.now[i] = inner_product(task.J[i], x)


@compiled
def _see(task, basis, seen, above):
    """Write the rows of the task, reflected by the columns of the tasks above."""
    for i in range(task.b.size):
        for j in range(seen.shape[1]):
            seen[i, j] = task.J[i, j]
    reflect(basis, ZERO, above, seen, ZERO, task.b.size)


@inlined
def _factor(task, space, begin):
    """Factor the task's rows after the first `begin` columns of Q; return where theirs end."""
    rows = space.rows
    for i in range(task.b.size):
        rows.row[i], rows.zero[i] = i, task.zero[i]
        for j in range(rows.W.shape[1]):
            rows.W[i, j] = space.seen[i, j]
    return factor_level(rows, space.held.basis, ZERO, task.b.size, begin)


@inlined
def _hold_critical(j, x, box, space, seen, at, least):
    """Saturate the critical joint; return the new number of saturated joints."""
    held, a, c = space.held, space.line[0], space.line[1]
    held.side[j] = 1.0 if a[j] + c[j] > box.up[j] else -1.0
    way = side_of_box(box, held, j) - x[j]
    return hold(held, seen, j, way, at.above, at.joints - at.above, least)


@compiled
def _write_line(task, x, space, at, options):
    """Write a and c with x_k(s) = s a + c, and their steps y_a and y in coordinates of Q.

    On entry y has the columns of the saturated joints.
    """
    rows, now, y, y_a, of_miss = space.rows, space.now, space.held.y, space.y_a, options.of_miss
    size, line = task.b.size, space.line
    block = Block(ZERO, size, at.joints, at.task)
    for i in range(size):
        rows.miss[i] = task.b[rows.row[i]] - (now[rows.row[i]] if of_miss else 0.0)
    solve_level(rows.W, rows.miss, y_a, block, options.shared, space.of_block)
    for i in range(size):
        rows.miss[i] = 0.0 if of_miss else -now[rows.row[i]]
        for k in range(at.above, at.joints):
            rows.miss[i] -= rows.W[i, k] * y[k]
    solve_level(rows.W, rows.miss, y, block, options.shared, space.of_block)
    for k in range(x.size):
        line[0, k] = y_a[k] if at.joints <= k < at.task else 0.0
        line[1, k] = y[k] if at.above <= k < at.task else 0.0
    reflect_back(space.held.basis, at.task, line, ZERO, ZERO + 2)
    for j in range(x.size):
        line[1, j] += x[j]


@inlined
def _copy_reflectors(source, target, k0, k1):
    """Copy reflectors k0 .. k1 - 1."""
    for k in range(k0, k1):
        for j in range(source.shape[1]):
            target[k, j] = source[k, j]


@inlined
def _improves(x, box, space, at, s):
    """Write the step to x_k(s), also as the best if it is in the box; return whether it is."""
    y, y_a, trial = space.held.y, space.y_a, space.trial
    for k in range(x.size):
        trial[0, k] = 0.0
        if at.above <= k < at.task:
            trial[0, k] = y[k] + s * y_a[k] if k >= at.joints else y[k]
    reflect_back(space.held.basis, at.task, trial, ZERO, ZERO + 1)
    inside = _fits(x, trial[0], box)
    if inside:
        for k in range(x.size):
            space.best[k] = trial[0, k]
    return inside


@inlined
def _fits(x, step, box):
    """Whether x + step is in the box, up to cancellation in a large step."""
    for j in range(x.size):
        low, up = box.low[j], box.up[j]
        if x[j] + step[j] > up + 10.0 * BOUND_KEPT * (1.0 + abs(up)):
            return False
        if x[j] + step[j] < low - 10.0 * BOUND_KEPT * (1.0 + abs(low)):
            return False
    return True


@compiled
def _scaling(a, c, box, side):
    """Return the largest s <= 1 with s a + c in the box, or -1, and the most critical joint.

    A joint that is outside at s = 1 is critical at the largest s at which it is inside; if all such
    joints enter only beyond s = 1, the last of them to enter is critical.
    """
    smallest, largest, critical, late = -np.inf, np.inf, NO_JOINT, NO_JOINT
    for j in range(a.size):
        if not np.isfinite(a[j] + c[j]):
            return -1.0, NO_JOINT
        if side[j] != 0.0:
            continue
        low, up = box.low[j], box.up[j]
        low = low - c[j] - BOUND_KEPT * (1.0 + abs(low)) if low > -np.inf else low
        up = up - c[j] + BOUND_KEPT * (1.0 + abs(up)) if up < np.inf else up
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
def _release(space, at, s):
    """Release saturated joints whose multiplier has the wrong sign; return whether there were any.

    The multipliers are those of the least ||x_k - x_{k-1}|| with J_k x_k and the joints as they
    are: y + F^T nu + E^T mu = 0, where mu must push a joint against its bound.
    """
    held, W, y_a = space.held, space.rows.W, space.y_a
    E, y, above, begin = held.E, held.y, at.above, at.joints
    size = 0.0
    for k in range(above, at.task):
        size = max(size, abs(y[k] + s * y_a[k]) if k >= begin else abs(y[k]))
    for k in range(at.task - 1, above - 1, -1):  # nu, then mu, take the place of y_a
        pull = -y[k] - s * y_a[k] if k >= begin else -y[k]
        for i in range(max(k + 1, begin), at.task):
            pull -= W[i - begin, k] * y_a[i]
        for i in range(k + 1, begin):
            pull -= E[i - above, k] * y_a[i]
        y_a[k] = pull / (W[k - begin, k] if k >= begin else E[k - above, k])
    wrong = False
    for t in range(begin - above):
        j = held.joint[t]
        if y_a[above + t] * held.side[j] < -BOUND_KEPT * size:
            held.side[j] = 0.0
            wrong = True
    return wrong
