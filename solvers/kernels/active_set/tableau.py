"""An orthogonal tableau: the rows of a hierarchy in a basis that follows the working set.

The tableau is M = Q^T [A_a^T, I], one row for each basis vector: the coordinates of the rows of A
that act and have more than one entry, then the basis vector itself. A row of A with a single entry
is a multiple of a column of the identity, so a bound costs nothing. Each active row of A gets a
basis vector of its own and is zero beyond it: the active rows are lower triangular. Equalities
have their columns from the start, an inequality gets its own when it comes to act; those of rows
that act for good move to the left and turn no more.

Adding and removing a row is a few plane rotations of adjacent rows of M (Gill, Golub, Murray,
Saunders 1974), never a new factorisation. The columns of a row depend on that row alone, so rows of
very different norm do not disturb each other.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import add_multiple, as_matrix, inlined, inner_product, internal
from solvers.kernels.active_set.working_set import (
    ACTED,
    CUT,
    ENTRY,
    FACTORED,
    FIRST,
    LOWER,
    NORM,
    PIVOT,
    REFERENCE,
    SECOND,
    STATE,
    TOLERANCE,
    UNIT,
    UPPER,
    WHOLE,
    note_pivot,
    side_at,
)
from solvers.kernels.linalg.least_squares import least_squares
from solvers.kernels.linalg.rows import length_of, swap
from solvers.kernels.linalg.space import assign, fill, integers, matrix, vector
from solvers.kernels.tolerances import CANCELLED, CLEAR_SQUARE, EPSILON, FAINT, FLOOR, NEGLIGIBLE
from solvers.status import EQUAL, FREE

# Rows of `number` after those of the data. Per row of A: its value and the rate of that; its
# residual before the step of its level and its excess after (in the order of the list). Per unknown
# or basis vector: the goal of a level that sets all of x, the step in x, its step in the basis, the
# gradient of the level, and the force that balances it.
VALUE, SPEED, REST, OVER, GOAL, STEP, Z, PULL, FORCE = range(REFERENCE + 1, REFERENCE + 10)
# Rows of `index` after those of the data. Per row of A: its column of M (-1: none), its kind; the
# list of the rows of the level that act, in pivot order. Per basis vector: the row that owns it, -1
# for none. Per column: the row that it belongs to. Scratch.
COLUMN, KIND, LIST, OWNER, ROW, QUEUE = range(FIRST + 1, FIRST + 7)
# In `count`: columns at the left that turn no more; the first of those that do; the first of the
# unknowns; basis vectors of the fixed, hard and soft rows, soft rows; whether
# the level is missed; steps.
SETTLED, TURNING, BASE, FIX, HARD, RANKS, ROWS, MISSED, STEPS = range(9)
# In `scalar`: the largest number so far, the scale of tolerances; the square of a level's weight;
# what of the sum of its rows' pulls may be rounding; the largest number of a whole step.
SIZE, SCALE, WEIGHT, ROUNDING, REACH = range(5)

Tableau = namedtuple("Tableau", "of count scalar M room")
"""The data of a solve level by level.

