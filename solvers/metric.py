"""Resolving a hierarchy with a metric, by a change of variables around a resolver's own `solve`.

With W = L L^T and x = reference + L^-T y, d^T W d = y^T y for the step d = x - reference. So the x
nearest to the reference in W is that of the y nearest to zero, and the rows over y are A L^-T.
"""

from collections.abc import Callable
from math import sqrt
from typing import TypeVar

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.jit import compiled, internal
from hierarchy.problem import Array, Hierarchy
from solvers.resolution import Resolution
from solvers.status import Status

_Kind = TypeVar("_Kind", bound=Resolution)


def in_metric(solve: Callable[[Hierarchy, Array | None], _Kind], h: Hierarchy,
              memory: Array | None) -> _Kind:
    """Return what `solve` finds for h, nearest to the reference in the metric of h.

    `solve` gets a hierarchy over y, whose reference is zero and which has no metric. Damping and
    singular values are those of its rows. A metric that is not positive definite gives
    Status.NUMERICAL_FAILURE and x = 0.

    Raises HierarchyError if `solve` does. A bound on one unknown is a row over several of y unless
    the metric is diagonal, so a resolver that takes only bounds refuses it.
    """
    L, B, sides = np.zeros((h.n, h.n)), np.empty((h.m, h.n)), np.empty((2, h.m))
    change_variables(h.A, (h.lower, h.upper), h.reference, h.metric, L, B, sides)
    changed = h.changed(A=B, lower=sides[0], upper=sides[1], reference=None, metric=None)
    try:
        found = solve(changed, memory)
    except HierarchyError as error:
        raise HierarchyError(f"{error}. These are rows over L^T (x - reference), in which the "
                             "metric L L^T of this hierarchy is the identity: a bound on one "
                             "unknown of x is a row over several") from error
    if found.status is not Status.NUMERICAL_FAILURE:
        found.x = found.x.copy()  # that of a plugin may be its memory, or read-only
        if not change_back(L, h.reference, found.x):
            found.status = Status.NUMERICAL_FAILURE
    return found


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


@internal
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
