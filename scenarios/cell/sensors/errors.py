"""Errors of a depth camera: noise, rounding, range, missing pixels, outliers."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled
from scenarios.config.kinds.camera import WIDEST

Image = NDArray[np.float32]
_EDGE = 0.05   # [m] depth difference between two pixels at an edge


@compiled
def expose(depth, normal, uniform, errors, reading):
    """Make a reading (h, w) out of true depths (h, w) and random numbers (h, w) for each pixel.

    A reading of 0 is none.
    """
    height, width = depth.shape
    floor, growth, start = errors[0], errors[1], errors[2]
    step, near, far = errors[4], errors[5], errors[6]
    for v in range(height):
        for u in range(width):
            z = float(depth[v, u])
            reading[v, u] = 0.0
            if not (near <= z <= far and z < np.inf):
                continue
            share = errors[8] if errors[8] > errors[7] and _at_edge(depth, v, u) else errors[7]
            if uniform[v, u] < share:
                continue
            chance = min(max(normal[v, u], -WIDEST), WIDEST)
            z += chance * (floor + growth * (z - start) * (z - start))
            if step > 0.0 and errors[3] > 0.0:
                z = 1.0 / (step * np.rint(1.0 / (step * z)))
            elif step > 0.0:
                z = step * np.rint(z / step)
            if near <= z <= far:
                reading[v, u] = z


@compiled
def _at_edge(depth, v, u):
    z = depth[v, u]
    return ((v > 0 and abs(depth[v - 1, u] - z) > _EDGE)
            or (v + 1 < depth.shape[0] and abs(depth[v + 1, u] - z) > _EDGE)
            or (u > 0 and abs(depth[v, u - 1] - z) > _EDGE)
            or (u + 1 < depth.shape[1] and abs(depth[v, u + 1] - z) > _EDGE))
