"""What a row that keeps h >= 0 asks for.

h is a distance less the one to keep. The side is a control barrier: of first order at velocity
level, dh/dt >= -rate h, of second order at acceleration level, (d/dt + rate)^2 h >= 0. Sources:
Ames et al., "Control barrier functions: theory and applications" (2019); Nguyen and Sreenath,
"Exponential control barrier functions" (2016).
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import astuple, dataclass
from math import inf

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.jit import compiled, inlined
from hierarchy.problem import Array

_ROUNDING = 1e-13  # [m] an entry of a row below this is rounding


@dataclass(frozen=True)
class Barrier:
    """How h = d - distance is kept from becoming negative.

    distance : what to keep, d_min [m].
    rate : how fast what is left of h may be used up [1/s]; times the period it should be well
        below 1.
    influence : beyond this distance [m] a row has no side.
    recovery : the largest speed away from the obstacle that is asked for inside d_min [m/s].
    limit : the largest acceleration away from it that is ever asked for [m/s^2].

    At velocity level dh/dt >= min(-rate h, recovery). At acceleration level d2h/dt2 >=
    2 rate (min(-rate h / 2, recovery) - dh/dt), at most `limit`: critically damped, and inside
    d_min it goes out at `recovery` until h = -2 recovery / rate. From h >= 0 and dh/dt >= -rate h
    on h stays so as long as rows are met and `limit` does not act; after a faster approach
    h may become negative, and recovers. In a sampled loop h may pass zero by terms in the period.

    A side appears when d falls to `influence`. It does not bind at once: there h is large, and an
    approach at up to rate h, at acceleration level up to half of that, may go on as it is.

    Raises HierarchyError, naming the setting, where one is out of its range.
    """

    distance: float
    rate: float = 10.0
    influence: float = 0.3
    recovery: float = 0.2
    limit: float = 50.0

    def __post_init__(self) -> None:
        for name, least in (("distance", 0.0), ("rate", 0.0), ("recovery", 0.0), ("limit", 0.0)):
            value = getattr(self, name)
            if not least <= value < inf or (name in ("rate", "limit") and value == 0.0):
                raise HierarchyError(f"barrier: {name} = {value} is out of range")
        if not self.distance < self.influence:
            raise HierarchyError(f"barrier: influence = {self.influence} m must be more than the "
                                 f"distance to keep, {self.distance} m")

    def packed(self) -> Array:
        """The settings as one array (5,), as the kernels take it."""
        return np.array(astuple(self))


@compiled
def least_rate(h, settings):
    """The dh/dt [m/s] to ask for at least, at velocity level; settings of `Barrier.packed`."""
    return min(-settings[1] * h, settings[3])


@compiled
def least_acceleration(h, rate_of_h, bend, settings):
    """The d2h/dt2 - bend [m/s^2] to ask for at least; settings of `Barrier.packed`.

    bend is what the turning of the direction adds to d2h/dt2.
    """
    toward = min(-0.5 * settings[1] * h, settings[3])
    return min(2.0 * settings[1] * (toward - rate_of_h) - bend, settings[4])


@inlined
def drop_rounding(A, row):
    """Make what is zero but for rounding zero: no joint moves the point along r at all."""
    for c in range(A.shape[1]):
        if abs(A[row, c]) < _ROUNDING:
            A[row, c] = 0.0
