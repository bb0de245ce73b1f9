"""Triangles for what is drawn: hulls of balls, and the surface of a cone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance import Obstacle
from hierarchy.problem import Array

Mesh = tuple[Array, NDArray[np.int64]]  # vertices (V, 3), triangles (F, 3) turned outward

POINT = 0.016  # [m] radius at which an obstacle that is a point is drawn
_FINE = 2      # times that the faces of an icosahedron are divided to make a ball
_AROUND = 48   # edges of a cone's rim
_AT_CENTRE = np.zeros((1, 3))


def hull_of_balls(centres: Any, radii: Sequence[float]) -> Mesh:
    """Return the convex hull of balls: centres (K, 3) [m] and as many radii [m], zero for a point.

    One ball is a ball, two are a capsule, tapered if their radii differ, and eight may be a box.
    """
    from trimesh.convex import convex_hull
    from trimesh.creation import icosphere

    ball = np.asarray(icosphere(subdivisions=_FINE).vertices)
    points = [np.asarray(centre, dtype=float) + (radius * ball if radius > 0.0 else _AT_CENTRE)
              for centre, radius in zip(centres, radii, strict=True)]
    hull = convex_hull(np.vstack(points))
    return np.asarray(hull.vertices), np.asarray(hull.faces)


def obstacle_mesh(obstacle: Obstacle, beyond: float = 0.0) -> Mesh:
    """Return the surface at a distance `beyond` [m] from an obstacle, about its centre and axes."""
    centres, radius = _core(obstacle)
    if beyond == 0.0 and obstacle.shape == "point":
        radius = POINT
    return hull_of_balls(centres, [radius + beyond] * len(centres))


def cone_mesh(half_angle: float, length: float) -> Mesh:
    """Return the surface of a cone about z, its apex at the origin and its sides `length` [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    rim = length * np.column_stack([np.sin(half_angle) * np.cos(angle),
                                    np.sin(half_angle) * np.sin(angle),
                                    np.full(_AROUND, np.cos(half_angle))])
    first = np.arange(1, _AROUND + 1)
    return (np.vstack([np.zeros(3), rim]),
            np.column_stack([np.zeros_like(first), np.roll(first, -1), first]))


def _core(obstacle: Obstacle) -> tuple[Array, float]:
    """Points (K, 3) and a radius [m]: all within it of their hull is the obstacle."""
    if obstacle.shape == "capsule":
        radius, half = obstacle.size
        return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), radius
    if obstacle.shape == "box":
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return signs * obstacle.size, 0.0
    return np.zeros((1, 3)), sum(obstacle.size)
