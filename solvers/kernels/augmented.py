"""All levels as one: the least-squares solution (2) of the whole stack, without priorities."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from solvers.kernels.staircase import staircase


@compiled
def augmented(A, lower, upper, sizes, x, damping, threshold, rank_tolerance):
    """Solve (2) with the null-space term of (14); arguments and return as of `staircase`."""
    whole = np.empty(1, np.int64)
    whole[0] = A.shape[0]
    return staircase(A, lower, upper, whole, x, damping, threshold, rank_tolerance)
