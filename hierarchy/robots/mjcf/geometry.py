"""Collision geometry of a compiled MJCF."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import coal
import numpy as np

from hierarchy.robots.mjcf.model import Built, pose

_PLANE, _HEIGHTS, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX = range(7)  # mjtGeom
_KINDS = ("plane", "height field", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh",
          "signed distance")


def shapes_of(built: Built) -> tuple[list[Any], list[str]]:
    """Return the geoms that collide, as `capsules_of` takes them, and sentences on the others."""
    mj, shapes, said = built.part.compiled.model, [], []
    paired = {*mj.pair_geom1.tolist(), *mj.pair_geom2.tolist()}
    for geom in range(mj.ngeom):
        body = int(mj.geom_bodyid[geom])
        collides = mj.geom_contype[geom] or mj.geom_conaffinity[geom] or geom in paired
        if not collides or body not in built.part.bodies:
            continue
        kind = int(mj.geom_type[geom])
        name = mj.geom(geom).name or (
            f"{built.part.compiled.bodies[body]} {_KINDS[kind]} {geom}")
        if kind in (_PLANE, _HEIGHTS):
            said.append(f"collision geometry {name!r} is a {_KINDS[kind]}, for which there is no "
                        "capsule")
            continue
        joint, place = built.placed[body]
        shapes.append(SimpleNamespace(
            name=name, parentJoint=joint, geometry=_shape(mj, geom, kind),
            placement=place * pose(mj.geom_pos[geom], mj.geom_quat[geom])))
    return shapes, said


def _shape(mj: Any, geom: int, kind: int) -> Any:
    size = mj.geom_size[geom]
    if kind == _SPHERE:
        return coal.Sphere(size[0])
    if kind in (_CAPSULE, _CYLINDER):
        return (coal.Capsule if kind == _CAPSULE else coal.Cylinder)(size[0], 2 * size[1])
    if kind == _ELLIPSOID:
        return coal.Ellipsoid(*size)
    if kind == _BOX:
        return coal.Box(*(2 * size))
    mesh = mj.geom_dataid[geom]
    first = mj.mesh_vertadr[mesh]
    return SimpleNamespace(vertices=np.array(mj.mesh_vert[first:first + mj.mesh_vertnum[mesh]],
                                             dtype=float))
