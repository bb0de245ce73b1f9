"""An orthogonal tableau: the rows of a hierarchy in a basis that follows the working set.

The tableau is M = Q^T [A^T, I] (n, g + n), one row for each basis vector: the coordinates of the g
rows of A with more than one entry, then the basis vector itself. A row of A with a single entry is
a multiple of a column of the identity, so a bound costs nothing. Each active row of A gets a basis
vector of its own and is zero beyond it: the active rows are lower triangular.

Adding and removing a row is a few plane rotations of adjacent rows of M (Gill, Golub, Murray,
Saunders 1974), never a new factorisation. The columns of a row depend on that row alone, so rows of
very different norm do not disturb each other.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import as_matrix, compiled, inlined
from solvers.kernels.rows import ZERO, finish, has_outlier
from solvers.kernels.space import View, integers, matrix, proof_size, vector
from solvers.kernels.tolerances import DOUBTFUL, DUST, FLOOR, OUTGROWN
from solvers.status import EQUAL, FREE, NUMERICAL_FAILURE, SOLVED, TOO_SMALL

# Rows of `number`. Per row of A: its norm, its only entry (1 if there are more), its sides, the
# sides as moved, its value and the rate of that, its residual before its level and its excess after
# (these two in the order of the list), and the record, see `ActiveSetResolution`. Per unknown or
# basis vector: the x at the start of the level, its goal, the reference, the step in x, x or its
# step in the basis, the level's pull, the force that balances it, and the part of the pull that
# it balances.
(NORM, ENTRY, LOWER, UPPER, LOW, UP, VALUE, SPEED, REST, OVER, ACTIVE, HOLDS, MULTIPLIER,
 START, GOAL, REFERENCE, STEP, Z, PULL, FORCE, SHARE) = range(21)
# Rows of `index`. Per row of A: its unknown (-1 for several entries), its column of M, its state;
# the list of active rows, each level in pivot order. Per basis vector: the row that owns it, -1 for
# none; the unknown it was initially. Per level: its number of rows, its start in the list, and in
# the basis.
UNIT, COLUMN, STATE, LIST, OWNER, ORDER, EXTENT, BEGIN, RANKS = range(9)
# In `count`: levels; first column of M in use; first column of the remaining unknowns; removed
# unknowns, which were put on a bound before all else; whether the answer is in doubt. The others
# are those of `levels.py`.
LEVELS, FIRST, BASE, REMOVED, DOUBT = range(5)
COUNTS = 15
# In `scalar`: the largest number so far, the scale of tolerances; a level's damping and weight; the
# largest miss of its rows, the sum of their pulls, the part of that which may be rounding; guesses,
# steps, the unfinished level; the largest number of a whole step.
(SIZE, SCALE, DAMPED, WEIGHT, WORST, PULLED, ROUNDING,
 GUESSES, STEPS, UNFINISHED, REACH) = range(11)
SCALARS = 11

ALL, ACTING = np.int64(0), np.int64(1)  # the rows that a tableau holds


class Exact(NamedTuple):
    """The settings of `Hcod`, in the order of its array."""

    damping: View
    threshold: View
    rank_tolerance: View
    tolerance: View
    guesses: View
    max_iterations: View


class Solve(NamedTuple):
    """The data of a solve: few arrays with named rows, since each array costs compile time.

    A (m, n), x (n,). number, index (.., w), w the largest of m, n, L + 1, and count, scalar: see
    above. M (n, g + n). room: scratch.
    """

    A: View
    x: View
    number: View
    index: View
    count: View
    scalar: View
    M: View
    room: View
    settings: Exact


@inlined
def prepare(A, lower, upper, sizes, x, record, settings, work):
    """Return a Solve with all data, and SOLVED, TOO_SMALL or, with x = 0, NUMERICAL_FAILURE."""
    s, enough = carve(A, sizes, x, settings, work)
    if not enough:
        return s, ZERO + TOO_SMALL
    general = load(s, lower, upper, sizes, record)
    if general < 0:
        return s, ZERO + finish(x, NUMERICAL_FAILURE)
    return with_tableau(s, general), ZERO + SOLVED


@inlined
def carve(A, sizes, x, settings, work):
    """Return a Solve without data whose M has no columns yet, and whether everything fits.

    Everything is M, and a least squares problem of all rows with its damping or a proof.
    """
    m, n = A.shape
    w = max(m, n, sizes.size + 1)
    number, at = matrix(work, ZERO, 21, w)
    numbers, at = integers(work, at, 9 * w)
    count, at = integers(work, at, COUNTS)
    scalar, at = vector(work, at, SCALARS)
    needed = max((m + n) * (2 * n + 2), proof_size(n, m, sizes.size))
    enough = at + n * (m + n) + needed <= work.size
    room = work[at if enough else work.size:]
    exact = Exact(settings[0], settings[1], settings[2], settings[3], settings[4], settings[5])
    index = as_matrix(numbers, 9 if numbers.size > 0 else 0, w)
    return Solve(A, x, number, index, count, scalar,
                 as_matrix(room[:0], n, 0), room, exact), enough


@inlined
def with_tableau(s, general):
    """Return the Solve with an M for `general` rows with several entries."""
    n = s.x.size
    M, at = matrix(s.room, ZERO, n, general + n)
    return Solve(s.A, s.x, s.number, s.index, s.count, s.scalar, M, s.room[at:], s.settings)


@compiled
def load(s, lower, upper, sizes, record):
    """Check and copy all data; return the number of rows with several entries, -1 if invalid.

    An active inequality whose side is missing becomes free.
    """
    number, general, sane = s.number, ZERO, True
    s.count[LEVELS] = sizes.size
    for k in range(sizes.size):
        s.index[EXTENT, k] = sizes[k]
    for c in range(s.x.size):
        sane &= np.isfinite(s.x[c])
        number[REFERENCE, c], s.index[ORDER, c] = s.x[c], c
    for i in range(lower.size):
        a, square, entries, only = s.A[i], 0.0, 0, -1
        for c in range(a.size):
            square += a[c] * a[c]
            if a[c] != 0.0:
                entries, only = entries + 1, c
        only = only if entries == 1 else -1
        general += only < 0
        low, up, act = lower[i], upper[i], record[i]
        sane &= np.isfinite(square) and low <= up and low < np.inf and up > -np.inf
        number[NORM, i], s.index[UNIT, i] = np.sqrt(square), only
        number[ENTRY, i] = a[only] if only >= 0 else 1.0
        number[LOWER, i] = number[LOW, i] = low
        number[UPPER, i] = number[UP, i] = up
        if low == up:
            act = EQUAL
        elif not ((act == 1.0 and up < np.inf) or (act == -1.0 and low > -np.inf)):
            act = FREE
        number[ACTIVE, i], number[HOLDS, i], number[MULTIPLIER, i] = act, -1.0, 0.0
    s.scalar[SIZE] = s.scalar[SCALE] = s.scalar[GUESSES] = s.scalar[STEPS] = 0.0
    s.scalar[UNFINISHED] = -1.0
    return general if sane else -1


@inlined
def keep(s, record):
    """Write the record."""
    m = s.A.shape[0]
    for i in range(m):
        record[i], record[m + i] = s.number[ACTIVE, i], s.number[HOLDS, i]
        record[2 * m + i] = s.number[MULTIPLIER, i]
    record[3 * m], record[3 * m + 1] = s.scalar[GUESSES], s.scalar[STEPS]
    record[3 * m + 2] = s.scalar[UNFINISHED]


@compiled
def open_tableau(s, rows):
    """Write M for Q = I: removed unknowns, equalities, inequalities, the remaining unknowns.

    So settled columns come before the others and can be skipped from then on. If only the ACTING
    rows are needed, the columns of the others are skipped from the start.
    """
    M, active, unit, order = s.M, s.number[ACTIVE], s.index[UNIT], s.index[ORDER]
    m, n, removed = s.A.shape[0], s.x.size, s.count[REMOVED]
    at = removed
    for i in range(m):
        at += rows == ACTING and unit[i] < 0 and active[i] == FREE
    s.count[FIRST], s.count[DOUBT] = at, 0
    for equal in (True, False):
        for i in range(m):
            if unit[i] < 0 and (active[i] == EQUAL) == equal and not (
                    rows == ACTING and active[i] == FREE):
                s.index[COLUMN, i] = at
                a = s.A[i]
                for t in range(n):
                    M[t, at] = a[order[t]]
                at += 1
    s.count[BASE] = at
    for t in range(n):
        for c in range(removed):
            M[t, c] = 0.0
        for c in range(at, M.shape[1]):
            M[t, c] = 0.0
        column = t if t < removed else at + t - removed
        M[t, column] = 1.0
        s.room[order[t]] = column
    for i in range(m):
        if unit[i] >= 0:
            s.index[COLUMN, i] = np.int64(s.room[unit[i]])


@compiled
def reflect(M, k, end, column, first, total):
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
    top, s = M[k, first:], total[first:]
    for c in range(top.size):
        s[c] = head * top[c]
    for t in range(k + 1, end):
        v, row = M[t, column], M[t, first:]
        for c in range(row.size):
            s[c] += v * row[c]
    for t in range(k + 1, end):
        v, row = factor * M[t, column], M[t, first:]
        for c in range(row.size):
            row[c] -= v * s[c]
        M[t, column] = 0.0
    head *= factor
    for c in range(top.size):
        top[c] -= head * s[c]
    M[k, column] = norm


@compiled
def fold(M, k, column, first):
    """Rotate rows k and k + 1 of M so that `column` is zero in row k + 1."""
    a, b = M[k, column], M[k + 1, column]
    if b == 0.0:
        return
    norm = np.hypot(a, b)
    cosine, sine = a / norm, b / norm
    upper, lower = M[k, first:], M[k + 1, first:]
    for c in range(upper.size):
        value = upper[c]
        upper[c] = cosine * value + sine * lower[c]
        lower[c] = cosine * lower[c] - sine * value
    M[k, column], M[k + 1, column] = norm, 0.0


@inlined
def left_of(s, i, begin, end):
    """Return the squared norm of row i in the basis vectors begin .. end - 1."""
    square, column, entry = 0.0, s.index[COLUMN, i], s.number[ENTRY, i]
    for t in range(begin, end):
        square += s.M[t, column] * s.M[t, column]
    return square * entry * entry


@inlined
def factor(s, q0, q1, begin, rank):
    """Give rows q0 .. q1 - 1 of the list basis vectors from `begin` on, the largest row first.

    The first `rank` of them already have theirs. Puts the list into pivot order; returns the rank.
    """
    n, rows = s.x.size, s.index[LIST]
    while q0 + rank < q1 and begin + rank < n:
        largest, best = 0.0, -1
        for q in range(q0 + rank, q1):
            least = s.settings.rank_tolerance * s.number[NORM, rows[q]]
            square = left_of(s, rows[q], begin + rank, n)
            if square > largest and square > least * least:
                largest, best = square, q
        if best < 0:
            break
        q = q0 + rank
        rows[q], rows[best] = rows[best], rows[q]
        if largest < (DOUBTFUL * s.number[NORM, rows[q]]) ** 2:
            s.count[DOUBT] = 1
        reflect(s.M, begin + rank, n, s.index[COLUMN, rows[q]], s.count[FIRST], s.room)
        rank += 1
    return rank


@inlined
def value_of(s, x, i):
    """Return row i of A times x."""
    if s.index[UNIT, i] >= 0:
        return s.number[ENTRY, i] * x[s.index[UNIT, i]]
    total, a = 0.0, s.A[i]
    for c in range(a.size):
        total += a[c] * x[c]
    return total


@inlined
def side_of(number, i):
    """Return the side at which row i is active."""
    return number[UP, i] if number[ACTIVE, i] > 0.0 else number[LOW, i]


@inlined
def around(norm, side, scale):
    """Return the scale of tolerances for a row at a side; see `tolerances.py`."""
    return norm * scale + abs(side)


@inlined
def missed_side(number, i, value, scale, tolerance):
    """Return +1 if row i is above its upper side, -1 if below its lower side, else 0."""
    low, up, norm = number[LOW, i], number[UP, i], number[NORM, i]
    if value > up + tolerance * around(norm, up, scale):
        return 1.0
    return -1.0 if value < low - tolerance * around(norm, low, scale) else 0.0


@inlined
def length_of(x):
    """Return the Euclidean norm."""
    square = 0.0
    for c in range(x.size):
        square += x[c] * x[c]
    return np.sqrt(square)


@inlined
def measure(s):
    """Write the scale of tolerances: the length of x, but at least the size of rounding."""
    length = length_of(s.x)
    s.scalar[SIZE] = max(s.scalar[SIZE], length)
    s.scalar[SCALE] = max(length, FLOOR * s.scalar[SIZE])


@inlined
def has_outgrown(s):
    """Whether x is so small relative to its terms that its tolerances mean little."""
    return s.scalar[SIZE] > OUTGROWN * (1.0 + length_of(s.x))


@inlined
def has_dust(s):
    """Whether a row is so small that it may be the rounding of another."""
    return has_outlier(s.number[NORM, :s.A.shape[0]], DUST)


@inlined
def asks_for_x(s, first, last):
    """Whether rows first .. last - 1 give each unknown one target, all with the same weight.

    Such a level amounts to a reference of its own, which is written into the goal.
    """
    n, seen = s.x.size, s.number[STEP]
    if last - first != n:
        return False
    for c in range(n):
        seen[c] = 0.0
    weight = abs(s.number[ENTRY, first])
    for i in range(first, last):
        c, entry = s.index[UNIT, i], s.number[ENTRY, i]
        if c < 0 or s.number[ACTIVE, i] != EQUAL or abs(entry) != weight or seen[c] != 0.0:
            return False
        seen[c] = 1.0
        s.number[GOAL, c] = s.number[LOWER, i] / entry
    return True
