"""What a resolver of bounds says beside x: which unknowns are at a bound, what each level gets."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from solvers.resolver import Resolution
from solvers.status import Status


@final
class SaturatedResolution(Resolution):
    """A resolution within bounds; its record (n + L + ..) begins with saturation and scaling.

    Attributes beside those of `Resolution`; n unknowns, L levels
    ----------
    saturated : (n,) int8, +1 for x at its upper bound, -1 at its lower one, 2 where both are one, 0
        where it is free.
    scaling : (L,) the share of its target that each level gets, in 0 .. 1, and 1 for bounds that do
        not exclude each other. How it is reckoned, the resolver says.
    """

    __slots__ = ("_levels", "_record")

    def __init__(self, x: Array, status: Status, iterations: int, record: Array, levels: int,
                 memory: Any = None) -> None:
        super().__init__(x, status, iterations, memory)
        self._record, self._levels = record, levels

    @property
    def saturated(self) -> NDArray[np.int8]:
        """Which unknowns are at a bound: (n,)."""
        return self._record[:len(self.x)].astype(np.int8)

    @property
    def scaling(self) -> Array:
        """What each level gets of its target: (L,)."""
        n = len(self.x)
        return self._record[n:n + self._levels].copy()
