"""An orthogonal tableau: the rows of a hierarchy in a basis that turns with the working set.

The tableau is M = Q^T [A^T, I] (n, g + n), one row for each basis vector: the coordinates of the g
rows of A with more than one entry, then the basis vector itself. A row of A with a single entry is
a multiple of a column of the identity, so a bound costs nothing. Each row of A that acts gets a
basis vector of its own and is zero beyond it: the acting rows are lower triangular.

Adding and removing a row is a few plane rotations of adjacent rows of M (Gill, Golub, Murray,
Saunders 1974), never a new factorisation. The columns of a row depend on that row alone, so rows of
very different norm do not disturb each other.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.space import View, integers, matrix, vector
from solvers.status import EQUAL, FREE

FIRST, BASE, REMOVED = range(3)  # entries of `at`


class Problem(NamedTuple):
    """The data, and what is known of each row.

    A (m, n), lower, upper (m,), sizes (L,). norm (m,): of each row. unit (m,): the unknown of a row
    with a single entry, -1 for others. entry (m,): that entry, 1 for others.
    """

    A: View
    lower: View
    upper: View
    sizes: View
    norm: View
    unit: View
    entry: View


class Record(NamedTuple):
    """What a solve leaves for the next: parts of one array, see `ActiveSetResolution`."""

    active: View
    held: View
    multiplier: View
    counts: View


class Tableau(NamedTuple):
    """M and where things are in it.

    column (m,): of each row of A. order (n,): the unknown that each basis vector was at first.
    at (3,): the first column still in use; that of the unknowns that are left; how many unknowns
    were removed, because they were put on a bound before all else. total (g + n,): scratch.
    """

    M: View
    column: View
    order: View
    at: View
    total: View


@inlined
def carve_problem(A, lower, upper, sizes, work, at):
    """Return a Problem, whose rows are not looked at yet, and where it ends."""
    norm, at = vector(work, at, A.shape[0])
    entry, at = vector(work, at, A.shape[0])
    unit, at = integers(work, at, A.shape[0])
    return Problem(A, lower, upper, sizes, norm, unit, entry), at


@inlined
def parts_of(record, m):
    """Return a Record of views."""
    return Record(record[:m], record[m:2 * m], record[2 * m:3 * m], record[3 * m:])


@inlined
def carve_tableau(work, at, m, n, general):
    """Return a Tableau for `general` rows with more than one entry, and where it ends."""
    M, at = matrix(work, at, n, general + n)
    column, at = integers(work, at, m)
    order, at = integers(work, at, n)
    places, at = integers(work, at, 3)
    total, at = vector(work, at, general + n)
    return Tableau(M, column, order, places, total), at


@compiled
def look_at_rows(problem, record, x):
    """Check all data, begin the record; return how many rows have several entries, -1 if bad.

    An active inequality whose side is missing is set free.
    """
    general, sane = 0, True
    for c in range(x.size):
        sane &= np.isfinite(x[c])
    for i in range(problem.norm.size):
        a, square, entries, only = problem.A[i], 0.0, 0, -1
        for c in range(a.size):
            square += a[c] * a[c]
            entries += 1 if a[c] != 0.0 else 0
        if entries == 1:
            only = 0
            while a[only] == 0.0:
                only += 1
        else:
            general += 1
        problem.norm[i], problem.unit[i] = np.sqrt(square), only
        problem.entry[i] = a[only] if only >= 0 else 1.0
        low, up = problem.lower[i], problem.upper[i]
        sane &= np.isfinite(square) and low <= up and low < np.inf and up > -np.inf
        act = record.active[i]
        if low == up:
            record.active[i] = EQUAL
        elif not ((act == 1.0 and up < np.inf) or (act == -1.0 and low > -np.inf)):
            record.active[i] = FREE
        record.held[i], record.multiplier[i] = -1.0, 0.0
    return general if sane else -1


@inlined
def open_tableau(problem, active, T, only_active):
    """Write M for Q = I: removed unknowns, equalities, inequalities, the unknowns that are left.

    So what is settled lies before what is not, and is left out of all that follows. Where only the
    active rows are wanted, the others have columns that are left out from the beginning.
    """
    M, order, removed = T.M, T.order, T.at[REMOVED]
    n, at = order.size, T.at[REMOVED]
    if only_active:
        for i in range(problem.unit.size):
            at += problem.unit[i] < 0 and active[i] == FREE
    T.at[FIRST] = at
    for equal in (True, False):
        for i in range(problem.unit.size):
            if problem.unit[i] < 0 and (active[i] == EQUAL) == equal and not (
                    only_active and active[i] == FREE):
                T.column[i] = at
                a = problem.A[i]
                for t in range(n):
                    M[t, at] = a[order[t]]
                at += 1
    T.at[BASE] = at
    for t in range(n):
        for c in range(removed):
            M[t, c] = 0.0
        for c in range(at, M.shape[1]):
            M[t, c] = 0.0
        column = t if t < removed else at + t - removed
        M[t, column] = 1.0
        T.total[order[t]] = column
    for i in range(problem.unit.size):
        if problem.unit[i] >= 0:
            T.column[i] = np.int64(T.total[problem.unit[i]])


@compiled
def reflect(M, k, end, column, first, total):
    """Reflect rows k .. end - 1 of M so that `column` is zero below row k.

    Columns from `first` on go along; total (g + n,) is scratch.
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
def left_of(problem, T, i, begin, end):
    """Squared norm of row i in the basis vectors begin .. end - 1."""
    square, column = 0.0, T.column[i]
    for t in range(begin, end):
        square += T.M[t, column] * T.M[t, column]
    return square * problem.entry[i] * problem.entry[i]


@inlined
def factor(problem, T, rows, q0, q1, begin, rank, rank_tolerance):
    """Give rows q0 .. q1 - 1 of a list basis vectors from `begin` on, the largest first.

    The first `rank` of them have theirs. The list is brought into pivot order; returns the rank.
    """
    n = T.M.shape[0]
    while q0 + rank < q1 and begin + rank < n:
        largest, best = 0.0, -1
        for q in range(q0 + rank, q1):
            least = rank_tolerance * problem.norm[rows[q]]
            square = left_of(problem, T, rows[q], begin + rank, n)
            if square > largest and square > least * least:
                largest, best = square, q
        if best < 0:
            break
        q = q0 + rank
        rows[q], rows[best] = rows[best], rows[q]
        reflect(T.M, begin + rank, n, T.column[rows[q]], T.at[FIRST], T.total)
        rank += 1
    return rank


@inlined
def value_of(problem, x, i):
    """Row i of A times x."""
    if problem.unit[i] >= 0:
        return problem.entry[i] * x[problem.unit[i]]
    total, a = 0.0, problem.A[i]
    for c in range(x.size):
        total += a[c] * x[c]
    return total


@inlined
def length_of(x):
    """Euclidean norm."""
    square = 0.0
    for c in range(x.size):
        square += x[c] * x[c]
    return np.sqrt(square)


@inlined
def asks_for_x(problem, active, first, last, goal, seen):
    """Whether rows first .. last - 1 ask each unknown for one value, all with one weight.

    Such a level is the way to a reference of its own, which is written into goal (n,). seen (n,) is
    scratch.
    """
    n = goal.size
    if last - first != n:
        return False
    for c in range(n):
        seen[c] = 0.0
    weight = abs(problem.entry[first])
    for i in range(first, last):
        c = problem.unit[i]
        if c < 0 or active[i] != EQUAL or abs(problem.entry[i]) != weight or seen[c] != 0.0:
            return False
        seen[c] = 1.0
        goal[c] = problem.lower[i] / problem.entry[i]
    return True
