"""What one level does with its rows in an orthogonal tableau: its step, and who holds it back.

With the rows of a level lower triangular in its basis vectors, y solves L y = rest where they are
independent, and the least squares problem where they are not. The force lambda_t of each row above,
by back substitution in sum_t lambda_t a_t = -A_k^T w_k, says whether that row holds the level back.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.compiled import compiled, inlined
from solvers.kernels.block import level_damping
from solvers.kernels.space import Block, View
from solvers.kernels.tableau import left_of
from solvers.kernels.tolerances import CANCELLED


class Part(NamedTuple):
    """A level's part: rows q0 .. q1 - 1 of a list, and `rank` basis vectors from `begin` on."""

    q0: View
    q1: View
    begin: View
    rank: View


class Pull(NamedTuple):
    """A level's pull on the basis vectors above it, and the forces that balance it.

    g (n,): the pull; terms (n,): the absolute sum of its terms; force (n,): of the row that owns
    the basis vector; share (n,): what it balances.
    """

    g: View
    terms: View
    force: View
    share: View


@inlined
def solve_part(problem, T, rows, part, rest, y, w, room):
    """Write the step y of a level that is not damped, and w, what its rows have too much after it.

    rest: what the rows of the list miss before. Rows that are independent are met, w is zero.
    Returns the size of the numbers met.
    """
    begin, rank, size = part.begin, part.rank, 0.0
    for q in range(part.q0, part.q1):
        w[q] = 0.0
    if part.q1 - part.q0 == rank:
        for t in range(rank):
            i, left = rows[part.q0 + t], rest[part.q0 + t]
            column, entry = T.column[i], problem.entry[i]
            diagonal = entry * T.M[begin + t, column]
            size = max(size, abs(left / diagonal))
            for c in range(t):
                left -= entry * T.M[begin + c, column] * y[c]
            y[t] = left / diagonal
        return size
    return least_squares_part(problem, T, rows, part, rest, y, w, room, 0.0)


@inlined
def least_squares_part(problem, T, rows, part, rest, y, w, room, damped):
    """Like `solve_part`, with a damping, whose own targets come in as y."""
    s, rank = part.q1 - part.q0, part.rank
    height = s + rank if damped > 0.0 else s
    L, size = room[:height * (rank + 1)].reshape((rank + 1, height)), 0.0
    for q in range(s):
        i = rows[part.q0 + q]
        column, entry = T.column[i], problem.entry[i]
        for c in range(rank):
            L[c, q] = entry * T.M[part.begin + c, column] if c <= q else 0.0
        L[rank, q] = rest[part.q0 + q]
        if q < rank:
            size = max(size, abs(rest[part.q0 + q] / L[q, q]))
    for q in range(s, height):
        for c in range(rank):
            L[c, q] = damped if q - s == c else 0.0
        L[rank, q] = damped * y[q - s]
    least_squares(L, y, room[L.size:], height, rank)
    for q in range(s):
        w[part.q0 + q] = -L[rank, q]
    return size


@compiled
def least_squares(T, y, diagonal, s, r):
    """Write into y[:r] what minimises |T y - b|, for T (r + 1, s) by columns with b the last.

    b goes out as what is still missed. It comes out of the reflections, not as a difference, so
    the little that a heavy row misses is as exact as the rest (Cox, Higham 1998). The rows come in
    pivot order, the heaviest first. diagonal (r,) is scratch.
    """
    b = T[r]
    for k in range(r):
        v = T[k, k:]
        norm = 0.0
        for i in range(v.size):
            norm += v[i] * v[i]
        norm = -np.sqrt(norm) if v[0] > 0.0 else np.sqrt(norm)
        diagonal[k] = norm
        v[0] -= norm
        for j in range(k + 1, r + 1):
            _reflect(v, T[j, k:], norm)
    for k in range(r - 1, -1, -1):
        rest = b[k]
        for j in range(k + 1, r):
            rest -= T[j, k] * y[j]
        y[k] = rest / diagonal[k]
    for k in range(r):
        b[k] = 0.0
    for k in range(r - 1, -1, -1):
        _reflect(T[k, k:], b[k:], diagonal[k])


