"""Saturation in the null space: task by task, joints that would pass a bound are saturated.

Of task k, x_k(s) = s a + c (Flacco, De Luca, Khatib 2015; docs/theory/sns.md). While x_k(1) leaves
the box, the joint that leaves it at the smallest s, the most critical one, is saturated too; when
J_k Pbar_k, the rows of the task in the freedom P_{k-1} of the tasks above without the saturated
joints, loses rank, the set with the largest s is the answer. Each task starts with none saturated.
No projector is formed here: saturated joints and the task have columns of Q, see `Space`.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product, internal
from solvers.kernels.box import first_level, narrow, refused
from solvers.kernels.linalg.block import solve_level
from solvers.kernels.linalg.rows import (
    all_equal,
    factor_level,
    finish,
    finish_unless_missed,
    has_outlier,
    length_of,
    load_rows,
    make_reflector,
    reflect,
    reflect_back,
)
from solvers.kernels.linalg.space import (
    Block,
    assign,
    carve_rows,
    fill,
    integers,
    matrix,
    shared,
    vector,
)
from solvers.kernels.staircase import carve_staircase, climb
from solvers.kernels.tolerances import BOUND_KEPT, NEGLIGIBLE
from solvers.status import CONTRADICTION, SOLVED, TOO_SMALL

NO_JOINT = -1

Task = namedtuple("Task", "J b zero")
"""The rows of one task: J (p, n), b (p,); zero (p,): squared norms that count as zero."""

Columns = namedtuple("Columns", "above joints task")
"""Ends of the columns of Q: of the tasks above, the saturated joints, the task."""

Space = namedtuple(
    "Space", "shared release of_miss low up reference unit basis E joint side y rows seen now zero"
    " line y_a trial best of_block")
"""Settings, the box, and intermediate results.

release: whether saturated joints are released. of_miss: whether s scales the residual of a
task instead of b. low, up, reference (n,). unit (1,): the largest |bound|, at most 1.

Q has columns for the tasks above, then one for each held joint in the order of holding; the
rest is free. basis: its reflectors. E (n, n): unit vectors of the held joints, in coordinates
of Q. joint (n,): their indices. side (n,): +1, -1 for a joint held at its upper, lower bound,
else 0. y (n,): the step in each column of Q.

rows: the factored rows of the task. seen (m, n): the same in Q, not factored. now (m,):
J_k x_{k-1}. zero (m,): of all tasks. line (2, n): a and c of x_k(s) = s a + c. y_a (n,): a in
Q. trial (1, n), best (n,): steps. of_block: work space of `solve_level`.
"""


@inlined
def _carve(settings, work, m, n):
    """Return Space for m rows of n joints, and where it ends; the box takes the first 3 n."""
    low, at = vector(work, 0, n)
    up, at = vector(work, at, n)
    reference, at = vector(work, at, n)
    unit, at = vector(work, at, 1)
    basis, at = matrix(work, at, n, n)
    E, at = matrix(work, at, n, n)
    joint, at = integers(work, at, n)
    side, at = vector(work, at, n)
    y, at = vector(work, at, n)
    rows, at = carve_rows(work, at, m, n)
    seen, at = matrix(work, at, m, n)
    now, at = vector(work, at, m)
    zero, at = vector(work, at, m)
    line, at = matrix(work, at, 2, n)
    y_a, at = vector(work, at, n)
    trial, at = matrix(work, at, 1, n)
    best, at = vector(work, at, n)
    of_block, at = vector(work, at, (m + n) * (n + 1))
    return Space(shared(settings), settings[3] > 0.0, settings[4] > 0.0, low, up, reference, unit,
                 basis, E, joint, side, y, rows, seen, now, zero, line, y_a, trial, best,
                 of_block), at


@compiled
def sns(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (n + L + 1,) on return: +1, -1, 2 where x is at its upper, lower, only bound, else 0; the
    scaling of each level; the number of saturated sets tried. settings: damping, threshold,
    rank_tolerance, release, of_miss. work: any contents. Returns SOLVED,
    NUMERICAL_FAILURE, TOO_SMALL, CONTRADICTION with the row at the end of the record, or -(i + 1)
    if row i is an inequality that is not handled.
    """
    m, n = A.shape
    top, bounds = first_level(sizes)
    below = top + 1
    if all_equal(lower[:bounds], upper[:bounds]):
        bounds, below = 0, top
    _, of_equalities = carve_staircase(work, 3 * n, m - bounds, n)
    space, of_tasks = _carve(settings, work, m - bounds, n)
    if max(of_equalities, of_tasks) > work.size:
        return TOO_SMALL
    fill(record[:n], 0.0)
    fill(record[n:], 1.0)
    code = _read_box(A[:bounds], lower[:bounds], upper[:bounds], space, record)
    if code < 0 or code == CONTRADICTION:
        return code
    if code != SOLVED:
        return finish(x, code)
    assign(space.reference, x)
    if bounds == 0:
        code, least = climb(A, lower, upper, sizes, x, settings, work[3 * n:])
        light = least == 0.0
    else:
        code = _saturate(A[bounds:], lower[bounds:], upper[bounds:], sizes[below:], x, space,
                         record[n + below:])
        light = has_outlier(space.zero, NEGLIGIBLE * NEGLIGIBLE)
    if code != SOLVED:
        return code - bounds if code < 0 else finish(x, code)
    _record_bounds(x, space, record)
    return finish_unless_missed(light, A[bounds:], lower[bounds:], sizes[below:], x, settings[0])


