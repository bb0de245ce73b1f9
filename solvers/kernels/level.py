"""One level in an orthogonal tableau: its step, and the rows that hold it back.

With the rows of a level lower triangular in its basis vectors, y solves L y = rest if they are
independent, and the least squares problem if they are not. The force lambda_t of each row above,
by back substitution in sum_t lambda_t a_t = -A_k^T w_k, says whether that row holds the level back.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import as_matrix, compiled, inlined
from solvers.kernels.block import level_damping
from solvers.kernels.rows import ZERO, reflect, reflect_back
from solvers.kernels.space import Basis, Block, Settings, View
from solvers.kernels.tableau import (
    COLUMN,
    ENTRY,
    FORCE,
    LIST,
    NORM,
    OVER,
    OWNER,
    PULL,
    PULLED,
    REST,
    ROUNDING,
    SCALE,
    SHARE,
    SIZE,
    STEP,
    WORST,
    Z,
    around,
    left_of,
    side_of,
)
from solvers.kernels.tolerances import BRINK, CANCELLED, DOUBTFUL, EPSILON, SAME


class Part(NamedTuple):
    """A level's part: rows q0 .. q1 - 1 of the list, and `rank` basis vectors from `begin` on."""

    q0: View
    q1: View
    begin: View
    rank: View


@inlined
def solve_part(s, part):
    """Write the step of an undamped level into Z, and the excess of its rows after the step.

    Independent rows are met. Returns the size of the largest numbers involved.
    """
    begin, rank, size, y = part.begin, part.rank, 0.0, s.number[Z, part.begin:]
    if part.q1 - part.q0 > rank:
        return least_squares_part(s, part, 0.0)
    for t in range(rank):
        i, left = s.index[LIST, part.q0 + t], s.number[REST, part.q0 + t]
        column, entry = s.index[COLUMN, i], s.number[ENTRY, i]
        diagonal = entry * s.M[begin + t, column]
        size = max(size, abs(left / diagonal))
        for c in range(t):
            left -= entry * s.M[begin + c, column] * y[c]
        y[t] = left / diagonal
        s.number[OVER, part.q0 + t] = 0.0
    return size


@inlined
def least_squares_part(s, part, damped):
    """Like `solve_part`, with damping; the targets of the damping are Z on entry."""
    rows, rank, size, least = part.q1 - part.q0, part.rank, 0.0, s.settings.rank_tolerance
    height = rows + rank if damped > 0.0 else rows
    L, y = as_matrix(s.room[:height * (rank + 1)], rank + 1, height), s.number[Z, part.begin:]
    for q in range(rows):
        i, rest = s.index[LIST, part.q0 + q], s.number[REST, part.q0 + q]
        column, entry = s.index[COLUMN, i], s.number[ENTRY, i]
        seen = left_of(s, i, part.begin, part.begin + rank) > (least * s.number[NORM, i]) ** 2
        for c in range(rank):  # entries of a row in the span of the rows above are rounding
            L[c, q] = entry * s.M[part.begin + c, column] if c <= q and seen else 0.0
        L[rank, q] = rest
        if q < rank:
            size = max(size, abs(rest / L[q, q]))
    for q in range(rows, height):
        for c in range(rank):
            L[c, q] = damped if q - rows == c else 0.0
        L[rank, q] = damped * y[q - rows]
    least_squares(L, y, s.room[L.size:])
    for q in range(rows):
        s.number[OVER, part.q0 + q] = -L[rank, q]
    return size


@compiled
def least_squares(T, y, work):
    """Write into y[:r] the minimiser of |T y - b|, for T (r + 1, s) by columns with b the last.

    b is the residual on return. It comes from the reflections, not from a difference, so the small
    residual of a heavy row is as accurate as the rest (Cox, Higham 1998). The rows are in pivot
    order, the heaviest first. work (2 r,) is scratch.
    """
    r = T.shape[0] - 1
    basis, diagonal, b = Basis(T, work[:r]), work[r:], T[r]
    for k in range(r):
        v = T[k, k:]
        square = 0.0
        for i in range(v.size):
            square += v[i] * v[i]
        norm = -np.sqrt(square) if v[0] > 0.0 else np.sqrt(square)
        diagonal[k] = norm
        v[0] -= norm
        basis.beta[k] = -1.0 / (norm * v[0])
        reflect(basis, k, k + 1, T, k + 1, r + 1)
    for k in range(r - 1, -1, -1):
        rest = b[k]
        for j in range(k + 1, r):
            rest -= T[j, k] * y[j]
        y[k] = rest / diagonal[k]
    for k in range(r):
        b[k] = 0.0
    reflect_back(basis, r, T, r, r + 1)


@inlined
def damping_of(s, part):
    """Return lambda of a level, see `Resolver`."""
    rows, rank = part.q1 - part.q0, part.rank
    L = as_matrix(s.room[:rows * rank], rows, rank)
    for q in range(rows):
        i = s.index[LIST, part.q0 + q]
        column, entry = s.index[COLUMN, i], s.number[ENTRY, i]
        for c in range(rank):
            L[q, c] = entry * s.M[part.begin + c, column] if c <= q else 0.0
    shared = Settings(s.settings.damping, s.settings.threshold, s.settings.rank_tolerance)
    return level_damping(L, Block(ZERO, rows, ZERO, rank), shared, s.room[rows * rank:])


