"""Resolving a hierarchy with a metric, by a change of variables around a resolver's own `solve`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.metric import change_back, change_variables
from solvers.resolution import Resolution
from solvers.status import Status

_Kind = TypeVar("_Kind", bound=Resolution)


def in_metric(solve: Callable[[Hierarchy, Array | None], _Kind], h: Hierarchy,
              memory: Array | None) -> _Kind:
    """Return what `solve` finds for h, nearest to the reference in the metric of h.

    `solve` gets a hierarchy over y = L^T (x - reference), with W = L L^T, whose reference is zero
    and which has no metric; see `solvers.kernels.metric`. Damping and singular values are those of
    its rows. A metric that is not positive definite gives Status.NUMERICAL_FAILURE and x = 0.

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
    if not change_back(L, h.reference, found.x):
        found.status = Status.NUMERICAL_FAILURE
    return found
