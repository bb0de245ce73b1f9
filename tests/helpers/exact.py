"""Reference answers in rational arithmetic, which share no code with any resolver."""

from __future__ import annotations

from fractions import Fraction

import numpy as np


def exact(h):
    """Return x (n,) of a hierarchy of equalities without rounding, except the conversion to floats.

    The numbers of h are taken as exact fractions, so there is no tolerance: rows that differ in
    their last digit are independent. For about ten unknowns; takes milliseconds.
    """
    x = [Fraction(0)] * h.n
    free = [[Fraction(int(i == c)) for i in range(h.n)] for c in range(h.n)]
    for A, b, _ in [*h.levels(), (np.eye(h.n), h.reference, h.reference)]:
        rows = [[Fraction(float(value)) for value in row] for row in A]
        missing = [Fraction(float(side)) - dot(row, x) for row, side in zip(rows, b, strict=True)]
        moved = [[dot(row, v) for row in rows] for v in free]  # by each free direction
        steps, pivots = reduced([[*(dot(u, w) for w in moved), dot(u, missing)] for u in moved])
        for row, pivot in zip(steps, pivots, strict=True):
            x = [value + row[-1] * step for value, step in zip(x, free[pivot], strict=True)]
        rest = [c for c in range(len(free)) if c not in pivots]
        free = [[free[c][i] - dot([row[c] for row in steps], [free[p][i] for p in pivots])
                 for i in range(h.n)] for c in rest]
    return np.array([float(value) for value in x])


def reduced(rows):
    """Return the reduced echelon form of consistent equations [a, b], and its pivots."""
    left, pivots = [list(row) for row in rows], []
    for c in range(len(rows[0]) - 1 if rows else 0):
        done = len(pivots)
        pivot = next((i for i in range(done, len(left)) if left[i][c]), None)
        if pivot is None:
            continue
        left[done], left[pivot] = left[pivot], left[done]
        head = [value / left[done][c] for value in left[done]]
        left = [[v - row[c] * w for v, w in zip(row, head, strict=True)] for row in left]
        left[done] = head
        pivots.append(c)
    return left[:len(pivots)], pivots


def dot(u, v):
    return sum((a * b for a, b in zip(u, v, strict=True)), Fraction(0))
