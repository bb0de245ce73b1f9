"""Laws of avoidance: the bound of a row that keeps h >= 0, and the magnitude (23) of repulsion.

h is a distance minus the distance to keep. The bound is a control barrier function: of first order
at velocity level, dh/dt >= -rate h, of second order at acceleration level, (d/dt + rate)^2 h >= 0.

At velocity level dh/dt >= min(-rate h, recovery). At acceleration level d2h/dt2 >=
2 rate (min(-rate h / 2, recovery) - dh/dt), at most `limit`: critically damped, and inside the
distance to keep the point leaves at `recovery` until h = -2 recovery / rate. From h >= 0 and
dh/dt >= -rate h on, h remains non-negative as long as the rows are satisfied and `limit` is not
active; after a faster approach h may become negative, and recovers. In a sampled loop h may cross
zero by terms in the period.

A bound appears when the distance falls to `influence`. It does not bind at once: there h is large,
and an approach at up to rate h, at acceleration level up to half of that, may continue. Sources:
Ames et al., "Control barrier functions: theory and applications" (2019); Nguyen and Sreenath,
"Exponential control barrier functions" (2016).
"""

from dataclasses import astuple, dataclass
from math import exp
from typing import Annotated

import numpy as np

from hierarchy.errors import number, refuse
from hierarchy.jit import compiled, inlined, internal
from hierarchy.problem import Array
from hierarchy.records import NotNegative, Positive, check_fields

_ROUNDING = 1e-13  # [m] entries of a row below this are rounding errors


@dataclass(frozen=True)
class Barrier:
    """Settings that keep h = d - distance from becoming negative; see the module.

    distance : distance to keep, d_min [m].
    rate : rate of the barrier [1/s]; its product with the period should be well below 1.
    influence : distance [m] beyond which a row has no bound.
    recovery : largest required speed away from the obstacle inside d_min [m/s].
    limit : largest required acceleration away from the obstacle [m/s^2].

    Raises HierarchyError, naming the setting, if one is out of range.
    """

    distance: NotNegative
    rate: Positive = 10.0
    influence: Annotated[float, number] = 0.3
    recovery: NotNegative = 0.2
    limit: Positive = 50.0

    def __post_init__(self) -> None:
        check_fields(self, "barrier")
        refuse(not self.distance < self.influence, f"barrier: influence = {self.influence} m must "
               f"be more than the distance to keep, {self.distance} m")

    def packed(self) -> Array:
        """The settings as one array (5,) for the kernels."""
        return np.array(astuple(self))


@internal
def least_rate(h, settings):
    """Least dh/dt [m/s] at velocity level; settings of `Barrier.packed`."""
    return min(-settings[1] * h, settings[3])


@internal
def least_acceleration(h, rate_of_h, bend, settings):
    """Least d2h/dt2 - bend [m/s^2] at acceleration level; settings of `Barrier.packed`.

    bend is what the turning of the direction adds to d2h/dt2.
    """
    toward = min(-0.5 * settings[1] * h, settings[3])
    return min(2.0 * settings[1] * (toward - rate_of_h) - bend, settings[4])


@inlined
def drop_rounding(row):
    """Set entries to zero that differ from it by rounding: joints that do not move along r."""
    for c in range(len(row)):
        if abs(row[c]) < _ROUNDING:
            row[c] = 0.0


@dataclass(frozen=True)
class Repulsion:
    """r(D) = maximum / (1 + exp((D scale / reach - 1) shape)).

    `maximum` r_max [m/s^2, or m/s at velocity level], `reach` rho [m], `shape` gamma > 0. With
    `scale` = 2 this is eq. (23) read as D (2 / rho), so that r(0) is near r_max and r(rho) near 0
    for a large gamma; the letter's printed D / (2 / rho) contradicts its (24). The authors' code
    uses scale 3 (body) and 1.5 (end effector).
    """

    maximum: Positive
    reach: Positive
    shape: Positive
    scale: Positive = 2.0

    def __post_init__(self) -> None:
        check_fields(self, "repulsion")

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
