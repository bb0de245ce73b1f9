"""Whether levels are plainly met: with short steps, and without any inequality in the way."""

import numpy as np

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.linalg.rows import (
    all_equal,
    factor_level,
    inequalities_hold,
    length_of,
    reflect,
    reflect_back,
)
from solvers.kernels.linalg.space import Rows, assign

_PIVOT = 1e-6  # of the norm of a row: a smaller one depends on others
ABOVE = 2.0    # times what a level bends: the most that curved levels above it add


@compiled
def plainly_met(A, lower, upper, offsets, half, bends):
    """Whether each curved level is met by the shortest step, with a multiplier |mu| <= 1 / alpha.

    bends (L,) : alpha = half max(|A|, bends) of a curved level, and `ABOVE` times that more below
    another; -1 for any other level. The step is the shortest from the x of the levels above, all of
    them being equalities or inequalities that hold there; so it is that of the problem with
    inequalities. In coordinates of Q the rows of a level end in a triangle L: its step is
    L^-1 (b - A x), its multiplier L^-T of that. False where this is not so.
    """
    (m, n), last, rank, most = A.shape, 0, 0, (1.0 + ABOVE) * half
    for k in range(len(bends)):
        if bends[k] >= 0.0:
            last = k + 1
    x, y, mu, basis = np.zeros((1, n)), np.zeros(n), np.empty(m), np.empty((n, n))
    rows = Rows(A.copy(), np.arange(m), np.empty(m), lower.copy())
    for k in range(last):
        first, end = offsets[k], offsets[k + 1]
        if all_equal(lower[first:end], upper[first:end]):
            if rank + end - first > n:
                return False
            for i in range(first, end):
                rows.zero[i] = (_PIVOT * length_of(A[i])) ** 2
            reflect(basis, 0, rank, rows.W, first, end)
            above, rank = rank, factor_level(rows, basis, first, end, rank)
            if rank - above < end - first:
                return False
            for i in range(first, end):
                t = above + i - first
                y[t] = mu[i] = (rows.miss[i] - inner_product(y[:t], rows.W[i])) / rows.W[i, t]
            if bends[k] >= 0.0:
                if not _is_short(rows, mu, first, end, above, half, bends[k]):
                    return False
                half = most
            assign(x[0], y)
            reflect_back(basis, 0, rank, x, 0, 1)
        if not inequalities_hold(A[:end], lower[:end], upper[:end], x[0]):
            return False
    return True


@inlined
def _is_short(rows, mu, first, end, above, half, bends):
    """Whether the multiplier of the step mu of a level is small enough."""
    square, of_multiplier = 0.0, 0.0
    for i in range(end - 1, first - 1, -1):
        for j in range(i + 1, end):
            mu[i] -= rows.W[j, above + i - first] * mu[j]
        mu[i] /= rows.W[i, above + i - first]
        of_multiplier += mu[i] ** 2
        square += inner_product(rows.W[i], rows.W[i])
    return half * max(np.sqrt(square), bends) * np.sqrt(of_multiplier) <= 1.0
