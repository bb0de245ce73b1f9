"""The resolution of a resolver with bounds: saturated unknowns and the scaling of each level."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from solvers.resolver import Resolution
from solvers.status import Status


@final
class SaturatedResolution(Resolution):
    """A resolution within bounds; its record (n + L + ..) starts with saturation and scaling.

    Attributes in addition to those of `Resolution`; n unknowns, L levels
    ----------
    saturated : (n,) int8, +1 for an unknown at its upper bound, -1 at its lower bound, 2 where the
        two bounds are equal, 0 where it is free.
    scaling : (L,) share of its target that each level reaches, 0 to 1; 1 for bounds that do not
        contradict each other. Each resolver documents how it computes the share.
    """

    __slots__ = ("_levels", "_record")

    def __init__(self, x: Array, status: Status, iterations: int, record: Array, levels: int,
                 memory: Array | None = None) -> None:
        super().__init__(x, status, iterations, memory)
        self._record, self._levels = record, levels

    @property
    def saturated(self) -> NDArray[np.int8]:
        """Which unknowns are at a bound: (n,)."""
        return self._record[:len(self.x)].astype(np.int8)

    @property
    def scaling(self) -> Array:
        """Share of its target that each level reaches: (L,)."""
        n = len(self.x)
        return self._record[n:n + self._levels].copy()
