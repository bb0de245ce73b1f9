"""The small problem of one level: min ||M y - r||^2 + lambda^2 ||y||^2, lambda from damping."""

import numpy as np

from hierarchy.jit import as_matrix, inner_product, internal
from solvers.kernels.linalg.least_squares import least_squares
from solvers.kernels.linalg.space import matrix
from solvers.kernels.tolerances import ORTHOGONAL, SWEEPS


@internal
def solve_level(M, r, y, at, settings, work):
    """Write into y the step of one level, whose rows and columns of M are the block `at`.

    The block is lower trapezoidal with a nonzero diagonal: its rows in pivot order, in the columns
    that the level adds. r is the residual of the rows. work: at least (m + n) (n + 1) numbers, any
    contents.
    """
    damped = 0.0
    if settings.damping > 0.0 and at.k1 > at.k0:
        damped = level_damping(M, at, settings, work)
    solve_damped_level(M, r, y, at, damped, work)


@internal
def solve_damped_level(M, r, y, at, damped, work):
    """Like `solve_level`, for a given lambda."""
    rank, rows = at.k1 - at.k0, at.i1 - at.i0
    if damped == 0.0 and rows == rank:
        for k in range(at.k0, at.k1):
            i = at.i0 + k - at.k0
            y[k] = (r[i] - inner_product(y[at.k0:k], M[i, at.k0:])) / M[i, k]
    elif rank == 1:
        k, along, square = at.k0, 0.0, damped * damped
        for i in range(at.i0, at.i1):
            along += M[i, k] * r[i]
            square += M[i, k] * M[i, k]
        y[k] = along / square
    elif rank > 0:  # by reflections of [M r; lambda I 0]
        height = rows + rank if damped > 0.0 else rows
        T, _ = matrix(work, 0, rank + 1, height)
        for k in range(rank + 1):
            for i in range(rows):
                T[k, i] = M[at.i0 + i, at.k0 + k] if k < rank else r[at.i0 + i]
            for i in range(rows, height):
                T[k, i] = damped if i - rows == k else 0.0
        least_squares(T[:rank], T[rank], y[at.k0:])


@internal
def level_damping(M, at, settings, work):
    """Return lambda, with lambda^2 = (1 - (s / threshold)^2) damping^2 for s < threshold, else 0.

    s is the smallest singular value of the block, one per row: 0 where rank < rows. It is computed
    only if the cheap bound s >= 1 / ||L^-1||_F is not above the threshold.
    """
    p, threshold = at.k1 - at.k0, settings.threshold
    if at.i1 - at.i0 > p:
        return settings.damping
    L = as_matrix(work[:p * p], p, p)
    if invert_triangle(M, L, at.i0, at.k0, p) * threshold * threshold <= 1.0:
        return 0.0
    for i in range(p):
        for j in range(p):
            L[i, j] = M[at.i0 + i, at.k0 + j] if i >= j else 0.0
    orthogonalise_rows(L, as_matrix(work[:0], p, 0))
    ratio = smallest_square(L) / (threshold * threshold)
    return settings.damping * np.sqrt(1.0 - ratio) if ratio < 1.0 else 0.0


@internal
def invert_triangle(M, T, i0, k0, p):
    """Write the inverse transpose of a lower triangle into T (p, p); return its squared norm.

    The triangle L is rows i0 .. i0 + p - 1 and columns k0 .. k0 + p - 1 of M. Its smallest singular
    value is at least 1 / ||L^-1||_F. Where L is singular, entries of T are infinite.
    """
    square = 0.0
    for j in range(p):
        for i in range(j):
            T[j, i] = 0.0
        for i in range(j, p):
            value = 1.0 if i == j else 0.0
            for k in range(j, i):
                value -= M[i0 + i, k0 + k] * T[j, k]
            if M[i0 + i, k0 + i] == 0.0:
                for k in range(i, p):
                    T[j, k] = np.inf
                square = np.inf
                break
            T[j, i] = value / M[i0 + i, k0 + i]
            square += T[j, i] * T[j, i]
    return square


@internal
def smallest_square(W):
    """Return the smallest squared norm of the rows of W."""
    smallest = np.inf
    for i in range(W.shape[0]):
        smallest = min(smallest, inner_product(W[i], W[i]))
    return smallest


@internal
def orthogonalise_rows(W, U):
    """Rotate the rows of W and U until the rows of W are orthogonal (Hestenes).

    The norms of the rows of W are then the singular values of the original W. If U was the
    identity, the original W is U^T W.
    """
    for _ in range(SWEEPS):
        settled = True
        for i in range(W.shape[0] - 1):
            for j in range(i + 1, W.shape[0]):
                a, b = inner_product(W[i], W[i]), inner_product(W[j], W[j])
                c = inner_product(W[i], W[j])
                if abs(c) <= ORTHOGONAL * np.sqrt(a) * np.sqrt(b):  # c^2 may overflow
                    continue
                settled = False
                zeta = (b - a) / (2.0 * c)
                t = 1.0 / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                t = t if zeta >= 0.0 else -t
                cosine = 1.0 / np.sqrt(1.0 + t * t)
                _rotate(W, i, j, cosine, t)
                _rotate(U, i, j, cosine, t)
        if settled:
            return


@internal
def _rotate(V, i, j, cosine, t):
    """Rotate rows i and j of V by the angle of this cosine and tangent."""
    for k in range(V.shape[1]):
        above = V[i, k]
        V[i, k] = cosine * (above - t * V[j, k])
        V[j, k] = cosine * (t * above + V[j, k])
