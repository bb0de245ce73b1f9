"""Magnitude of the repulsive vector, eq. (23), in a form for which (24) holds."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from hierarchy.errors import HierarchyError, number
from hierarchy.jit import compiled
from hierarchy.problem import Array


@dataclass(frozen=True)
class Repulsion:
    """r(D) = maximum / (1 + exp((D scale / reach - 1) shape)).

    `maximum` r_max [m/s^2, or m/s at velocity level], `reach` rho [m], `shape` gamma > 0. With
    `scale` = 2 this is eq. (23) read as D (2 / rho), so that r(0) is near r_max and r(rho) near 0
    for a large gamma; the letter's printed D / (2 / rho) contradicts its (24). The authors' code
    uses scale 3 (body) and 1.5 (end effector).
    """

    maximum: float
    reach: float
    shape: float
    scale: float = 2.0

    def __post_init__(self) -> None:
        for name in ("maximum", "reach", "shape", "scale"):
            value = number(f"repulsion {name}", getattr(self, name))
            if value <= 0.0:
                raise HierarchyError(f"repulsion {name} must be positive, got {value}")

    def __call__(self, distance: float) -> float:
        """Magnitude at a distance [m]."""
        return float(repulsion(distance, self.maximum, self.reach, self.shape, self.scale))

    def packed(self) -> tuple[float, float, float, float]:
        """(maximum, reach, shape, scale) for the kernels."""
        return self.maximum, self.reach, self.shape, self.scale


@compiled
def repulsion(D, r_max, rho, gamma, scale):
    """Magnitude r(D) of eq. (23); see `Repulsion`."""
    exponent = (D * scale / rho - 1.0) * gamma
    if exponent > 700.0:  # exp would overflow; r is zero to rounding long before
        return 0.0
    return r_max / (1.0 + exp(exponent))  # (23)


def laws(body: Repulsion, end_effector: Repulsion) -> Array:
    """Both laws as one (2, 4) array: row 0 for the body, row 1 for the end effector."""
    return np.array([body.packed(), end_effector.packed()])
