"""Capsules around collision geometry."""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

import numpy as np

from hierarchy.avoidance.body import Capsule, Vector
from hierarchy.problem import Array

Ends = tuple[Array, Array, float]  # start (3,) [m], end (3,) [m] and radius [m] of a capsule
Shape = tuple[str, str, int, Any, Ends | None]  # name, kind, joint, placement on it, capsule there
CORNERS: Array = np.array(list(product((-1.0, 1.0), repeat=3)))
_MOST = 2000  # vertices of a mesh that are used to choose the axis


def capsules_of(shapes: Iterable[Shape]) -> tuple[tuple[Capsule, ...], tuple[str, ...]]:
    """Return the capsules around collision geometry, and sentences on what has none."""
    capsules, left_out = [], []
    for name, kind, joint, placement, ends in shapes:
        if ends is None:
            left_out.append(f"collision geometry {name!r} is a {kind}, for which there is no "
                            "capsule")
            continue
        start, end = (_vector(placement.act(end)) for end in ends[:2])
        capsules.append(Capsule(name, joint, start, end, float(ends[2])))
    return tuple(capsules), tuple(left_out)


def of_coal(geometries: Any) -> Iterator[Shape]:
    """Yield the shapes of collision geometry as pinocchio reads it."""
    for one in geometries:
        kind = type(one.geometry).__name__
        yield (str(one.name), kind, int(one.parentJoint), one.placement,
               _capsule_of(one.geometry, kind))


def around_z(half: float, radius: float) -> Ends:
    """Return the capsule of a half length [m] and radius [m] along z, about the origin."""
    z = np.array([0.0, 0.0, 1.0])
    return -half * z, half * z, radius


def _capsule_of(shape: Any, kind: str) -> Ends | None:
    if kind in ("Sphere", "Capsule", "Cylinder"):
        return around_z(0.0 if kind == "Sphere" else shape.halfLength, shape.radius)
    if kind == "Box":
        return bounding_capsule(CORNERS * shape.halfSide)
    for of_mesh in ("vertices", "points"):
        if hasattr(shape, of_mesh):
            points = np.array(getattr(shape, of_mesh)(), dtype=float).reshape(-1, 3)
            return bounding_capsule(points) if len(points) else None
    return None


def bounding_capsule(points: Array) -> Ends:
    """Return start (3,), end (3,) and radius [m] of a capsule that contains points (N, 3).

    Its axis is the one of x, y, z and the three principal axes of the points, through the middle of
    their extent, whose capsule has the least volume. It is not the smallest of all capsules.
    """
    few = points[::max(1, len(points) // _MOST)]
    centred = few - few.mean(axis=0)
    principal = np.linalg.svd(centred, full_matrices=False)[2]
    best, least = principal[0], np.inf
    for axis in (*np.eye(3), *principal):
        start, end, radius = _around(few, axis)
        volume = np.pi * radius**2 * (float(np.linalg.norm(end - start)) + 4.0 / 3.0 * radius)
        if volume < least:
            best, least = axis, volume
    return _around(points, best)


def _around(points: Array, axis: Array) -> Ends:
    """Return the capsule along `axis` that contains the points."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    across = np.array([first, np.cross(axis, first)])
    flat = points @ across.T
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    off_axis = np.linalg.norm(flat - middle, axis=1)
    radius = float(off_axis.max())
    cap = np.sqrt(np.maximum(radius**2 - off_axis**2, 0.0))  # how far a cap reaches there
    along = points @ axis
    low, high = float((along + cap).min()), float((along - cap).max())
    origin = middle @ across
    return origin + low * axis, origin + high * axis, radius


def _vector(point: Array) -> Vector:
    x, y, z = (float(value) for value in point)
    return x, y, z
