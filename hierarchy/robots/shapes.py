"""Capsules around collision geometry."""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.avoidance.body import Capsule, Vector
from hierarchy.problem import Array

Ends = tuple[Array, Array, float]  # start (3,) [m], end (3,) [m] and radius [m] of a capsule
Shape = tuple[str, str, int, Any, Ends | None]  # name, kind, joint, placement on it, capsule there
_CORNERS: Array = np.array(list(product((-1.0, 1.0), repeat=3)))
_MOST = 2000  # vertices of a mesh that are used to choose the axis


def capsules_of(shapes: Iterable[Shape]) -> tuple[tuple[Capsule, ...], tuple[str, ...]]:
    """Return the capsules around collision geometry, and sentences on what has none."""
    capsules, left_out = [], []
    for name, kind, joint, placement, ends in shapes:
        if ends is None:
            left_out.append(f"collision geometry {name!r} is a {kind}, for which there is no "
                            "capsule")
            continue
        start, end = (vector(placement.act(end)) for end in ends[:2])
        capsules.append(Capsule(name, joint, start, end, float(ends[2])))
    return tuple(capsules), tuple(left_out)


def of_coal(geometries: Any) -> Iterator[Shape]:
    """Yield the shapes of collision geometry as pinocchio reads it."""
    for one in geometries:
        shape, kind = one.geometry, type(one.geometry).__name__
        sizes = shape.halfSide if kind == "Box" else [
            getattr(shape, size, 0.0) for size in ("radius", "halfLength")]
        points = next((getattr(shape, of_mesh)() for of_mesh in ("vertices", "points")
                       if hasattr(shape, of_mesh)), ())
        yield (str(one.name), kind, int(one.parentJoint), one.placement,
               capsule_of(kind.lower(), sizes, points))


def capsule_of(kind: str, sizes: Any, points: Any) -> Ends | None:
    """Return the capsule around a shape, None for one without sizes and points (N, 3) [m].

    `sizes` [m] are radius and half length along z of a "sphere", "capsule" or "cylinder", and half
    sides of a "box", or of the box around an "ellipsoid".
    """
    if kind in ("sphere", "capsule", "cylinder"):
        half = np.array([0.0, 0.0, 0.0 if kind == "sphere" else sizes[1]])
        return -half, half, sizes[0]
    if kind in ("box", "ellipsoid"):
        return bounding_capsule(_CORNERS * sizes)
    points = np.array(points, dtype=float).reshape(-1, 3)
    return bounding_capsule(points) if len(points) else None


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


def vector(values: ArrayLike) -> Vector:
    """Return three numbers (3,) as a tuple."""
    x, y, z = np.asarray(values, dtype=float).tolist()
    return x, y, z
