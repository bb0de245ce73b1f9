"""Triangle meshes: hulls of balls, and the surface of a cone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance import Obstacle
from hierarchy.problem import Array

Mesh = tuple[Array, NDArray[np.int64]]  # vertices (V, 3), triangles (F, 3) turned outward

POINT = 0.016  # [m] radius of a point obstacle as drawn
_FINE = 2      # subdivisions of an icosahedron for a ball
_AROUND = 48   # edges of the rim of a cone
_AT_CENTRE = np.zeros((1, 3))


def hull_of_balls(centres: Any, radii: Sequence[float]) -> Mesh:
    """Return the convex hull of balls: centres (K, 3) [m] and as many radii [m], zero for a point.

    Two balls make a capsule, tapered if their radii differ, and eight points a box.
    """
    from trimesh.convex import convex_hull
    from trimesh.creation import icosphere

    ball = np.asarray(icosphere(subdivisions=_FINE).vertices)
    points = [np.asarray(centre, dtype=float) + (radius * ball if radius > 0.0 else _AT_CENTRE)
              for centre, radius in zip(centres, radii, strict=True)]
    hull = convex_hull(np.vstack(points))
    return np.asarray(hull.vertices), np.asarray(hull.faces)


def obstacle_mesh(obstacle: Obstacle, beyond: float = 0.0) -> Mesh:
    """Return the surface at distance `beyond` [m] from an obstacle, in its own frame."""
    centres, radius = _core(obstacle)
    if beyond == 0.0 and obstacle.shape == "point":
        radius = POINT
    return hull_of_balls(centres, [radius + beyond] * len(centres))


def cone_mesh(half_angle: float, length: float) -> Mesh:
    """Return a cone about z with its apex at the origin and sides of `length` [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    rim = length * np.column_stack([np.sin(half_angle) * np.cos(angle),
                                    np.sin(half_angle) * np.sin(angle),
                                    np.full(_AROUND, np.cos(half_angle))])
    first = np.arange(1, _AROUND + 1)
    return (np.vstack([np.zeros(3), rim]),
            np.column_stack([np.zeros_like(first), np.roll(first, -1), first]))


def _core(obstacle: Obstacle) -> tuple[Array, float]:
    """Return points (K, 3) and a radius [m]; the obstacle is their hull grown by the radius."""
    if obstacle.shape == "capsule":
        radius, half = obstacle.size
        return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), radius
    if obstacle.shape == "box":
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return signs * obstacle.size, 0.0
    return np.zeros((1, 3)), sum(obstacle.size)
