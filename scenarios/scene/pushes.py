"""Contact forces, friction cones and the support polygon of a robot, as segments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hierarchy.problem import Array
from scenarios.loop.facts import ContactPoint

_LENGTH = 0.002   # [m] of an arrow per newton
_CONE = 0.05      # [m] height of a friction cone
_EDGES = 8        # of a cone as it is drawn
_LOADED = 1.0     # [N] of normal force from which a point counts as loaded


class Pushes(NamedTuple):
    """Segments (F, S, 2, 3) [m] of F frames; NaN where there is none.

    force : from each contact point along its planned force, 2 mm for each newton.
    cone : the friction cone that the controller believes, of each loaded point.
    support : the convex hull of the loaded points in the horizontal plane.
    """

    force: Array
    cone: Array
    support: Array

    def at(self, frame: int) -> Pushes:
        """Return the segments (S, 2, 3) of a frame that exist."""
        return Pushes(*(part[frame][np.isfinite(part[frame]).all(axis=(1, 2))] for part in self))


def pushes(points: Sequence[ContactPoint], placements: Array, forces: Array) -> Pushes:
    """Return what is drawn of forces (F, P, 3) [N] at contact points of joints at `placements`."""
    placed = placements[:, [point.joint for point in points]]
    rotation = placed[..., :9].reshape(*placed.shape[:-1], 3, 3).swapaxes(-1, -2)
    offsets = np.array([point.offset for point in points])[..., None]
    at = placed[..., 9:] + (rotation @ offsets)[..., 0]
    normals = np.array([point.normal for point in points])
    loaded = (forces * normals).sum(axis=-1) > _LOADED
    force = np.stack([at, at + _LENGTH * forces], axis=-2)
    force[~np.isfinite(forces).all(axis=-1)] = np.nan
    cone = at[:, :, None, None] + np.array([_cone(point) for point in points])
    cone[~loaded] = np.nan
    support = np.array([_hull(p[on], len(points)) for p, on in zip(at, loaded, strict=True)])
    return Pushes(force, cone.reshape(len(at), -1, 2, 3), support)


def _cone(point: ContactPoint) -> Array:
    """Return the edges and the rim of a friction cone at the origin (2 _EDGES, 2, 3)."""
    n = np.array(point.normal)
    across = np.linalg.svd(n[None])[2][1:]
    angles = np.linspace(0.0, 2.0 * np.pi, _EDGES + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]) @ across
    rim = _CONE * (n + point.friction * circle)
    edges = np.stack([np.zeros((_EDGES, 3)), rim[:-1]], axis=1)
    return np.concatenate([edges, np.stack([rim[:-1], rim[1:]], axis=1)])


def _hull(points: Array, count: int) -> Array:
    """Return the edges (count, 2, 3) of the hull of points (k, 3) from above, NaN beyond them."""
    edges = np.full((count, 2, 3), np.nan)
    ring = _ring(points)
    if len(ring) > 1:
        edges[:len(ring)] = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
    return edges


def _ring(points: Array) -> Array:
    """Return the corners of the hull in turn (Andrew's monotone chain), seen from above."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    chains = []
    for some in (ordered, ordered[::-1]):
        chain: list[Array] = []
        for p in some:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0.0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return np.array(chains).reshape(-1, 3)


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
