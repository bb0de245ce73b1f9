"""The same scenario again with its obstacles on slightly other paths, by a seed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hierarchy.problem import Array

if TYPE_CHECKING:
    from scenarios.config.avoidance import Obstacles, VariationSection
    from scenarios.config.sections import WaypointsSection


def varied(obstacles: Obstacles, variation: VariationSection) -> Obstacles:
    """Return the obstacles with their waypoints moved, each by chance of its own."""
    return tuple(
        obstacle if obstacle.path is None or obstacle.path.kind != "waypoints"
        else obstacle.model_copy(update={"path": _moved(
            obstacle.path, variation, np.random.default_rng((variation.seed, number)))})
        for number, obstacle in enumerate(obstacles))


def _moved(path: WaypointsSection, variation: VariationSection,
           random: np.random.Generator) -> WaypointsSection:
    points = np.array(path.points) + variation.spread * _in_ball(random, len(path.points))
    for i in range(1, len(points)):
        if path.points[i] == path.points[i - 1]:  # where it rests it still does
            points[i] = points[i - 1]
    return path.model_copy(update={
        "points": tuple(tuple(point) for point in points.tolist()),
        "times": tuple(_shifted(np.array(path.times), variation.timing, random).tolist())})


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
