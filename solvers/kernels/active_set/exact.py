"""The exact solve: find a working set, verify it, and search on where that fails.

Python, batches and the C library call this one kernel. The working set comes from the memory of an
earlier solve, or from a pass level by level, which goes on from the memory where that violates no
row; where that is no proof and rows are nearly dependent, a second pass counts these as
independent. It is factored anew and pivoted in blocks, at the end row by row. After each of these
the claims are verified, and nothing is SOLVED otherwise.
"""

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product, internal
from solvers.kernels.active_set.levels import pass_through_levels
from solvers.kernels.active_set.multipliers import write_multipliers
from solvers.kernels.active_set.search import pivot_in_blocks, pivot_one_by_one, save
from solvers.kernels.active_set.tableau import STEPS, carve_tableau
from solvers.kernels.active_set.verification import neglects, verify
from solvers.kernels.active_set.working_set import (
    CUT,
    FINISHED,
    FIRST,
    INDICES,
    LOWER,
    NEGLECTED,
    NORM,
    NUMBERS,
    REFERENCE,
    SCALE,
    SOUND,
    STATE,
    UPPER,
    carve_working_set,
    load,
    meet,
    product_with,
    rescale,
    restore,
    take_up,
)
from solvers.kernels.active_set.working_set import TOLERANCE as RANK
from solvers.kernels.damping import carve_damped, damp_level, keep_reached, open_damped
from solvers.kernels.linalg.rows import all_equal, finish, length_of
from solvers.kernels.linalg.space import assign, fill, matrix, vector
from solvers.kernels.staircase import solve_by_staircase
from solvers.kernels.tolerances import (
    BAND,
    DEARER,
    INDEPENDENT,
    LARGER,
    LEVEL_MET,
    PASS_STEPS,
    PATIENCE,
    SOLVE_STEPS,
)
from solvers.status import (
    EQUAL,
    FREE,
    INACCURATE,
    ITERATION_LIMIT,
    NUMERICAL_FAILURE,
    SOLVED,
    TOO_SMALL,
    UNPROVED,
)

DAMPING, RANK_TOLERANCE, TOLERANCE, MOST = 0, 2, 3, 4  # places in the settings of `Hcod`


@inlined
def exact_size(n, m, levels):
    """Return the numbers that `open_working_set` and `answer` need."""
    of_set = (NUMBERS + INDICES) * max(m, n, levels + 1) + 16 + 3 * m * n + n * n
    of_tableau = 16 + n * (m + n) + (m + n) * (n + 3)
    return (2 * levels + 2) * m + n + of_set + of_tableau + m * (n + 2)


@inlined
def work_size(n, m, levels, damped):
    """Return the numbers that a work space of `solve_hierarchy` needs, with damping or without."""
    if not damped:
        return n + exact_size(n, m, levels)
    of_damped = (3 * m + n) * (n + 3) + 4 * levels + n + (m + n) * (n + 3) + (m + n) * (n + 1)
    return of_damped + 3 * (m + n) + 2 * n + 16 + exact_size(n, m + n, levels)


