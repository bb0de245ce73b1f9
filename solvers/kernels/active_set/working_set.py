"""The working set: the rows that act, factored level by level, and the x that meets them.

A row acts at one of its sides. With the acting rows J of all levels, J Q = W is lower trapezoidal,
level by level as in `staircase.py`: a level takes as many columns of Q as it adds rank. y = Q^T x
follows by forward substitution, least squares in each level, and the columns that no level takes
keep the reference. Rows with a single entry that come first take their unknown as a column: they
need no reflection. A level that gives every unknown a target of one weight is a reference.

What a dependent row has outside the rows that it depends on, at most `rank_tolerance` of its norm,
is cut from it, and stays so for the rest of the solve: so all working sets belong to one problem,
within `rank_tolerance` of each row.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import as_matrix, inlined, inner_product, internal
from solvers.kernels.linalg.least_squares import substitute_back, triangularise, turn
from solvers.kernels.linalg.rows import factor_level, only_entry, reflect, reflect_back, swap
from solvers.kernels.linalg.space import Rows, assign, fill, integers, matrix, vector
from solvers.kernels.tolerances import CANCELLED, LEAST_SQUARE, NEGLIGIBLE, SPARED
from solvers.status import EQUAL, FREE, NUMERICAL_FAILURE, SOLVED, UNPROVED

# Rows of `number`. Per row of A: its norm, its only entry, its sides, the norm of what was cut from
# it. By place in the list: the square at which a row counts as dependent, its
# residual side - a x. Per unknown or column of Q: reference, y, the goal of the free columns, a
# gradient and what of it may be rounding, scratch; the diagonal of a level with more
# rows than rank. Per level: SIZE, PIVOT and SECOND of `scalar` before it. Per unknown: the x of the
# last working set in blocks that violated nothing.
(NORM, ENTRY, LOWER, UPPER, CUT, REFERENCE, ZEROED, MISS, Y, GOAL, GRADIENT, NOISE, SCRATCH,
 DIAGONAL, SIZES, PIVOTS, SECONDS, KEPT) = range(18)
NUMBERS = 18  # `levels.py` keeps its own behind REFERENCE
# Rows of `index`. Per row of A: its unknown (-1 for several entries), the side at which it acts,
# the change that the search asks for, the side before a search and at its last checkpoint. By place
# in the list: the row, the sign of its multipliers. The unknown of each column, the column of each
# unknown. Per level: its first row, its first place in the list, its first column, whether W lacks
# the columns above it. Per row of A: the side at which it acted when its level was factored; the
# level from which on a SOUND set holds it, -1 for none.
(UNIT, STATE, FIRST, CHANGE, SEED, SEEN, LIST, SIGN, ORDER, PLACE, BEGIN, RANK, SHORT, ACTED,
 HOLDS) = range(15)
INDICES = 15
# In `count`: columns that are unknowns, the level that sets all of x (-1: none), whether a row was
# cut since the rows were those of A, the number of rows that are negligible beside those of other
# levels alone, the number of levels that the saved x meets, the number of levels in the search at
# its last checkpoint, the number of levels whose factors stand for the rows and sides that acted,
# whether the working set in blocks is that of `KEPT`.
PICKED, WHOLE, DIRTY, NEGLECTED, FINISHED, SEEN_LAST, FACTORED, SOUND = range(8)
# In `scalar`: rank_tolerance, the largest number so far, the smallest pivot of a row over its norm
# and the next one, the factor by which the data are those of the caller.
TOLERANCE, SIZE, PIVOT, SECOND, SCALE = range(5)
_LARGEST = 2.0**1023  # power of two

WorkingSet = namedtuple("WorkingSet", "A x number index count scalar multiplier W basis T C")
"""The data of a solve.

