"""Random variation of waypoints."""

from __future__ import annotations

import numpy as np

from hierarchy.problem import Array


def moved(times: Array, points: Array, spread: float, timing: float,
          random: np.random.Generator) -> tuple[Array, Array]:
    """Return the times (W,) [s] and points (W, 3) [m] of randomly moved waypoints.

    spread : largest displacement [m] of a point. timing : largest shift in time, as a share of half
        the interval to its neighbours. The path still rests where it rested.
    """
    away = points + spread * _in_ball(random, len(points))
    for i in range(1, len(points)):
        if (points[i] == points[i - 1]).all():
            away[i] = away[i - 1]
    return _shifted(times, timing, random), away


def _in_ball(random: np.random.Generator, count: int) -> Array:
    """Return random points (count, 3), uniform in the unit ball."""
    points = random.standard_normal((count, 3))
    radii = random.random((count, 1)) ** (1 / 3)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True) * radii)


def _shifted(times: Array, timing: float, random: np.random.Generator) -> Array:
    """Return shifted times, still increasing; the first is unchanged."""
    half = np.diff(times) / 2
    room = np.concatenate([[0.0], np.minimum(half[:-1], half[1:]), half[-1:]])
    return np.asarray(times + timing * room * random.uniform(-1.0, 1.0, len(times)))
