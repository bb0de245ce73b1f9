"""Steps of a package until the error is small or does not fall, then from the next start."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmark.peers.scenes import Array

PERIOD = 0.1         # [s] of a step, of which the limits of speed allow one
LM = 1.0             # lm_damping of tasks in pink and mink, as in their examples
_MOST = 200          # iterations of each start
_STILL = 1e-3        # relative decrease of the error within `_PATIENCE` iterations that goes on
_PATIENCE = 10


def iterated(aim: Callable[[Array], None], at: Callable[[Array], float],
             step: Callable[[Array], Array], tolerance: float
             ) -> Callable[[Array, Array], tuple[Array, bool]]:
    """Return a solve made of three: take the poses, error at q, and the q after q."""
    def solve(poses: Array, starts: Array) -> tuple[Array, bool]:
        aim(poses)
        best, nearest = np.inf, starts[0]
        for start in starts:
            q, errors = start.copy(), list[float]()
            for k in range(_MOST):
                errors.append(at(q))
                if errors[-1] < best:
                    best, nearest = errors[-1], q.copy()
                if best <= tolerance:
                    return nearest, True
                if k >= _PATIENCE and min(errors[-_PATIENCE:]) > (
                        (1.0 - _STILL) * min(errors[:-_PATIENCE])):
                    break
                try:
                    q = step(q)
                except Exception:  # no solution of a step: the next start
                    break
        return nearest, False

    return solve