@inlined
def _record_bounds(x, space, record):
    """Put x exactly on the bounds that it touches, and write which."""
    for c in range(x.size):
        if _touches(x[c], space.up[c], space):
            x[c], record[c] = space.up[c], 2.0 if space.low[c] == space.up[c] else 1.0
        elif _touches(x[c], space.low[c], space):
            x[c], record[c] = space.low[c], -1.0


@inlined
def _touches(x, side, space):
    """Whether x is at this side of the box, up to rounding."""
    return abs(side) < np.inf and abs(x - side) <= _rounding(side, space)


@inlined
def _rounding(side, space):
    """How far beyond this side of the box x may be."""
    return BOUND_KEPT * (space.unit[0] + abs(side))


@inlined
def _read_box(A, lower, upper, space, record):
    """Write the sides of the box, of a level of bounds; return a code of `sns`."""
    low, up, code = space.low, space.up, refused(A, lower, upper, lower.size)
    fill(low, -np.inf)
    fill(up, np.inf)
    for i in range(lower.size if code == SOLVED else 0):
        c = narrow(low, up, A[i], lower[i], upper[i])
        if low[c] > up[c] and low[c] - up[c] > BOUND_KEPT * (1.0 + abs(low[c])):
            record[record.size - 1] = i
            return CONTRADICTION
        low[c] = min(low[c], up[c])
    largest = 0.0
    for c in range(low.size):
        largest = max(largest, abs(low[c]), abs(up[c]))
    space.unit[0] = min(largest, 1.0)
    return code


@internal
def _saturate(J, lower, upper, sizes, x, space, record):
    """Solve level by level inside the box, then move to the reference; see `sns`."""
    code = load_rows(space.rows.W, space.zero, J, lower, upper, space.reference,
                     space.shared.rank_tolerance)
    if code != SOLVED:
        return code
    for c in range(x.size):
        x[c] = min(max(0.0, space.low[c]), space.up[c])  # x_0, zero in the paper
    first = above = tried = 0
    for k in range(sizes.size):
        last = first + sizes[k]
        task = Task(J[first:last], lower[first:last], space.zero[first:last])
        record[k], above, sets = _level(task, x, space, above)
        first, tried = last, tried + sets
    record[sizes.size] = tried + _to_reference(space, x, above)
    return SOLVED


@inlined
def _level(task, x, space, above):
    """Move x by one task, in the columns of Q from `above` on.

    Returns its scaling, the columns of Q including those of the task alone, and the sets tried.
    """
    seen = space.seen[:task.b.size]
    fill(space.side, 0.0)
    for i in range(task.b.size):
        space.now[i] = inner_product(task.J[i], x)
    _see(task, space.basis, seen, above)
    rank, taken, largest, sets = above, 0, -1.0, 0
    while sets < 2 * x.size + 2:  # the basic form saturates at most n joints
        sets += 1
        begin = above + taken
        end = _factor(task, space, begin)  # J_k Pbar_k
        if sets == 1:
            rank = end
        elif end - begin < rank - above:  # rank(J_k Pbar_k) < rank(J_k P_{k-1})
            break
        at = Columns(above, begin, end)
        _write_line(task, x, space, at)
        s, critical = _scaling(space)
        if s >= max(largest, 0.0) and _improves(x, space, at, s):
            largest = s
        if space.release and _release(space, at, s if s >= 0.0 else 1.0, False):
            _see(task, space.basis, seen, above)
            taken = _hold_again(space, seen, x, above, taken)
            continue
        if s == 1.0 or critical == NO_JOINT:
            break
        beyond = space.line[0, critical] + space.line[1, critical] > space.up[critical]
        space.side[critical] = 1.0 if beyond else -1.0
        taken = _hold(space, seen, critical, x, above, taken)
        if above + taken == begin:  # tasks above and saturated joints already hold it
            break
    if sets > 1:  # back to the columns of the task alone
        _see(task, space.basis, seen, above)
        _factor(task, space, above)
    if largest >= 0.0:
        for j in range(x.size):
            x[j] = min(max(x[j] + space.best[j], space.low[j]), space.up[j])
    return max(largest, 0.0), rank, sets


