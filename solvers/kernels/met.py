"""Whether levels are plainly met: with short steps, and without any inequality in the way."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled, inlined

_PIVOT = 1e-12  # of the largest: a smaller one is a row that depends on others


@compiled
def plainly_met(A, lower, upper, offsets, least):
    """Whether each curved level is met by the shortest step, with a multiplier |y| <= 1 / alpha.

    least (L,) : alpha / |A| of a curved level of equalities, -1 for any other level. The step is
    the shortest from the x of the levels above, all of them being equalities or inequalities that
    hold there; so it is that of the problem with inequalities, and y = (P P^T)^-1 (b - A x) of the
    rows P that the levels above leave of A is its multiplier. False where this is not so.
    """
    n, last = A.shape[1], 0
    for k in range(len(least)):
        if least[k] >= 0.0:
            last = k + 1
    x, y = np.zeros(n), np.empty(n)
    P, held, L = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    count = 0
    for k in range(last):
        first, m = offsets[k], offsets[k + 1] - offsets[k]
        if _equal_rows(lower, upper, first, m):
            if count + m > n:
                return False
            _project(A, lower, (first, m, count), x, held, P, y)
            if not _solve(P, m, L, y):
                return False
            if least[k] >= 0.0 and not least[k] * _length(A, first, m) * _norm(y, m) <= 1.0:
                return False
            for i in range(m):
                for c in range(n):
                    x[c] += P[i, c] * y[i]
            count = _hold(P, m, held, count)
        if not _within(A, lower, upper, x, offsets[k + 1]):
            return False
    return True


@inlined
def _equal_rows(lower, upper, first, m):
    """Whether all rows of a level are equalities."""
    count = 0
    for i in range(first, first + m):
        count += lower[i] == upper[i]
    return count == m


@compiled
def _project(A, b, rows, x, held, P, y):
    """Write b - A x into y and what the directions held leave of A into P."""
    n, (first, m, count) = len(x), rows
    for i in range(m):
        y[i] = b[first + i]
        for c in range(n):
            P[i, c] = A[first + i, c]
            y[i] -= P[i, c] * x[c]
        for j in range(count):
            along = 0.0
            for c in range(n):
                along += P[i, c] * held[j, c]
            for c in range(n):
                P[i, c] -= along * held[j, c]


@compiled
def _solve(P, m, L, y):
    """Turn y into (P P^T)^-1 y by Cholesky, unless rows of P depend on each other."""
    largest = 0.0
    for i in range(m):
        for j in range(i + 1):
            L[i, j] = 0.0
            for c in range(P.shape[1]):
                L[i, j] += P[i, c] * P[j, c]
            for c in range(j):
                L[i, j] -= L[i, c] * L[j, c]
            if i == j:
                largest = max(largest, L[i, i])
                if not L[i, i] > _PIVOT * largest:
                    return False
                L[i, i] = np.sqrt(L[i, i])
            else:
                L[i, j] /= L[j, j]
    for i in range(m):
        for c in range(i):
            y[i] -= L[i, c] * y[c]
        y[i] /= L[i, i]
    for i in range(m - 1, -1, -1):
        for c in range(i + 1, m):
            y[i] -= L[c, i] * y[c]
        y[i] /= L[i, i]
    return True


@compiled
def _hold(P, m, held, count):
    """Add the directions of P to those held, orthonormal; return how many these are."""
    n = P.shape[1]
    for i in range(m):
        for c in range(n):
            held[count, c] = P[i, c]
        for j in range(count):
            along = 0.0
            for c in range(n):
                along += held[count, c] * held[j, c]
            for c in range(n):
                held[count, c] -= along * held[j, c]
        size = 0.0
        for c in range(n):
            size += held[count, c] ** 2
        for c in range(n):
            held[count, c] /= np.sqrt(size)
        count += 1
    return count


@compiled
def _within(A, lower, upper, x, m):
    """Whether the inequalities among the first m rows hold at x."""
    for i in range(m):
        if lower[i] != upper[i]:
            value = 0.0
            for c in range(len(x)):
                value += A[i, c] * x[c]
            if not lower[i] <= value <= upper[i]:
                return False
    return True


@inlined
def _length(A, first, m):
    """The Frobenius norm of m rows."""
    total = 0.0
    for i in range(first, first + m):
        for c in range(A.shape[1]):
            total += A[i, c] ** 2
    return np.sqrt(total)


@inlined
def _norm(y, m):
    """The length of the first m entries."""
    total = 0.0
    for i in range(m):
        total += y[i] ** 2
    return np.sqrt(total)