@inlined
def _reflect(v, b, norm):
    """Apply the reflector of v, which maps a column onto `norm` times the first unit vector."""
    total = 0.0
    for i in range(v.size):
        total += v[i] * b[i]
    total /= norm * v[0]
    for i in range(v.size):
        b[i] += total * v[i]


@inlined
def damping_of(problem, T, rows, part, settings, room):
    """Return lambda of a level, see `Resolver`."""
    s, rank = part.q1 - part.q0, part.rank
    L = room[:s * rank].reshape((s, rank))
    for q in range(s):
        i = rows[part.q0 + q]
        for c in range(rank):
            L[q, c] = problem.entry[i] * T.M[part.begin + c, T.column[i]] if c <= q else 0.0
    zero = 0 * s
    return level_damping(L, Block(zero, s, zero, rank), settings, room[s * rank:])


@inlined
def pull_of_rows(problem, T, rows, part, w, pull, begin, end):
    """Add w times the rows of a level, in the basis vectors begin .. end - 1, to its pull."""
    for q in range(part.q0, part.q1):
        push, column = w[q] * problem.entry[rows[q]], T.column[rows[q]]
        if push != 0.0:
            for t in range(begin, end):
                term = push * T.M[t, column]
                pull.g[t] += term
                pull.terms[t] += abs(term)


@inlined
def balance(problem, T, owner, pull, begin, end, removed):
    """Write the forces of the rows that own the basis vectors begin .. end - 1.

    owner (n,): the row of a basis vector, -1 for none. The first `removed` vectors are unknowns
    that were removed: their rows pull on nothing else. A force that its terms cancel to is zero.
    """
    for t in range(end - 1, begin - 1, -1):
        pull.force[t], pull.share[t] = 0.0, abs(pull.g[t])
        i = owner[t]
        if i < 0 or pull.share[t] <= CANCELLED * pull.terms[t]:
            continue
        column, entry = T.column[i], problem.entry[i]
        pull.force[t] = -pull.g[t] / (entry * T.M[t, column])
        if t >= removed:
            for c in range(begin, t):
                term = pull.force[t] * entry * T.M[c, column]
                pull.g[c] += term
                pull.terms[c] += abs(term)


@inlined
def nearly_parallel(problem, T, rows, part, above, v, rank_tolerance):
    """Whether a row of a level depends on its others but for a share below rank_tolerance.

    The basis vectors above .. part.begin - 1 belong to rows that are only held. v (n,) is scratch.
    """
    M, h, n = T.M, part.begin - above, T.M.shape[0]
    for q in range(part.q0 + part.rank, part.q1):
        i = rows[q]
        square, norm = 0.0, problem.norm[i]
        for t in range(above, n):
            v[t - above] = M[t, T.column[i]] * problem.entry[i]
        for c in range(part.rank - 1, -1, -1):
            j = rows[part.q0 + c]
            share = v[h + c] / M[part.begin + c, T.column[j]]
            if abs(share / problem.entry[j]) * problem.norm[j] > rank_tolerance * norm:
                for t in range(h + c + 1):
                    v[t] -= share * M[above + t, T.column[j]]
        for t in range(n - above):
            square += v[t] * v[t]
        if (CANCELLED * norm) ** 2 < square <= (rank_tolerance * norm) ** 2:
            return True
    return False


@inlined
def smallest_share(problem, T, owner, begin, end):
    """Return the least that is left of a row in its own basis vector, as a share of its norm."""
    least = 1.0
    for t in range(begin, end):
        i = owner[t]
        if i >= 0:
            least = min(least, np.sqrt(left_of(problem, T, i, t, t + 1)) / problem.norm[i])
    return least