@internal
def _see(task, basis, seen, above):
    """Write the rows of the task, reflected by the columns of the tasks above."""
    for i in range(task.b.size):
        assign(seen[i], task.J[i])
    reflect(basis, 0, above, seen, 0, task.b.size)


@inlined
def _factor(task, space, begin):
    """Factor the task's rows after the first `begin` columns of Q; return where theirs end."""
    rows = space.rows
    for i in range(task.b.size):
        rows.row[i], rows.zero[i] = i, task.zero[i]
        assign(rows.W[i], space.seen[i])
    return factor_level(rows, space.basis, 0, task.b.size, begin)


@internal
def _write_line(task, x, space, at):
    """Write a and c with x_k(s) = s a + c, and their steps y_a and y in coordinates of Q.

    On entry y has the columns of the saturated joints.
    """
    rows, now, y, y_a, of_miss = space.rows, space.now, space.y, space.y_a, space.of_miss
    size, line = task.b.size, space.line
    block = Block(0, size, at.joints, at.task)
    for i in range(size):
        rows.miss[i] = task.b[rows.row[i]] - (now[rows.row[i]] if of_miss else 0.0)
    solve_level(rows.W, rows.miss, y_a, block, space.shared, space.of_block)
    for i in range(size):
        rows.miss[i] = 0.0 if of_miss else -now[rows.row[i]]
        for k in range(at.above, at.joints):
            rows.miss[i] -= rows.W[i, k] * y[k]
    solve_level(rows.W, rows.miss, y, block, space.shared, space.of_block)
    for k in range(x.size):
        line[0, k] = y_a[k] if at.joints <= k < at.task else 0.0
        line[1, k] = y[k] if at.above <= k < at.task else 0.0
    reflect_back(space.basis, 0, at.task, line, 0, 2)
    for j in range(x.size):
        line[1, j] += x[j]


@inlined
def _improves(x, space, at, s):
    """Write the step to x_k(s), also as the best if it is in the box; return whether it is.

    Up to cancellation in a large step.
    """
    y, y_a, trial, inside = space.y, space.y_a, space.trial, True
    for k in range(x.size):
        trial[0, k] = 0.0
        if at.above <= k < at.task:
            trial[0, k] = y[k] + s * y_a[k] if k >= at.joints else y[k]
    reflect_back(space.basis, 0, at.task, trial, 0, 1)
    for j in range(x.size):
        low, up, value = space.low[j], space.up[j], x[j] + trial[0, j]
        inside = inside and not value > up + 10.0 * _rounding(up, space)
        inside = inside and not value < low - 10.0 * _rounding(low, space)
    if inside:
        assign(space.best, trial[0])
    return inside


@internal
def _scaling(space):
    """Return the largest s <= 1 with s a + c in the box, or -1, and the most critical joint.

    A joint that is outside at s = 1 is critical at the largest s at which it is inside; if all such
    joints enter only beyond s = 1, the last of them to enter is critical.
    """
    a, c, side = space.line[0], space.line[1], space.side
    smallest, largest, critical, late = -np.inf, np.inf, NO_JOINT, NO_JOINT
    for j in range(a.size):
        if not np.isfinite(a[j] + c[j]):
            return -1.0, NO_JOINT
        if side[j] != 0.0:
            continue
        low, up = space.low[j], space.up[j]
        low = low - c[j] - _rounding(low, space) if low > -np.inf else low
        up = up - c[j] + _rounding(up, space) if up < np.inf else up
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


