"""How a robot goes out of reach of its path and comes back, from plain arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Spans = Sequence[tuple[float, float]]

STILL = 0.01  # largest joint speed [rad/s] of a robot that counts as standing still
FAR = 0.01    # error [m] at which it should not


def within_reach(t: Array, out_of_reach: Spans, after: float = 0.0) -> Mask:
    """Return which times t (T,) [s] are in no span, nor within `after` [s] of the end of one."""
    reach = np.ones(len(t), dtype=bool)
    for begin, end in out_of_reach:
        reach &= (t < begin) | (t > end + after)
    return reach


def returned(t: Array, out_of_reach: Spans, after: float) -> Mask:
    """Return which times t (T,) are within reach, `after` [s] or more after a span's end."""
    first = min((end for _, end in out_of_reach), default=np.inf)
    return within_reach(t, out_of_reach, after) & (t > first + after)


def frozen(t: Array, v: Array, error: Array, out_of_reach: Spans) -> Mask:
    """Return in which ticks the robot stands still, v (T, n), off a path that is within reach.

    It stands still if no joint is faster than STILL; it is off the path if the error (T,) exceeds
    FAR.
    """
    still = np.abs(v).max(axis=1, initial=0.0) < STILL
    return np.asarray(still & (error > FAR) & within_reach(t, out_of_reach))


def jerk(t: Array, a: Array) -> Array:
    """Return the differences of a (T, n) over those of t (T,): (T - 1, n) [rad/s^3]."""
    return np.asarray(np.diff(a, axis=0) / np.diff(t)[:, None])
