"""Damping as rows: the damped hierarchy is one without damping that has a few rows more.

The staircase of the equalities, without any inequality, gives each level k the columns Q_k that it
adds, and its lambda. Damped, the level minimises |A_k x - b_k|^2 + lambda^2 |Q_k^T x|^2: the rows
lambda Q_k^T join it, with targets of zero. Neither depends on which inequalities act, so for any
sides this is one convex problem for each level, and its answer varies continuously with them. Where
no inequality acts it is the x of `tpm`. A level of bounds on single unknowns is not damped: a fixed
joint stays where it is.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

from hierarchy.jit import compiled, inlined
from solvers.kernels.block import level_damping
from solvers.kernels.rows import ZERO, factor_level, reflect, reflect_back
from solvers.kernels.space import Block, View, integers, matrix, shared, vector
from solvers.kernels.staircase import carve_staircase


class Damped(NamedTuple):
    """A hierarchy with damping as rows: A (m + n, n), lower, upper (m + n,), sizes (L,) int64.

    origin (m + n,) int64: the row that each was, -1 for one of damping.
    """

    A: View
    lower: View
    upper: View
    sizes: View
    origin: View


@inlined
def damped_size(n, m):
    """Return the numbers that `write_damped` needs, those of a Staircase."""
    return m * (n + 3) + n * (n + 3) + (m + n) * (n + 1)


@inlined
def carve_damped(sizes, work, at, m, n):
    """Return a Damped without data, and where it ends."""
    A, at = matrix(work, at, m + n, n)
    lower, at = vector(work, at, m + n)
    upper, at = vector(work, at, m + n)
    levels, at = integers(work, at, sizes.size)
    origin, at = integers(work, at, m + n)
    return Damped(A, lower, upper, levels, origin), at


@compiled
def write_damped(d, A, lower, upper, sizes, settings, work):
    """Write a hierarchy with its damping as rows; return the number of rows."""
    m, n = A.shape
    (basis, rows, _, of_x, of_block), _ = carve_staircase(work, ZERO, m, n)
    settings, rank, first, count = shared(settings), ZERO, ZERO, ZERO
    for k in range(sizes.size):
        begin, equal, box = count, ZERO, True
        for i in range(first, first + sizes[k]):
            _copy_row(d, A[i], lower[i], upper[i], count)
            d.origin[count] = i
            entries = 0
            for c in range(n):
                entries += A[i, c] != 0.0
            box = box and entries <= 1
            if lower[i] == upper[i]:
                square = 0.0
                for c in range(n):
                    rows.W[equal, c] = A[i, c]
                    square += A[i, c] * A[i, c]
                rows.zero[equal] = settings.rank_tolerance * settings.rank_tolerance * square
                equal += 1
            count += 1
        reflect(basis, ZERO, rank, rows.W, ZERO, equal)
        above, rank = rank, factor_level(rows, basis, ZERO, equal, rank)
        damped = 0.0
        if rank > above and not (box and equal < sizes[k]):
            damped = level_damping(rows.W, Block(ZERO, equal, above, rank), settings, of_block)
        for t in range(above, rank if damped > 0.0 else above):
            for c in range(n):
                of_x[0, c] = damped if c == t else 0.0
            reflect_back(basis, rank, of_x, ZERO, ZERO + 1)
            _copy_row(d, of_x[0], 0.0, 0.0, count)
            d.origin[count] = -1
            count += 1
        d.sizes[k], first = count - begin, first + sizes[k]
    return count


@inlined
def _copy_row(d, a, low, up, at):
    """Append a row with its sides."""
    for c in range(a.size):
        d.A[at, c] = a[c]
    d.lower[at], d.upper[at] = low, up
