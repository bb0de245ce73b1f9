"""Capsules: around collision geometry, and around the links of a robot given as a table."""

from collections import Counter
from itertools import product
from typing import Any

import numpy as np

from hierarchy.avoidance.body import Capsule, Vector
from hierarchy.errors import brief, number, refuse
from hierarchy.problem import Array
from hierarchy.robots.table import Table, TreeTable

_CORNERS: Array = np.array(list(product((-1.0, 1.0), repeat=3)))
_MOST = 2000  # vertices of a mesh that are used to choose the axis


def capsules_of(geometries: Any) -> tuple[tuple[Capsule, ...], tuple[str, ...]]:
    """Return a capsule around each collision geometry, and sentences on those without one."""
    capsules, left_out = [], []
    for geometry in geometries:
        name, kind = str(geometry.name), type(geometry.geometry).__name__
        found = _capsule_of(geometry.geometry, kind)
        if found is None:
            left_out.append(f"collision geometry {name!r} is a {kind}, for which there is no "
                            "capsule")
            continue
        start, end, radius = found
        placement = geometry.placement
        capsules.append(Capsule(
            name, int(geometry.parentJoint), _vector(placement.act(start)),
            _vector(placement.act(end)), float(radius)))
    return tuple(capsules), tuple(left_out)


def _capsule_of(shape: Any, kind: str) -> tuple[Array, Array, float] | None:
    z = np.array([0.0, 0.0, 1.0])
    if kind == "Sphere":
        return 0.0 * z, 0.0 * z, shape.radius
    if kind in ("Capsule", "Cylinder"):
        return -shape.halfLength * z, shape.halfLength * z, shape.radius
    points = _points_of(shape, kind)
    return None if points is None or len(points) == 0 else bounding_capsule(points)


def _points_of(shape: Any, kind: str) -> Array | None:
    """Points whose convex hull is the shape, or contains it."""
    if kind == "Box":
        return np.asarray(_CORNERS * shape.halfSide, dtype=float)
    if kind == "Ellipsoid":  # the box around it
        return np.asarray(_CORNERS * shape.radii, dtype=float)
    for of_mesh in ("vertices", "points"):
        if hasattr(shape, of_mesh):
            points = getattr(shape, of_mesh)
            return np.array(points() if callable(points) else points, dtype=float).reshape(-1, 3)
    return None


def bounding_capsule(points: Array) -> tuple[Array, Array, float]:
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


def _around(points: Array, axis: Array) -> tuple[Array, Array, float]:
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
    if low > high:  # one ball is enough
        low = high = (low + high) / 2
    origin = middle @ across
    return origin + low * axis, origin + high * axis, radius


def _vector(point: Array) -> Vector:
    x, y, z = (float(value) for value in point)
    return x, y, z


def link_capsules(table: Table, foot: float = 0.0, base: int | None = None) -> tuple[Capsule, ...]:
    """Capsules of a robot given as a table; for an arm, each link from its joint to the next.

    Links of length zero are omitted because their neighbours cover them. With `foot` > 0 [m] the
    first capsule of an arm is a column from that far below the base frame up to it. Each touches
    the next. `base` is the index of the joint that moves the base, None for that of the table.
    """
    refuse(not isinstance(table, Table), f"link_capsules: expected a table, got {brief(table)}")
    number("link_capsules: foot [m]", foot)
    if isinstance(table, TreeTable):
        return _tree_capsules(table, int(table.base == "floating") if base is None else base)
    first = 1 + (base or 0)
    column = [Capsule("foot", first - 1, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), table.radius)]
    links = [Capsule(f"link {i + 1}", i + first, (0.0, 0.0, 0.0), (a, 0.0, d), table.radius)
             for i, (a, d) in enumerate(zip(table.a, table.d, strict=True)) if (a, d) != (0.0, 0.0)]
    return tuple((column if foot > 0.0 else []) + links)


def _tree_capsules(table: TreeTable, base: int) -> tuple[Capsule, ...]:
    index = {"": base, **{joint.name: base + i for i, joint in enumerate(table.joints, 1)}}
    links = [(name, link) for name, link in
             (*((joint.name, joint.link) for joint in table.joints), *table.links)
             if link.radius > 0.0]
    seen, capsules = Counter[str](), list[Capsule]()
    for name, link in links:
        seen[name] += 1
        number = f" {seen[name]}" if seen[name] > 1 else ""
        capsules.append(Capsule(f"{name or 'base'}{number}", index[name], link.start, link.end,
                                link.radius))
    return tuple(capsules)
