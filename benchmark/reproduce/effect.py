"""The shift of paired differences, compared within blocks only."""

from __future__ import annotations

from dataclasses import dataclass
from math import erfc, sqrt

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array


@dataclass(frozen=True)
class Effect:
    """The shift of paired differences from zero: estimate, its 95 % interval, and a p-value."""

    count: int
    estimate: float
    low: float
    high: float
    p: float


def blocked(differences: Array, blocks: NDArray[np.int64]) -> Effect:
    """Return the shift of differences (N,) whose signs are compared within blocks (N,) only.

    The estimate is that of Hodges and Lehmann (1963), the median of all means of two differences
    of a block; the test is the signed-rank test summed over blocks (normal approximation), and the
    interval is the set of shifts that it does not reject. An infinite difference is the largest;
    what is not a number, such as that of two infinite values, counts as zero.
    """
    apart = np.where(np.isnan(differences), 0.0, differences)
    means, middle, square = [], 0.0, 0.0
    for block in np.unique(blocks):
        own = apart[blocks == block]
        n = own.size
        first, second = np.triu_indices(n)
        with np.errstate(invalid="ignore"):
            means.append(np.nan_to_num((own[first] + own[second]) / 2.0, nan=0.0, posinf=np.inf,
                                       neginf=-np.inf))
        middle += n * (n + 1) / 4.0
        square += n * (n + 1) * (2 * n + 1) / 24.0
    if not means:
        return Effect(0, np.nan, np.nan, np.nan, 1.0)
    ordered, deviation = np.sort(np.concatenate(means)), float(np.sqrt(square))
    above = (ordered > 0.0).sum() + (ordered == 0.0).sum() / 2.0
    p = erfc(max(abs(above - middle) - 0.5, 0.0) / deviation / sqrt(2.0))
    k = max(int(middle - 1.96 * deviation), 0)
    return Effect(apart.size, _middle(ordered), float(ordered[k]), float(ordered[-1 - k]), p)


def _middle(ordered: Array) -> float:
    """Return the median of sorted values, which may be infinite."""
    low, high = ordered[(ordered.size - 1) // 2], ordered[ordered.size // 2]
    return float(low if low == high else (low + high) / 2.0)