@compiled
def solve_hierarchy(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record (3 m + 3,): see `ActiveSetResolution`; on entry that of an earlier solve, or zeros.
    settings: those of `Hcod`, in one array because each argument costs time. work: any contents.
    Equalities alone are solved by the staircase, where its pivots are clear, with damping; for
    damping beside inequalities see `solve_damped`. Returns SOLVED, INACCURATE, ITERATION_LIMIT,
    NUMERICAL_FAILURE or TOO_SMALL.
    """
    n = x.size
    if n + exact_size(n, lower.size, sizes.size) > work.size:
        return TOO_SMALL
    code = solve_equalities(A, lower, upper, sizes, x, record, settings, work)
    if code != UNPROVED:
        return code
    s, code, at = open_working_set(A, lower, upper, sizes, x, record, settings, work)
    if code == SOLVED:
        return answer(s, record, settings, work[at:])
    keep_staircase(lower, upper, record)
    return finish(x, code)


@compiled
def solve_equalities(A, lower, upper, sizes, x, record, settings, work):
    """Solve equalities whose pivots are clear, with little to compile.

    UNPROVED, with x as it was, of anything else; otherwise like `solve_hierarchy`.
    """
    n = x.size
    if n > work.size:
        return TOO_SMALL
    if not all_equal(lower, upper):
        return UNPROVED
    assign(work[:n], x)
    code = solve_by_staircase(A, lower, upper, sizes, x, settings, work[n:])
    if code == INACCURATE:
        assign(x, work[:n])
        return UNPROVED
    if code != TOO_SMALL:
        keep_staircase(lower, upper, record)
    return code


@compiled
def solve_damped(A, lower, upper, sizes, x, record, settings, work):
    """Like `solve_hierarchy`, level by level with damping; the record is no memory."""
    (m, n), last = A.shape, sizes.size - 1
    if work_size(n, m, sizes.size, True) > work.size:
        return TOO_SMALL
    if all_equal(lower, upper):
        return solve_hierarchy(A, lower, upper, sizes, x, record, settings, work)
    d, at = carve_damped(work, m, n, sizes.size)
    reference, at = vector(work, at, n)
    limits, at = vector(work, at, settings.size)
    inner, at = vector(work, at, 3 * (m + n) + 3)
    assign(reference, x)
    for c in range(settings.size):
        limits[c] = settings[c] if c != DAMPING else 0.0
    keep_staircase(lower, upper, record)
    code = open_damped(d, A, lower, upper, sizes, x, settings, work[at:])
    if code != UNPROVED:
        assign(x, d.free)
        return finish(x, code)
    record[3 * m], code, count = 0.0, SOLVED, sizes.size + (last < 0 or d.factor[last] == 0.0)
    for k in range(count):
        if code != SOLVED or (k <= last and d.factor[k] == 0.0):
            continue
        end = m if k > last else damp_level(d, k)
        rows, levels = end + (0 if k > last else n), min(k + 1, sizes.size)
        if k <= last:
            d.sizes[k] += n
        fill(inner[:3 * rows + 3], 0.0)
        assign(x, reference)
        code = solve_hierarchy(d.A[:rows], d.lower[:rows], d.upper[:rows], d.sizes[:levels], x,
                               inner[:3 * rows + 3], limits, work[at:])
        if k <= last:
            d.sizes[k] -= n
        _add_record(record, inner, lower, upper, d, x, end, k)
        limits[MOST] -= inner[3 * rows] + inner[3 * rows + 1]
        if limits[MOST] < 1.0 and k + 1 < count and code == SOLVED:
            code, record[3 * m + 2] = ITERATION_LIMIT, min(k + 1, last)
        if k <= last:
            keep_reached(d, A, lower, upper, x, k, end)
    return code


@inlined
def solve(A, lower, upper, sizes, x, record, settings, work):
    """Solve like `Hcod`: `solve_damped`, or `solve_hierarchy` without damping."""
    if settings[DAMPING] > 0.0:
        return solve_damped(A, lower, upper, sizes, x, record, settings, work)
    return solve_hierarchy(A, lower, upper, sizes, x, record, settings, work)


@inlined
def _add_record(record, inner, lower, upper, d, x, end, k):
    """Add the result of a level: states of rows, and which rows hold it back.

    A row that a level above has brought to its side, or beyond it, stays active while x is there.
    """
    m, rows = lower.size, end + (x.size if k < d.factor.size else 0)
    for i in range(end):
        state, side = record[i], upper[i] if record[i] > 0.0 else lower[i]
        room = LEVEL_MET * (1.0 + abs(side))  # from x to the side, or beyond it
        stays = (inner[i] == FREE and abs(state) == 1.0
                 and state * (side - inner_product(d.A[i], x)) <= room)
        record[i] = state if stays else inner[i]
        if record[m + i] < 0.0 and 0.0 <= inner[rows + i] <= k:
            record[m + i], record[2 * m + i] = inner[rows + i], inner[2 * rows + i]
    record[3 * m] += inner[3 * rows]
    record[3 * m + 1] += inner[3 * rows + 1]
    record[3 * m + 2] = inner[3 * rows + 2]


@inlined
def keep_staircase(lower, upper, record):
    """Write the record of an answer in which no inequality acts, or of a failure."""
    m = lower.size
    for i in range(m):
        record[i] = EQUAL if lower[i] == upper[i] else FREE
        record[m + i], record[2 * m + i] = -1.0, 0.0
    record[3 * m], record[3 * m + 1], record[3 * m + 2] = 1.0, 0.0, -1.0


@internal
def answer(s, record, settings, work):
    """Find the working set of the answer, beginning with the rows that act; `solve_hierarchy`."""
    (m, n), levels, x = s.A.shape, s.multiplier.shape[0] - 1, s.x
    current, at = matrix(work, 0, levels + 1, m)
    saved, at = vector(work, at, n)
    most, code, steps, blocks = np.int64(settings[MOST]), UNPROVED, 0, 0
    limit = min(most, SOLVE_STEPS * max(m, 1))
    warm, level = record[3 * m] + record[3 * m + 1] > 0.0, -1.0
    s.count[FINISHED], s.count[SOUND] = 0, 0
    if warm:
        level = _resumed_at(record[3 * m + 2], levels)
    if warm and level < 0.0:
        code, blocks = pivot_in_blocks(s, limit, 0)
        steps = blocks
    for seeded in range(s.count[SOUND] if level < 0.0 else -1, -1, -1):
        if code in (UNPROVED, INACCURATE) and steps < limit:
            code, level, more = _pass(s, saved, settings, 1.0, seeded == 1, limit - steps,
                                      work[at:])
            steps += more
            if code != SOLVED and steps < limit and _is_unclear(s):
                code, level, more, tries = _second_pass(s, current, saved, settings, limit - steps,
                                                        level, work[at:])
                steps, blocks = steps + more + tries, blocks + tries
            if code in (UNPROVED, INACCURATE) and steps < limit:
                code, tries = pivot_in_blocks(s, limit - steps, PATIENCE)
                steps, blocks = steps + tries, blocks + tries
    if code in (UNPROVED, INACCURATE) and steps < limit:
        restore(s)
        code, tries, level = pivot_one_by_one(s, current, saved, limit - steps, level)
        steps += tries
    if code == SOLVED and neglects(s):
        code, tries, more = _solve_with_light_rows(s, current, saved, limit - steps)
        steps, blocks = steps + tries + more, blocks + tries
        code = ITERATION_LIMIT if code != SOLVED and steps >= most else code
    elif code not in (SOLVED, NUMERICAL_FAILURE):
        finished = s.count[FINISHED]
        if finished == levels or (code == UNPROVED and finished > 0):
            assign(x, saved)
        code = ITERATION_LIMIT if steps >= most else INACCURATE
    _keep(s, record, blocks, steps - blocks)
    record[3 * m + 2] = -1.0
    if code == ITERATION_LIMIT and s.count[FINISHED] <= levels:  # not for want of light rows
        record[3 * m + 2] = _resume(s, level)
    return code if np.isfinite(length_of(x)) else finish(x, NUMERICAL_FAILURE)


@inlined
def _pass(s, saved, settings, share, seeded, most, work):
    """Pass through the levels, with rows as independent down to a share of `rank_tolerance`.

    seeded: whether from x and the rows that act, else from nothing.
    Returns the code of the verified working set, the level at which its steps ran out (-1: none),
    and the steps.
    """
    declared, rows = s.scalar[RANK], s.A.shape[0] + 1
    restore(s)
    t = carve_tableau(s, work)
    s.scalar[RANK] = share * declared
    limit = min(most, PASS_STEPS * rows)
    code, level = pass_through_levels(t, settings[TOLERANCE], limit, seeded)
    s.scalar[RANK] = declared
    save(s, saved, s.multiplier.shape[0] - 1 if code == SOLVED else level)
    code = INACCURATE if code == SOLVED and not verify(s, False) else code
    return code, 0.0 + level, t.count[STEPS]


@internal
def _second_pass(s, current, saved, settings, most, level, work):
    """Factor the working set of a pass anew, and pass again where that proves nothing.

    Returns what `_pass` does, and the tries in blocks. Unless SOLVED, the working set is again that
    of the first pass.
    """
    assign(current[0], s.index[STATE])
    code, blocks = pivot_in_blocks(s, 1, 0)
    if code == SOLVED or level >= 0.0 or blocks >= most:
        return code, level, 0, blocks
    code, level, steps = _pass(s, saved, settings, INDEPENDENT, s.count[SOUND] == 1, most - blocks,
                               work)
    if code != SOLVED and steps + blocks < most:
        code, tries = pivot_in_blocks(s, most - steps - blocks, PATIENCE)
        blocks += tries
    if code == SOLVED and _costs_more(s, saved):
        code = UNPROVED
    if code != SOLVED:
        assign(s.index[STATE, :s.A.shape[0]], current[0])
        restore(s)
    return code, level, steps, blocks


@inlined
def _is_unclear(s):
    """Whether a row counts as dependent by less than the factor INDEPENDENT."""
    unclear = False
    for i in range(s.A.shape[0]):
        unclear |= s.number[CUT, i] > INDEPENDENT * s.scalar[RANK] * s.number[NORM, i]
    return unclear


@internal
def _costs_more(s, other):
    """Whether x violates a level by a share of more than DEARER more than another x does.

    Or is that much farther from the reference. It then uses a nearly dependent row for a gain above
    that is within `rank_tolerance`.
    """
    least, more = (BAND * (1.0 + length_of(s.x))) ** 2, (1.0 + DEARER) ** 2
    square, square_of_other = 0.0, least
    for c in range(s.x.size):
        square += (s.x[c] - s.number[REFERENCE, c]) ** 2
        square_of_other += (other[c] - s.number[REFERENCE, c]) ** 2
    dearer = square > more * square_of_other
    for k in range(s.multiplier.shape[0] - 1):
        square, square_of_other = 0.0, least
        for i in range(s.index[FIRST, k], s.index[FIRST, k + 1]):
            square += _violation(s, i, s.x) ** 2
            square_of_other += _violation(s, i, other) ** 2
        dearer = dearer or square > more * square_of_other
    return dearer


@inlined
def _violation(s, i, x):
    """Return by how much an x violates row i, over its norm; 0 if it takes no part."""
    value, norm = product_with(s, i, x), s.number[NORM, i]
    over = max(value - s.number[UPPER, i], s.number[LOWER, i] - value, 0.0)
    return over / norm if norm > 0.0 else 0.0


@inlined
def _solve_with_light_rows(s, current, saved, limit):
    """Go on with the rows that were neglected; return SOLVED if they make no answer large.

    Else INACCURATE, with x as it was; and the tries in blocks and row by row.
    """
    steps, largest = 0, LARGER * (1.0 + length_of(s.x))
    assign(saved, s.x)
    s.count[FINISHED] = s.multiplier.shape[0]  # nothing else is saved
    take_up(s)
    code, tries = pivot_in_blocks(s, limit, PATIENCE)
    if code != SOLVED and tries < limit:
        restore(s)
        code, steps, _ = pivot_one_by_one(s, current, saved, limit - tries, 0.0)
    if code == SOLVED and length_of(s.x) <= largest:
        return code, tries, steps
    assign(s.x, saved)
    return INACCURATE, tries, steps


@compiled
def verify_answer(A, lower, upper, sizes, x, record, settings, work):
    """Whether x and the rows that act in it prove each other: SOLVED, else INACCURATE.

    For any answer without damping, also of another method. x (2 n,): the answer, then the
    reference. record (m or more,): the state of each row; the multipliers follow from these.
    """
    (m, n), proved = A.shape, False
    if n + exact_size(n, m, sizes.size) > work.size:
        return TOO_SMALL
    found, at = vector(work, 0, n)
    assign(found, x[n:])
    s, code, _ = open_working_set(A, lower, upper, sizes, found, record, settings, work[at:])
    for reading in range(1 + (s.count[NEGLECTED] > 0) if code == SOLVED else 0):
        if not proved:
            if reading == 1:
                take_up(s)
            meet(s, sizes.size)
            write_multipliers(s)
            assign(s.x, x[:n])
            proved = verify(s, True) and not neglects(s)
    return SOLVED if proved else INACCURATE if code == SOLVED else code


@inlined
def open_working_set(A, lower, upper, sizes, x, record, settings, work):
    """Return a WorkingSet with the data, rescaled if need be; a code; where it ends."""
    m, n = A.shape
    multiplier, at = matrix(work, 0, sizes.size + 1, m)
    own, end = carve_working_set(A, sizes, x, multiplier, work, at)
    s, own.scalar[SCALE] = own, 1.0
    code = load(s, lower, upper, sizes, record, settings[RANK_TOLERANCE])
    if code == UNPROVED:
        scaled, end = matrix(work, end, m, n)
        sides, end = matrix(work, end, 2, m)
        code = rescale(own, lower, upper, scaled, sides)
        s, _ = carve_working_set(scaled, sizes, x, multiplier, work, at)
        if code == SOLVED:
            code = load(s, sides[0], sides[1], sizes, record, settings[RANK_TOLERANCE])
    return s, code, end


@inlined
def _resume(s, level):
    """Return where a later solve resumes, see `_resumed_at`."""
    last = s.multiplier.shape[0] - 2
    if s.count[FINISHED] == 0:
        return -2.0 - max(level, 0.0)
    return 0.0 + (s.count[FINISHED] if s.count[FINISHED] < last else last)


@inlined
def _resumed_at(number, levels):
    """Return the level at which an earlier search ended, -1 for none."""
    at = -2.0 - number if number <= -2.0 else number
    return at if 0.0 <= at < levels else -1.0


@inlined
def _keep(s, record, blocks, steps):
    """Write the record: of each row its state, the level it holds back, its multiplier there."""
    m, levels, k, scale = s.A.shape[0], s.multiplier.shape[0] - 1, 0, s.scalar[SCALE]
    for i in range(m):
        while i >= s.index[FIRST, k + 1]:
            k += 1
        record[i], record[m + i], record[2 * m + i] = s.index[STATE, i], -1.0, 0.0
        for p in range(levels, k - 1, -1):
            if s.multiplier[p, i] != 0.0 and s.index[STATE, i] not in (EQUAL, FREE):
                mu = s.multiplier[p, i] * (scale if p == levels else 1.0 / scale)
                record[m + i], record[2 * m + i] = p, mu
    record[3 * m], record[3 * m + 1] = blocks, steps