of: the WorkingSet whose data it shares. count, scalar: see above. M (n, g + n), g the number of
rows with more than one entry. room: scratch.
"""


@inlined
def carve_tableau(s, work):
    """Return a Tableau of a WorkingSet."""
    m, n = s.A.shape
    general = 0
    for i in range(m):
        general += s.index[UNIT, i] < 0
    count, at = integers(work, 0, 9)
    scalar, at = vector(work, at, 5)
    M, at = matrix(work, at + (-at & 3), n, general + n)
    return Tableau(s, count, scalar, M, work[at:])


@internal
def open_tableau(t, seeded):
    """Start at x and the rows that act, or at x = 0 with an empty working set, with Q = I.

    Equalities have their columns of M.
    """
    s, M, base = t.of, t.M, t.M.shape[1] - t.of.x.size
    s.count[WHOLE], s.count[FACTORED], s.scalar[PIVOT], s.scalar[SECOND] = -1, 0, 1.0, 1.0
    if not seeded:
        fill(s.x, 0.0)
    fill(t.count, 0)
    fill(t.scalar, 0.0)
    for p in range(s.multiplier.shape[0]):
        fill(s.multiplier[p], 0.0)
    for r in range(s.x.size):
        fill(M[r, base:], 0.0)
        M[r, base + r] = 1.0
    at = base
    for i in range(s.A.shape[0]):
        s.index[KIND, i], s.number[VALUE, i], unit = 0, 0.0, s.index[UNIT, i]
        s.index[ACTED, i], s.index[COLUMN, i] = s.index[STATE, i], base + unit if unit >= 0 else -1
        if s.index[STATE, i] != EQUAL:
            s.index[STATE, i] = FREE
        elif unit < 0:
            at -= 1
            s.index[COLUMN, i], s.index[ROW, at] = at, i
            assign(M[:, at], s.A[i])
    t.count[BASE], t.count[TURNING] = base, at


@inlined
def add_column(t, i):
    """Give row i its column, if it has none."""
    s, at = t.of, t.count[TURNING] - 1
    if s.index[COLUMN, i] < 0:
        s.index[COLUMN, i], s.index[ROW, at], t.count[TURNING] = at, i, at
        for r in range(s.x.size):
            t.M[r, at] = inner_product(s.A[i], t.M[r, t.count[BASE]:])


@internal
def reflect_columns(M, k, end, column, first, total):
    """Reflect rows k .. end - 1 of M so that `column` is zero below row k.

    Columns from `first` on are reflected too; total (g + n,) is scratch.
    """
    square, alpha = 0.0, M[k, column]
    for t in range(k + 1, end):
        square += M[t, column] * M[t, column]
    if square == 0.0:
        return
    norm = np.sqrt(square + alpha * alpha)
    norm = -norm if alpha > 0.0 else norm
    head = alpha - norm
    factor = -1.0 / (norm * head)
    top = M[k, first:]
    s = total[:top.size]
    for c in range(top.size):
        s[c] = head * top[c]
    for t in range(k + 1, end):
        if M[t, column] != 0.0:
            add_multiple(s, M[t, column], M[t, first:])
    for t in range(k + 1, end):
        if M[t, column] != 0.0:
            add_multiple(M[t, first:], -factor * M[t, column], s)
            M[t, column] = 0.0
    add_multiple(top, -head * factor, s)
    M[k, column] = norm


@internal
def fold(M, k, column, first):
    """Rotate rows k and k + 1 of M so that `column` is zero in row k + 1."""
    a, b = M[k, column], M[k + 1, column]
    if b == 0.0:
        return
    norm = np.sqrt(a * a + b * b)
    cosine, sine = a / norm, b / norm
    upper, lower = M[k, first:], M[k + 1, first:]
    for c in range(upper.size):
        value = upper[c]
        upper[c] = cosine * value + sine * lower[c]
        lower[c] = cosine * lower[c] - sine * value
    M[k, column], M[k + 1, column] = norm, 0.0


@inlined
def left_of(t, i, begin, end):
    """Return the squared norm of row i in the basis vectors begin .. end - 1."""
    square, column, entry = 0.0, t.of.index[COLUMN, i], entry_of(t, i)
    for k in range(begin, end):
        square += t.M[k, column] * t.M[k, column]
    return square * entry * entry


@inlined
def entry_of(t, i):
    """Return the factor of row i over its column of M."""
    return t.of.number[ENTRY, i] if t.of.index[UNIT, i] >= 0 else 1.0


@inlined
def is_independent(t, i, square):
    """Whether a row of which this square is left is independent; notes its pivot, or its cut."""
    s, norm = t.of, t.of.number[NORM, i]
    share = np.sqrt(square) / norm if norm > 0.0 else 0.0
    if share > s.scalar[TOLERANCE]:
        note_pivot(s, share)
        return True
    if share > NEGLIGIBLE:
        s.number[CUT, i] = max(s.number[CUT, i], share * norm)
        assign(s.C[i], s.A[i])  # noted, not cut
    return False


@inlined
def pivot_rows(t, begin, rank):
    """Give the listed rows basis vectors from `begin` on, the largest row first; return the rank.

    The first `rank` of them already have theirs. Puts the list into pivot order.
    """
    s, n, rows, count = t.of, t.of.x.size, t.of.index[LIST], t.count[ROWS]
    left, norm = s.number[REST], s.number[NORM]
    for q in range(rank, count):
        left[q] = left_of(t, rows[q], begin + rank, n)
    while rank < count and begin + rank < n:
        largest, best = 0.0, -1
        for q in range(rank, count):
            least = s.scalar[TOLERANCE] * norm[rows[q]]
            if left[q] > largest and left[q] > least * least:
                largest, best = left[q], q
        if best < 0:
            break
        swap(rows, rank, best)
        swap(left, rank, best)
        is_independent(t, rows[rank], largest)
        column = s.index[COLUMN, rows[rank]]
        reflect_columns(t.M, begin + rank, n, column, t.count[TURNING], t.room)
        rank += 1
        for q in range(rank, count):
            left[q] -= (entry_of(t, rows[q]) * t.M[begin + rank - 1, s.index[COLUMN, rows[q]]]) ** 2
            if left[q] < CLEAR_SQUARE * norm[rows[q]] ** 2:
                left[q] = left_of(t, rows[q], begin + rank, n)
    return rank


@inlined
def around(s, i, side, scale):
    """Return the scale of tolerances for row i at a side; see `tolerances.py`."""
    return s.number[NORM, i] * scale + abs(side)


@inlined
def missed_side(s, i, value, scale, tolerance):
    """Return +1 if row i is above its upper side, -1 if below its lower side, else 0."""
    up, low = s.number[UPPER, i], s.number[LOWER, i]
    if value > up + tolerance * around(s, i, up, scale):
        return 1
    if value < low - tolerance * around(s, i, low, scale):
        return -1
    return 0


@inlined
def measure(t):
    """Write the scale of tolerances: the length of x, but at least the size of rounding."""
    length = length_of(t.of.x)
    t.scalar[SIZE] = max(t.scalar[SIZE], length)
    t.scalar[SCALE] = max(length, FLOOR * t.scalar[SIZE])


@inlined
def step_of_rows(t, begin, rank):
    """Write the step of a level into Z, and the excess of its rows after the step.

    Independent rows are met. Returns the size of the largest numbers involved.
    """
    s, rows, size, y = t.of, t.count[ROWS], 0.0, t.of.number[Z, begin:]
    L = as_matrix(t.room[:rows * (rank + 1)], rank + 1, rows)
    for q in range(rows):
        i, rest = s.index[LIST, q], s.number[REST, q]
        column, entry, least = s.index[COLUMN, i], entry_of(t, i), s.scalar[TOLERANCE]
        if rows == rank:
            diagonal = entry * t.M[begin + q, column]
            size = max(size, abs(rest / diagonal))
            for c in range(q):
                rest -= entry * t.M[begin + c, column] * y[c]
            y[q], s.number[OVER, q] = rest / diagonal, 0.0
            continue
        seen = left_of(t, i, begin, begin + rank) > (least * s.number[NORM, i]) ** 2
        for c in range(rank):  # entries of a row in the span of the rows above are rounding
            L[c, q] = entry * t.M[begin + c, column] if c <= q and seen else 0.0
        L[rank, q] = rest
        if q < rank:
            size = max(size, abs(rest / L[q, q]))
    if rows > rank:
        least_squares(L[:rank], L[rank], y)
        for q in range(rows):
            s.number[OVER, q] = -L[rank, q]
    return size


@inlined
def weigh_rows(t):
    """Return the largest violation of the rows of a level; note the rounding in their pulls.

    If the misses are rounding in all rows, they count as zero; in a single row the miss may be what
    balances a light row. The share of rounding in a pull is that in the miss.
    """
    s, worst, pulled, missed = t.of, 0.0, 0.0, False
    for q in range(t.count[ROWS]):
        i, over = s.index[LIST, q], abs(s.number[OVER, q])
        side = side_at(s, i)
        missed |= over > EPSILON * around(s, i, side, t.scalar[SIZE])
        pulled += s.number[NORM, i] * over
        if over > 0.0:
            worst = max(worst, over / around(s, i, side, t.scalar[SCALE]))
    if not missed:
        worst = pulled = 0.0
        fill(s.number[OVER, :t.count[ROWS]], 0.0)
    length = worst * t.scalar[SCALE]
    share = min(EPSILON * t.scalar[SIZE] / length, 1.0) if length > 0.0 else 0.0
    t.scalar[ROUNDING] = pulled * max(CANCELLED, share)
    return worst


@inlined
def push_by(t, i, over, begin, end):
    """Add row i times its excess, without entries so faint that they decide nothing."""
    s, column, entry = t.of, t.of.index[COLUMN, i], entry_of(t, i)
    faint, push = FAINT * abs(s.number[NORM, i] / entry), over * entry
    for k in range(begin, end):
        s.number[PULL, k] += push * t.M[k, column] if abs(t.M[k, column]) > faint else 0.0


@inlined
def balance(t, begin, end):
    """Write the forces of the rows that own the basis vectors begin .. end - 1.

    A pull that may be rounding alone counts as zero: every entry of a row is rounded relative to
    its norm.
    """
    s, pull, force, rounding = t.of, t.of.number[PULL], t.of.number[FORCE], t.scalar[ROUNDING]
    for k in range(end - 1, begin - 1, -1):
        force[k], i = 0.0, s.index[OWNER, k]
        if i < 0 or abs(pull[k]) <= rounding:
            continue
        column, entry = s.index[COLUMN, i], entry_of(t, i)
        force[k] = -pull[k] / (entry * t.M[k, column])
        rounding += CANCELLED * abs(force[k]) * s.number[NORM, i]
        for c in range(begin, k):
            pull[c] += force[k] * entry * t.M[c, column]