@internal
def _release(space, at, s, alone):
    """Release saturated joints whose multiplier has the wrong sign; return whether there were any.

    The multipliers are those of the least ||x_k - x_{k-1}|| with J_k x_k and the joints as they
    are: y + F^T nu + E^T mu = 0, where mu must push a joint against its bound. alone: whether only
    the worst is released.
    """
    W, E, y, y_a, above, begin = space.rows.W, space.E, space.y, space.y_a, at.above, at.joints
    size, worst, wrong = 0.0, 0.0, NO_JOINT
    for k in range(above, at.task):
        size = max(size, abs(y[k] + s * y_a[k]) if k >= begin else abs(y[k]))
    for k in range(at.task - 1, above - 1, -1):  # nu, then mu, take the place of y_a
        pull = -y[k] - s * y_a[k] if k >= begin else -y[k]
        for i in range(max(k + 1, begin), at.task):
            pull -= W[i - begin, k] * y_a[i]
        for i in range(k + 1, begin):
            pull -= E[i - above, k] * y_a[i]
        y_a[k] = pull / (W[k - begin, k] if k >= begin else E[k - above, k])
    for t in range(begin - above - 1, -1, -1):
        push = y_a[above + t] * space.side[space.joint[t]]
        if push < worst - BOUND_KEPT * size:
            wrong, worst = space.joint[t], push if alone else 0.0
            space.side[wrong] = space.side[wrong] if alone else 0.0
    if wrong != NO_JOINT:
        space.side[wrong] = 0.0
    return wrong != NO_JOINT


@internal
def _hold(space, seen, j, x, above, count):
    """Give joint j, whose side is written, a column of Q, and write its step to that bound into y.

    seen: the rows of a task in coordinates of Q, reflected too. Returns the number of held joints:
    still `count` if the remainder of its unit vector is at most `rank_tolerance`.
    """
    k, e, basis = above + count, space.E[count], space.basis
    fill(e, 0.0)
    e[j] = 1.0
    reflect(basis, 0, k, space.E, count, count + 1)
    square = inner_product(e[k:], e[k:])
    if not square > space.shared.rank_tolerance**2:
        space.side[j] = 0.0
        return count
    make_reflector(basis, k, e, square)
    reflect(basis, k, k + 1, space.E, count, count + 1)
    reflect(basis, k, k + 1, seen, 0, seen.shape[0])
    way = (space.up[j] if space.side[j] > 0.0 else space.low[j]) - x[j]
    space.y[k] = (way - inner_product(e[above:k], space.y[above:])) / e[k]
    space.joint[count] = j
    return count + 1


@internal
def _hold_again(space, seen, x, above, count):
    """Give columns of Q to the joints among the first `count` that remain held; see `_hold`."""
    holding = 0
    for t in range(count):
        j = space.joint[t]
        if space.side[j] != 0.0:
            holding = _hold(space, seen, j, x, above, holding)
    return holding


@internal
def _to_reference(space, x, rank):
    """Move x inside the box, in the columns of Q that no task has; return the number of steps.

    Without release: by the reference minus x_0 as far as the bounds allow, holding joints that
    reach one. With release: to the x nearest to the reference.
    """
    n, ways, release = x.size, space.line, space.release
    d, target, no_rows = ways[0], ways[1], ways[:0]
    for j in range(n):
        start = min(max(0.0, space.low[j]), space.up[j])  # x_0
        space.side[j], target[j] = 0.0, space.reference[j] + (0.0 if release else x[j] - start)
    count, steps = 0, 0
    while steps < 4 * n + 2:
        steps += 1
        begin = rank + count
        for j in range(n):
            d[j] = target[j] - x[j]
        reflect(space.basis, 0, begin, ways, 0, 1)
        for k in range(begin):  # the step that joints and tasks take from the way to the target
            space.y[k], d[k] = -d[k], 0.0
        reflect_back(space.basis, 0, begin, ways, 0, 1)
        stopped = _step(x, d, space)
        if stopped != NO_JOINT:
            space.side[stopped] = 1.0 if d[stopped] > 0.0 else -1.0
            count = _hold(space, no_rows, stopped, x, rank, count)
            if rank + count == begin:
                break
        elif release and _release(space, Columns(rank, begin, begin), 0.0, True):
            count = _hold_again(space, no_rows, x, rank, count)
        else:
            break
    return steps


@inlined
def _step(x, d, space):
    """Move x along d as far as the box allows, at most x + d; return the joint that stops it.

    One that would not be held, so little of it is left by the tasks, stops nothing.
    """
    side, share, stopped = space.side, 1.0, NO_JOINT
    least = space.shared.rank_tolerance * length_of(d)
    for j in range(x.size):
        if side[j] == 0.0 and abs(d[j]) > least:
            room = (space.up[j] if d[j] > 0.0 else space.low[j]) - x[j]
            if room / d[j] < share:
                share, stopped = room / d[j], j
    for j in range(x.size):
        if side[j] == 0.0:
            x[j] = min(max(x[j] + share * d[j], space.low[j]), space.up[j])
    if stopped != NO_JOINT:
        x[stopped] = space.up[stopped] if d[stopped] > 0.0 else space.low[stopped]
    return stopped
