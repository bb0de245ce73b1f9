"""A hierarchy in the variables in which its metric is the identity, and the way back.

With W = L L^T and x = reference + L^-T y, d^T W d = y^T y for the step d = x - reference. So the x
nearest to the reference in W is that of the y nearest to zero, and the rows over y are A L^-T.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from math import sqrt

import numpy as np

from hierarchy.jit import compiled


@compiled
def change_variables(A, sides, reference, W, L, B, new_sides):
    """Write L (n, n), B = A L^-T (m, n) and the sides (2, m) less A reference.

    What W, not positive definite, makes of them is not finite, and no resolver takes it.
    """
    _factorise(W, L)
    m, n = A.shape
    for i in range(m):
        at = 0.0
        for c in range(n):
            at += A[i, c] * reference[c]
            value = A[i, c]
            for k in range(c):
                value -= B[i, k] * L[c, k]
            B[i, c] = value / L[c, c]
        new_sides[0, i], new_sides[1, i] = sides[0][i] - at, sides[1][i] - at


@compiled
def change_back(L, reference, y):
    """Turn y (n,) into x = reference + L^-T y; return False, and x = 0, if it is not finite."""
    n, finite = len(y), True
    for c in range(n - 1, -1, -1):
        for k in range(c + 1, n):
            y[c] -= L[k, c] * y[k]
        y[c] /= L[c, c]
    for c in range(n):
        y[c] += reference[c]
        finite = finite and np.isfinite(y[c])
    if not finite:
        y[:] = 0.0
    return finite


@compiled
def _factorise(W, L):
    """Write the lower triangle of L with W = L L^T (Cholesky)."""
    for j in range(W.shape[0]):
        for i in range(j, W.shape[0]):
            value = W[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                L[i, j] = sqrt(value) if value > 0.0 else np.nan
            else:
                L[i, j] = value / L[j, j]
