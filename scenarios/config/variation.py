"""Slightly other paths through the same waypoints, by chance."""

from __future__ import annotations

import numpy as np

from hierarchy.problem import Array


def moved(times: Array, points: Array, spread: float, timing: float,
          random: np.random.Generator) -> tuple[Array, Array]:
    """Return the times (W,) [s] and points (W, 3) [m] of waypoints moved by chance.

    spread : [m] by which a point moves at most. timing : share of half the time to its neighbours
        by which it is earlier or later at most. Where the path rests it still does.
    """
    away = points + spread * _in_ball(random, len(points))
    for i in range(1, len(points)):
        if (points[i] == points[i - 1]).all():
            away[i] = away[i - 1]
    return _shifted(times, timing, random), away


def _in_ball(random: np.random.Generator, count: int) -> Array:
    """Random points (count, 3), equally likely everywhere in the unit ball."""
    points = random.standard_normal((count, 3))
    radii = random.random((count, 1)) ** (1 / 3)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True) * radii)


def _shifted(times: Array, timing: float, random: np.random.Generator) -> Array:
    """Times that increase as before; the first is as it was."""
    half = np.diff(times) / 2
    room = np.concatenate([[0.0], np.minimum(half[:-1], half[1:]), half[-1:]])
    return np.asarray(times + timing * room * random.uniform(-1.0, 1.0, len(times)))