A (m, n), x (n,). number, index (.., w), w the largest of m, n, L + 1; count, scalar: see above.
multiplier (L + 1, m): of each row in each level, and in its own level its violation
a x - side. W (m, n): the listed rows in coordinates of Q. basis: the reflectors of Q. T (n m,):
the columns of each level with more rows than rank, from m times its first column on. C (m, n):
the rows that were cut.
"""


@inlined
def carve_working_set(A, sizes, x, multiplier, work, at):
    """Return a WorkingSet without data, and where it ends."""
    m, n = A.shape
    w = max(m, n, sizes.size + 1)
    number, at = matrix(work, at, NUMBERS, w)
    numbers, at = integers(work, at, INDICES * w)
    count, at = integers(work, at, 8)
    scalar, at = vector(work, at, 5)
    W, at = matrix(work, at + (-at & 3), m, n)  # of 32 bytes: 8 % of the time of a humanoid's solve
    basis, at = matrix(work, at, n, n)
    T, at = vector(work, at, n * m)
    C, at = matrix(work, at, m, n)
    index = as_matrix(numbers, INDICES if numbers.size > 0 else 0, w)
    return WorkingSet(A, x, number, index, count, scalar, multiplier, W, basis, T, C), at


@internal
def load(s, lower, upper, sizes, record, rank_tolerance):
    """Check and copy the data; return SOLVED, or NUMERICAL_FAILURE if an entry is not finite.

    Or UNPROVED if fourth powers of the norms leave the range of numbers, so that all must be
    rescaled: a level that sets all of x weighs with the square of its norm, squared for a length.
    The sides at which rows act are those of the record, as far as a row has that side.
    A row counts as zero beside a far larger one of its level; beside one of another level it has a
    negative norm, takes no part, and `neglects` says whether x meets it all the same.
    """
    number, index, first, sane = s.number, s.index, 0, True
    s.scalar[TOLERANCE] = max(rank_tolerance, CANCELLED)
    s.count[DIRTY] = s.count[FACTORED] = s.count[PICKED] = 0
    for c in range(s.x.size):
        sane &= np.isfinite(s.x[c])
        number[REFERENCE, c] = s.x[c]
    for k in range(sizes.size):
        index[FIRST, k] = first
        largest = 0.0
        for i in range(first, first + sizes[k]):
            square, low, up = _measure(s, i), lower[i], upper[i]
            sane &= np.isfinite(square) and low <= up and low < np.inf and up > -np.inf
            norm = np.sqrt(square) if square > LEAST_SQUARE else _small_length(s.A[i])
            number[NORM, i], number[LOWER, i], number[UPPER, i] = norm, low, up
            largest = max(largest, norm)
        for i in range(first, first + sizes[k]):
            if number[NORM, i] <= NEGLIGIBLE * largest:
                number[NORM, i] = 0.0
        first += sizes[k]
    index[FIRST, sizes.size] = first
    most = neglect(s)
    start_from(s, record)
    if not sane:
        return NUMERICAL_FAILURE
    in_range = most == 0.0 or LEAST_SQUARE < most**4 < 1.0 / LEAST_SQUARE
    return SOLVED if in_range else UNPROVED


@inlined
def neglect(s):
    """Mark the rows that are negligible beside those of other levels; return the largest norm."""
    most, s.count[NEGLECTED] = 0.0, 0
    for i in range(s.A.shape[0]):
        most = max(most, abs(s.number[NORM, i]))
    for i in range(s.A.shape[0]):
        norm = abs(s.number[NORM, i])
        light = 0.0 < norm <= NEGLIGIBLE * most
        if light != (s.number[NORM, i] < 0.0):
            s.number[NORM, i], s.count[FACTORED] = -norm if light else norm, 0
        s.count[NEGLECTED] += light
    return most


@inlined
def start_from(s, record):
    """Let the rows act at the sides of a record, as far as a row has that side."""
    state, lower, upper = s.index[STATE], s.number[LOWER], s.number[UPPER]
    for i in range(s.A.shape[0]):
        above = record[i] == 1.0 and upper[i] < np.inf
        below = record[i] == -1.0 and lower[i] > -np.inf
        state[i] = EQUAL if lower[i] == upper[i] else int(above) - int(below)


@inlined
def _small_length(a):
    """Return the norm of a row whose square underflows."""
    largest, square = 0.0, 0.0
    for c in range(a.size):
        largest = max(largest, abs(a[c]))
    for c in range(a.size if largest > 0.0 else 0):
        square += (a[c] / largest) ** 2
    return largest * np.sqrt(square)


@internal
def rescale(s, lower, upper, A, sides):
    """Write the rows and sides times a power of two that brings their norms into range.

    A (m, n), sides (2, m). Returns SOLVED, or NUMERICAL_FAILURE if a side is then no number.
    """
    most, sane, factor = 0.0, True, 1.0
    for i in range(s.A.shape[0]):
        most = max(most, abs(s.number[NORM, i]))
    while most * factor < 0.5 and factor < _LARGEST:
        factor *= 2.0
    while most * factor > 1.0:
        factor *= 0.5
    for i in range(s.A.shape[0]):
        for c in range(s.x.size):
            A[i, c] = s.A[i, c] * factor
        sides[0, i], sides[1, i] = lower[i] * factor, upper[i] * factor
        sane &= np.isfinite(sides[0, i]) == np.isfinite(lower[i])
        sane &= np.isfinite(sides[1, i]) == np.isfinite(upper[i])
    s.scalar[SCALE] = factor
    return SOLVED if sane else NUMERICAL_FAILURE


@inlined
def _measure(s, i):
    """Note the only entry of a row of A, if it has one; return the square of its norm."""
    a, only = s.A[i], only_entry(s.A[i])
    s.index[UNIT, i], s.number[CUT, i] = only, 0.0
    s.number[ENTRY, i] = entry = a[only] if only >= 0 else 0.0
    return entry * entry if only >= 0 else inner_product(a, a)


@internal
def restore(s):
    """Give all rows back what was cut from them."""
    s.count[DIRTY] = 0
    for i in range(s.A.shape[0]):
        if s.number[CUT, i] > 0.0:
            s.count[FACTORED] = 0
            _measure(s, i)


@internal
def take_up(s):
    """Give all rows back what was cut, and those negligible beside other levels their norms."""
    restore(s)
    s.count[NEGLECTED] = s.count[FACTORED] = 0
    for i in range(s.A.shape[0]):
        s.number[NORM, i] = abs(s.number[NORM, i])


@inlined
def value_at(s, i):
    """Return row i, as it is after cuts, times x."""
    return inner_product(s.C[i], s.x) if s.number[CUT, i] > 0.0 else product_with(s, i, s.x)


@inlined
def product_with(s, i, p):
    """Return row i of A times p."""
    only = s.index[UNIT, i]
    return s.A[i, only] * p[only] if only >= 0 else inner_product(s.A[i], p)


@inlined
def side_at(s, i):
    """Return the side at which row i acts."""
    return s.number[LOWER, i] if s.index[STATE, i] < 0 else s.number[UPPER, i]


@internal
def meet(s, last):
    """Factor the rows that act in the first `last` levels, and write the x that meets them.

    Levels above the first in which other rows act than when they were factored keep their factors.
    """
    index, levels, first = s.index, s.multiplier.shape[0] - 1, _keep_factors(s, last)
    rank, rows = index[RANK, first], index[BEGIN, first]
    for k in range(first, levels):
        begin = rows
        _note_factors(s, k, rows, rank)
        if k >= last or s.count[WHOLE] >= 0:
            continue
        if gives_all(s, k, s.number[GRADIENT], s.number[SCRATCH]):
            assign(s.number[GOAL, :s.x.size], s.number[GRADIENT])
            s.count[WHOLE] = k
            continue
        s.count[FACTORED] = k + 1
        for i in range(index[FIRST, k], index[FIRST, k + 1]):
            index[ACTED, i] = index[STATE, i]
            if index[STATE, i] != FREE and s.number[NORM, i] > 0.0:
                index[LIST, rows] = i
                rows += 1
        if rows > begin:
            left = s.x.size - rank  # columns, where so few are left that they cost less than rows
            few = rank > s.count[PICKED] and 2 * left < s.x.size
            index[SHORT, k] = few and left + SPARED < rows - begin
            above, rank = rank, _factor(s, begin, rows, rank, index[SHORT, k] == 1)
            _solve(s, begin, rows, above, rank, index[SHORT, k] == 1)
    _note_factors(s, levels, rows, rank)
    _keep_goal(s, rank)
    _write_x(s, rank)


@inlined
def _keep_factors(s, last):
    """Return how many levels keep their factors, and go back to where they end."""
    index, number, scalar, kept, same = s.index, s.number, s.scalar, 0, True
    while same and kept < min(last, s.count[FACTORED]):
        for i in range(index[FIRST, kept], index[FIRST, kept + 1]):
            same = same and index[STATE, i] == index[ACTED, i]
        kept += same
    if kept == 0:
        number[SIZES, 0], number[PIVOTS, 0], number[SECONDS, 0] = 0.0, 1.0, 1.0
        index[BEGIN, 0] = index[RANK, 0] = 0
    for c in range(s.x.size):
        number[GOAL, c] = number[REFERENCE, c]
        if kept == 0:
            index[ORDER, c] = index[PLACE, c] = c
    scalar[SIZE], scalar[PIVOT] = number[SIZES, kept], number[PIVOTS, kept]
    scalar[SECOND], s.count[WHOLE], s.count[FACTORED] = number[SECONDS, kept], -1, kept
    s.count[PICKED] = min(s.count[PICKED], index[RANK, kept])
    return kept


@inlined
def _note_factors(s, k, rows, rank):
    """Note where the factors of level k begin, and what was found of those above."""
    s.index[BEGIN, k], s.index[RANK, k], s.index[SHORT, k] = rows, rank, 0
    s.number[SIZES, k], s.number[PIVOTS, k] = s.scalar[SIZE], s.scalar[PIVOT]
    s.number[SECONDS, k] = s.scalar[SECOND]


@inlined
def gives_all(s, k, goal, seen):
    """Whether level k gives each unknown one target, all of one weight; writes them as the goal.

    seen: scratch.
    """
    first, n, last = s.index[FIRST, k], s.x.size, s.index[FIRST, k + 1]
    if last - first != n:
        return False
    fill(seen[:n], 0.0)
    for i in range(first, last):
        c = s.index[UNIT, i]
        if (c < 0 or s.index[STATE, i] != EQUAL or s.number[NORM, i] != s.number[NORM, first]
                or seen[c] != 0.0 or s.number[NORM, i] <= 0.0):
            return False
        seen[c] = 1.0
        goal[c] = s.number[LOWER, i] / s.number[ENTRY, i]
    return True


@inlined
def _factor(s, begin, end, rank, short):
    """Give places begin .. end - 1 of the list columns of Q from `rank` on; return the new rank."""
    listed, single = s.index[LIST], rank == s.count[PICKED]
    for q in range(begin, end):
        single &= s.index[UNIT, listed[q]] >= 0
    if single:
        return _pick(s, begin, end, rank)
    for q in range(begin, end):
        i = listed[q]
        least = s.scalar[TOLERANCE] * s.number[NORM, i]
        s.number[ZEROED, q] = least * least
        fill(s.W[q], 0.0)
        add_row(s, i, 1.0, s.W[q])
    if short:
        _see_in_columns(s, begin, end, rank)
    else:
        reflect(s.basis, s.count[PICKED], rank, s.W, begin, end)
    above = rank
    rank = factor_level(Rows(s.W, listed, s.number[ZEROED], s.number[MISS]), s.basis, begin, end,
                        rank)
    for q in range(begin, begin + rank - above):
        note_pivot(s, abs(s.W[q, above + q - begin]) / s.number[NORM, listed[q]])
    for q in range(begin, end):  # rounding that other rows would be held against
        least = CANCELLED * s.number[NORM, listed[q]]
        for t in range(rank):
            s.W[q, t] = s.W[q, t] if abs(s.W[q, t]) > least else 0.0
    for q in range(begin + rank - above, end):
        _cut(s, q, rank)
    return rank


@inlined
def add_row(s, i, factor, w):
    """Add a multiple of row i, as it is after cuts, in the order of the columns."""
    if s.index[UNIT, i] >= 0:
        w[s.index[PLACE, s.index[UNIT, i]]] += factor * s.number[ENTRY, i]
    elif s.number[CUT, i] > 0.0:
        for t in range(s.x.size):
            w[t] += factor * s.C[i, s.index[ORDER, t]]
    else:
        for t in range(s.x.size):
            w[t] += factor * s.A[i, s.index[ORDER, t]]


@inlined
def _see_in_columns(s, begin, end, rank):
    """Replace rows by their products with the columns of Q from `rank` on, and zeros before."""
    n, w = s.x.size, s.number[SCRATCH]
    Z, _ = matrix(s.T, rank * s.W.shape[0], n - rank, n)
    for j in range(n - rank):
        for c in range(n):
            Z[j, c] = 1.0 if c == rank + j else 0.0
    reflect_back(s.basis, s.count[PICKED], rank, Z, 0, n - rank)
    for q in range(begin, end):
        c = s.index[UNIT, s.index[LIST, q]]
        for t in range(n):
            w[t], s.W[q, t] = s.W[q, t], 0.0
        for j in range(n - rank):
            s.W[q, rank + j] = (w[s.index[PLACE, c]] * Z[j, s.index[PLACE, c]] if c >= 0 else
                                inner_product(Z[j], w))


@inlined
def note_pivot(s, pivot):
    """Note the pivot of a row over its norm if it is one of the two smallest."""
    s.scalar[SECOND] = min(s.scalar[SECOND], max(s.scalar[PIVOT], pivot))
    s.scalar[PIVOT] = min(s.scalar[PIVOT], pivot)


@inlined
def _pick(s, begin, end, rank):
    """Take unknowns as columns, for rows of one entry, the heaviest of each; the others depend."""
    order, place, listed, entry = s.index[ORDER], s.index[PLACE], s.index[LIST], s.number[ENTRY]
    above, at = rank, begin
    for q in range(begin, end):
        c = s.index[UNIT, listed[q]]
        first = begin + place[c] - above
        if place[c] >= rank:
            other, old = order[rank], place[c]
            order[rank], order[old], place[c], place[other] = c, other, rank, old
            swap(listed, q, at)
            rank, at = rank + 1, at + 1
        elif place[c] >= above and abs(entry[listed[q]]) > abs(entry[listed[first]]):
            swap(listed, q, first)
    for q in range(begin, end):
        i = s.index[LIST, q]
        fill(s.W[q, :rank], 0.0)
        s.W[q, place[s.index[UNIT, i]]] = s.number[ENTRY, i]
    s.count[PICKED] = rank
    return rank


@inlined
def _cut(s, q, rank):
    """Cut from the dependent row at place q of the list what it has beyond the first columns."""
    i, n, most, part = s.index[LIST, q], s.x.size, 0.0, s.number[SCRATCH]
    for t in range(n):
        part[t] = s.W[q, t] if t >= rank else 0.0
        most = max(most, abs(part[t]))
        s.W[q, t] = s.W[q, t] if t < rank else 0.0
    if most <= NEGLIGIBLE * s.number[NORM, i]:
        return
    reflect_back(s.basis, s.count[PICKED], rank, s.number, SCRATCH, SCRATCH + 1)
    square = 0.0
    for t in range(n):
        c = s.index[ORDER, t]
        s.C[i, c] = (s.C[i, c] if s.number[CUT, i] > 0.0 else s.A[i, c]) - part[t]
        square += (s.C[i, c] - s.A[i, c]) ** 2
    s.number[CUT, i], s.index[UNIT, i], s.count[DIRTY] = np.sqrt(square), -1, 1


@inlined
def _solve(s, begin, end, above, rank, short):
    """Write y of the columns above .. rank - 1, and the residuals of a level."""
    y, miss, most, norm = s.number[Y], s.number[MISS], 0.0, 0.0
    if short:
        fill(y[above:s.x.size], 0.0)
        _write_x(s, above)
    for q in range(begin, end):
        i, w = s.index[LIST, q], s.W[q]
        rest = side_at(s, i)
        if short:
            rest -= value_at(s, i)
        for t in range(0 if short else above):
            rest -= w[t] * y[t]
        miss[q], most, norm = rest, max(most, abs(rest)), max(norm, s.number[NORM, i])
    if end - begin == rank - above:
        for t in range(above, rank):
            rest = miss[begin + t - above]
            for c in range(above, t):
                rest -= s.W[begin + t - above, c] * y[c]
            y[t], miss[begin + t - above] = rest / s.W[begin + t - above, t], 0.0
    elif rank > above:
        T, _ = matrix(s.T, above * s.W.shape[0], rank - above, end - begin)
        for k in range(T.shape[0]):
            for i in range(T.shape[1]):
                T[k, i] = s.W[begin + i, above + k] if k <= i else 0.0
        triangularise(T, s.number[DIAGONAL, above:])
        s.scalar[SIZE] = max(s.scalar[SIZE], most / norm)  # sides may cancel to their rounding
        turn(T, miss[begin:], False)
        for t in range(above, rank):
            y[t] = s.number[DIAGONAL, t]
            s.scalar[SIZE] = max(s.scalar[SIZE], abs(miss[begin + t - above] / y[t]))
        substitute_back(T, miss[begin:], y[above:])
        fill(miss[begin:begin + rank - above], 0.0)
        turn(T, miss[begin:], True)
    for t in range(above, rank):
        s.scalar[SIZE] = max(s.scalar[SIZE], abs(y[t]))


@inlined
def _keep_goal(s, rank):
    """Give y in the columns from `rank` on the goal."""
    n, goal, old = s.x.size, s.number[GOAL], s.number[SCRATCH]
    if goal[:n].any():
        assign(old[:n], goal)
        for t in range(n):
            goal[t] = old[s.index[ORDER, t]]
        reflect(s.basis, s.count[PICKED], rank, s.number, GOAL, GOAL + 1)
    assign(s.number[Y, rank:n], goal[rank:])


@inlined
def _write_x(s, rank):
    """Write x = Q y, by the first reflectors."""
    assign(s.number[SCRATCH, :s.x.size], s.number[Y])
    reflect_back(s.basis, s.count[PICKED], rank, s.number, SCRATCH, SCRATCH + 1)
    for t in range(s.x.size):
        s.x[s.index[ORDER, t]] = s.number[SCRATCH, t]
