"""Reference answers in rational arithmetic, which share no code with any resolver."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from hierarchy.problem import Array, Hierarchy

Row = list[Fraction]


def exact(h: Hierarchy) -> Array:
    """Return x (n,) of a hierarchy of equalities without rounding, except the conversion to floats.

    The numbers of h are taken as exact fractions, so there is no tolerance: rows that differ in
    their last digit are independent. For about ten unknowns; takes milliseconds.
    """
    settled: list[Row] = []  # [a, a x] of the rows above
    for A, b, _ in [*h.levels(), (np.eye(h.n), h.reference, h.reference)]:
        rows = [[Fraction(float(value)) for value in row] for row in np.column_stack([A, b])]
        settled, pivots = _reduced(settled)
        x, free = _solutions(settled, pivots, h.n)
        x = _least_squares(rows, x, free)
        settled += [[*row[:-1], _dot(row[:-1], x)] for row in rows]
    return np.array([float(value) for value in x])


def _solutions(rows: Sequence[Row], pivots: Sequence[int], n: int) -> tuple[Row, list[Row]]:
    """Return one solution of reduced rows, and a basis of their null space."""
    x, free = [Fraction(0)] * n, []
    for row, pivot in zip(rows, pivots, strict=True):
        x[pivot] = row[n]
    for c in sorted(set(range(n)) - set(pivots)):
        v = [Fraction(int(i == c)) for i in range(n)]
        for row, pivot in zip(rows, pivots, strict=True):
            v[pivot] = -row[c]
        free.append(v)
    return x, free


def _least_squares(rows: Sequence[Row], x: Row, free: Sequence[Row]) -> Row:
    """Move x in the null space to the least-squares solution of the rows [a, b]."""
    missing = [row[-1] - _dot(row[:-1], x) for row in rows]
    columns = [[_dot(row[:-1], v) for row in rows] for v in free]
    normal = [[*(_dot(u, w) for w in columns), _dot(u, missing)] for u in columns]
    for row, pivot in zip(*_reduced(normal), strict=True):
        x = [value + row[-1] * step for value, step in zip(x, free[pivot], strict=True)]
    return x


def _reduced(rows: Sequence[Row]) -> tuple[list[Row], list[int]]:
    """Return the reduced echelon form of consistent equations [a, b], and its pivots."""
    left, done, pivots = [list(row) for row in rows], 0, []
    for c in range(len(rows[0]) - 1 if rows else 0):
        pivot = next((i for i in range(done, len(left)) if left[i][c]), None)
        if pivot is None:
            continue
        left[done], left[pivot] = left[pivot], left[done]
        head = [value / left[done][c] for value in left[done]]
        left = [row if not row[c] else [v - row[c] * w for v, w in zip(row, head, strict=True)]
                for row in left]
        left[done] = head
        pivots.append(c)
        done += 1
    return left[:done], pivots


def _dot(u: Iterable[Fraction], v: Iterable[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(u, v, strict=True)), Fraction(0))