@inlined
def weigh_rows(s, part):
    """Write the largest miss of the rows of a level, and the sum of their pulls.

    If the misses are rounding in all rows, they count as zero; in a single row the miss may be what
    balances a light row. The share of rounding in a pull is that in the miss.
    """
    worst = pulled = 0.0
    missed = False
    for q in range(part.q0, part.q1):
        i, over = s.index[LIST, q], abs(s.number[OVER, q])
        norm, side = s.number[NORM, i], side_of(s.number, i)
        missed |= over > EPSILON * around(norm, side, s.scalar[SIZE])
        pulled += norm * over
        if over > 0.0:
            worst = max(worst, over / around(norm, side, s.scalar[SCALE]))
    if not missed:
        worst = pulled = 0.0
        for q in range(part.q0, part.q1):
            s.number[OVER, q] = 0.0
    s.scalar[WORST], s.scalar[PULLED] = worst, pulled
    length = worst * s.scalar[SCALE]
    share = min(EPSILON * s.scalar[SIZE] / length, 1.0) if length > 0.0 else 0.0
    s.scalar[ROUNDING] = pulled * max(CANCELLED, share)


@inlined
def is_uneven(s, part, share):
    """Whether a row of a level is smaller than this share of another."""
    least, most = np.inf, 0.0
    for q in range(part.q0, part.q1):
        norm = s.number[NORM, s.index[LIST, q]]
        least, most = min(least, norm), max(most, norm)
    return least < share * most


@inlined
def is_unclear(s, i, begin, end):
    """Whether a dependent row is only nearly so.

    Little, but more than nothing, is left of it from basis vector `begin` on, where its level
    begins, or hardly less than counts as something from `end` on, where its level ends.
    """
    least = s.settings.rank_tolerance * s.number[NORM, i]
    left, beyond = left_of(s, i, begin, s.x.size), left_of(s, i, end, s.x.size)
    nearly = least * least < left < (DOUBTFUL * s.number[NORM, i]) ** 2
    return nearly or beyond > (BRINK * least) ** 2


@inlined
def pull_of_rows(s, part, begin, end):
    """Add the excess of the rows of a level, times the rows, to its pull.

    In the basis vectors begin .. end - 1.
    """
    pull = s.number[PULL]
    for q in range(part.q0, part.q1):
        i = s.index[LIST, q]
        push, column = s.number[OVER, q] * s.number[ENTRY, i], s.index[COLUMN, i]
        if push != 0.0:
            for t in range(begin, end):
                pull[t] += push * s.M[t, column]


@inlined
def balance(s, begin, end, removed):
    """Write the forces of the rows that own the basis vectors begin .. end - 1.

    The first `removed` vectors are removed unknowns: their rows pull on nothing else. A pull that
    may be rounding alone counts as zero: every entry of a row is rounded relative to its norm.
    """
    pull, force, share = s.number[PULL], s.number[FORCE], s.number[SHARE]
    rounding = s.scalar[ROUNDING]
    for t in range(end - 1, begin - 1, -1):
        force[t], share[t] = 0.0, abs(pull[t])
        i = s.index[OWNER, t]
        if i < 0 or share[t] <= rounding:
            continue
        column, entry = s.index[COLUMN, i], s.number[ENTRY, i]
        force[t] = -pull[t] / (entry * s.M[t, column])
        if t >= removed:
            rounding += CANCELLED * abs(force[t]) * s.number[NORM, i]
            for c in range(begin, t):
                pull[c] += force[t] * entry * s.M[c, column]


@inlined
def nearly_parallel(s, part, above):
    """Whether a row of a level depends on its other rows, up to a share of rank_tolerance.

    The basis vectors above .. part.begin - 1 belong to rows that are only held.
    """
    M, h, n, v = s.M, part.begin - above, s.x.size, s.number[STEP]
    least = s.settings.rank_tolerance
    for q in range(part.q0 + part.rank, part.q1):
        i = s.index[LIST, q]
        square, norm = 0.0, s.number[NORM, i]
        for t in range(above, n):
            v[t - above] = M[t, s.index[COLUMN, i]] * s.number[ENTRY, i]
        for c in range(part.rank - 1, -1, -1):
            j = s.index[LIST, part.q0 + c]
            share = v[h + c] / M[part.begin + c, s.index[COLUMN, j]]
            if abs(share / s.number[ENTRY, j]) * s.number[NORM, j] > least * norm:
                for t in range(h + c + 1):
                    v[t] -= share * M[above + t, s.index[COLUMN, j]]
        for t in range(n - above):
            square += v[t] * v[t]
        if (SAME * norm) ** 2 < square <= (least * norm) ** 2:
            return True
    return False


@inlined
def smallest_share(s, begin, end):
    """Return the smallest share of a row in its own basis vector, relative to its norm."""
    least = 1.0
    for t in range(begin, end):
        i = s.index[OWNER, t]
        if i >= 0:
            least = min(least, np.sqrt(left_of(s, i, t, t + 1)) / s.number[NORM, i])
    return least
