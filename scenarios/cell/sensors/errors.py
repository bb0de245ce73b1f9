"""Errors of a depth camera: noise, rounding, range, missing pixels, outliers."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.jit import compiled
from hierarchy.problem import Array

Image = NDArray[np.float32]
_WIDEST = 3.5  # [standard deviations] at which noise is clipped, so that it is bounded
_EDGE = 0.05   # [m] depth difference between two pixels at an edge


@dataclass(frozen=True)
class DepthErrors:
    """Errors of a depth reading z [m]; all zero but `near` and `far` for an ideal camera.

    noise_floor, noise_growth, noise_from : the standard deviation [m] is
        floor + growth (z - from)^2, normal, clipped at 3.5 times that.
    rounding, step : "step" rounds z to multiples of `step` [m]; "disparity" rounds 1 / z to
        multiples of `step` [1/m], as a triangulating camera does; step 0 for none.
    near, far : readings outside [m] are missing.
    missing : the probability that a pixel has no reading; missing_at_edges that of one whose
        neighbour is 5 cm nearer or farther.
    outliers : the probability that a frame has a square of up to `outlier_size` pixels to each
        side, at least one pixel, whose depth is random between `near` and the true depth.

    The defaults resemble a Kinect. Raises HierarchyError for values out of range.
    """

    noise_floor: float = 1.2e-3
    noise_growth: float = 1.9e-3
    noise_from: float = 0.4
    rounding: Literal["disparity", "step"] = "disparity"
    step: float = 2.85e-3
    near: float = 0.5
    far: float = 5.0
    missing: float = 0.002
    missing_at_edges: float = 0.3
    outliers: float = 0.02
    outlier_size: int = 2

    def __post_init__(self) -> None:
        for name in ("noise_floor", "noise_growth", "noise_from", "step", "missing",
                     "missing_at_edges", "outliers", "outlier_size"):
            most = 1.0 if name in ("missing", "missing_at_edges", "outliers") else np.inf
            if not 0.0 <= getattr(self, name) <= most:
                raise HierarchyError(f"depth camera: {name} = {getattr(self, name)} is out of "
                                     "range")
        if self.rounding not in ("disparity", "step"):
            raise HierarchyError(f"depth camera: rounding = {self.rounding!r}")
        if not 0.0 <= self.near < self.far:
            raise HierarchyError(f"depth camera: near = {self.near} m must be below far = "
                                 f"{self.far} m")

    @classmethod
    def none(cls, near: float = 0.0, far: float = np.inf) -> DepthErrors:
        """Return the errors of an ideal camera: exact readings between near and far [m]."""
        return cls(0.0, 0.0, 0.0, "step", 0.0, near, far, 0.0, 0.0, 0.0, 0)

    def bound(self, depth: float) -> float:
        """Return the largest error [m] of a reading at a depth [m] that is not an outlier."""
        noise = _WIDEST * (self.noise_floor + self.noise_growth * (depth - self.noise_from) ** 2)
        if self.rounding == "step":
            return noise + self.step / 2
        return (depth + noise) / (1.0 - (depth + noise) * self.step / 2) - depth

    @property
    def random(self) -> bool:
        """Whether readings have random errors."""
        return any((self.noise_floor, self.noise_growth, self.missing, self.missing_at_edges,
                    self.outliers))

    def packed(self) -> Array:
        """Return the array (9,) for `expose`."""
        return np.array([self.noise_floor, self.noise_growth, self.noise_from,
                         self.rounding == "disparity", self.step, self.near, self.far,
                         self.missing, self.missing_at_edges])

    def add_outliers(self, rng: np.random.Generator, reading: Image) -> None:
        """Add this frame's outlier, if it has one, to a reading (h, w)."""
        if rng.random() >= self.outliers:
            return
        v, u = rng.integers(reading.shape[0]), rng.integers(reading.shape[1])
        half = int(rng.integers(self.outlier_size + 1))
        behind = float(reading[v, u]) or self.far
        reading[max(v - half, 0):v + half + 1, max(u - half, 0):u + half + 1] = (
            rng.uniform(self.near, behind) if np.isfinite(behind) else self.near)


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
            chance = min(max(normal[v, u], -_WIDEST), _WIDEST)
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
