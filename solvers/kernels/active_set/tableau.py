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

from typing import NamedTuple

import numpy as np

from hierarchy.jit import add_multiple, inlined, inner_product, internal
from solvers.kernels.active_set.working_set import (
    CUT,
    ENTRY,
    FIRST,
    LOWER,
    NORM,
    REFERENCE,
    STATE,
    TOLERANCE,
    UNIT,
    UPPER,
    note_pivot,
)
from solvers.kernels.linalg.rows import swap
from solvers.kernels.linalg.space import View, assign, fill, integers, matrix, vector
from solvers.kernels.tolerances import CLEAR_SQUARE, FLOOR, NEGLIGIBLE
from solvers.status import EQUAL

# Rows of `number` after those of the data. Per row of A: its value and the rate of that; its
# residual before the step of its level and its excess after (in the order of the list). Per unknown
# or basis vector: the goal of a level that sets all of x, the step in x, its step in the basis, the
# gradient of the level, the force that balances it, and the part of the gradient that it balances.
VALUE, SPEED, REST, OVER, GOAL, STEP, Z, PULL, FORCE, SHARE = range(REFERENCE + 1, REFERENCE + 11)
# Rows of `index` after those of the data. Per row of A: its column of M (-1: none), its kind; the
# list of the rows of the level that act, in pivot order. Per basis vector: the row that owns it, -1
# for none. Per column: the row that it belongs to.
COLUMN, KIND, LIST, OWNER, ROW = range(FIRST + 1, FIRST + 6)
# In `count`: columns at the left that turn no more; the first of those that do; the first of the
# unknowns; basis vectors of the fixed, hard and soft rows, soft rows; whether
# the level is missed; steps.
SETTLED, TURNING, BASE, FIX, HARD, RANKS, ROWS, MISSED, STEPS = range(9)
# In `scalar`: the largest number so far, the scale of tolerances; the square of a level's weight;
# the largest miss of its rows, the sum of their pulls, the part of that which may be rounding; the
# largest number of a whole step.
SIZE, SCALE, WEIGHT, WORST, PULLED, ROUNDING, REACH = range(7)


class Tableau(NamedTuple):
    """The data of a solve level by level.

    of: the WorkingSet whose data it shares. count, scalar: see above. M (n, g + n), g the number of
    rows with more than one entry. room: scratch.
    """

    of: View
    count: View
    scalar: View
    M: View
    room: View


@inlined
def tableau_size(n, m):
    """Return the numbers that a Tableau needs: M, and the least squares of all rows."""
    return 16 + n * (m + n) + (m + n) * (n + 3)


@inlined
def carve_tableau(s, work, at):
    """Return a Tableau of a WorkingSet, and where it ends."""
    m, n = s.A.shape
    general = 0
    for i in range(m):
        general += s.index[UNIT, i] < 0
    count, at = integers(work, at, 9)
    scalar, at = vector(work, at, 7)
    M, at = matrix(work, at, n, general + n)
    return Tableau(s, count, scalar, M, work[at:]), at


@internal
def open_tableau(t):
    """Write M for Q = I, with the columns of the equalities."""
    s, M, base = t.of, t.M, t.M.shape[1] - t.of.x.size
    at = base
    for r in range(s.x.size):
        fill(M[r, base:], 0.0)
        M[r, base + r] = 1.0
    for i in range(s.A.shape[0]):
        s.index[COLUMN, i] = base + s.index[UNIT, i] if s.index[UNIT, i] >= 0 else -1
        if s.index[COLUMN, i] < 0 and s.index[STATE, i] == EQUAL:
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
        _write_column(t.M, at, t.count[BASE], s.A[i])


@internal
def _write_column(M, at, base, a):
    for r in range(M.shape[0]):
        M[r, at] = inner_product(a, M[r, base:])


@inlined
def close_column(t, at, settled):
    """Take a column from those that turn, to the settled or away; the first fills its place."""
    s, M, first, to = t.of, t.M, t.count[TURNING], t.count[SETTLED]
    i, other = s.index[ROW, at], s.index[ROW, first]
    for r in range(s.x.size):
        entry = M[r, at]
        M[r, at] = M[r, first]
        if settled:
            M[r, to] = entry
    s.index[COLUMN, other], s.index[ROW, at] = at, other
    s.index[COLUMN, i] = to if settled else -1
    t.count[TURNING] += 1
    t.count[SETTLED] += settled


@inlined
def turn_to(t, k, end, i):
    """Reflect basis vectors k .. end - 1 so that row i has nothing in them beyond the first."""
    reflect_columns(t.M, k, end, t.of.index[COLUMN, i], t.count[TURNING], t.room)


@inlined
def fold_to(t, k, i):
    """Rotate basis vectors k and k + 1 so that row i has nothing in the second."""
    fold(t.M, k, t.of.index[COLUMN, i], t.count[TURNING])


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
        turn_to(t, begin + rank, n, rows[rank])
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
def measure(t, length):
    """Write the scale of tolerances: the length of x, but at least the size of rounding."""
    t.scalar[SIZE] = max(t.scalar[SIZE], length)
    t.scalar[SCALE] = max(length, FLOOR * t.scalar[SIZE])
