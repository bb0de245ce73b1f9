"""Robots of MJCF files: compiled by MuJoCo (extra `sim`), rebuilt for pinocchio, and compared."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from numpy.typing import ArrayLike

from hierarchy.errors import RobotError, naming
from hierarchy.robots.found import Found, neutral_within_limits, proposed_end_effector
from hierarchy.robots.mjcf import constraints
from hierarchy.robots.mjcf.model import Built, build, compare, configuration, pose
from hierarchy.robots.mjcf.part import compiled, part_of
from hierarchy.robots.shapes import Shape, capsule_of, capsules_of
from hierarchy.robots.table import Base

_KINDS = ("plane", "height field", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh",
          "signed distance")  # mjtGeom


def read(path: Path, base: Base | None, shapes: bool, locked: Mapping[str, ArrayLike],
         root: Sequence[str]) -> Found:
    """Read a robot as `read_file` does; `root` names the bodies that it begins at, () for all.

    Raises RobotError where MuJoCo is missing or refuses the file, where no robot can be made of it,
    and where kinematics or inertia differ from MuJoCo's; UnknownNameError for a joint or body.
    """
    file = compiled(path)
    constraints.refuse(file)
    part = part_of(file, base, locked, root)
    with naming(f"robot file {file.file!r}: no model can be made of it", RobotError,
                (ValueError, RuntimeError)):  # of pinocchio
        built = build(part)
    said = (*part.said, *constraints.set_limits(built), *constraints.effort_limits(built))
    compare(built)
    end_effector = proposed_end_effector(built.model)  # before the loops add frames
    coupled, unkept = constraints.couplings(part)
    closed, unclosed = constraints.loops(built)
    found = Found(
        built.model, end_effector, coupled=coupled, loops=closed,
        apart=constraints.pairs_apart(built),
        rest=neutral_within_limits(built.model, configuration(built, file.model.qpos0)),
        starts={name: configuration(built, qpos)
                for name, qpos in zip(file.keys, file.model.key_qpos, strict=True)},
        missing=(*file.missing, *said, *unkept, *unclosed, *constraints.left_out(built)))
    if not shapes:
        return found
    capsules, without = capsules_of(_shapes(built))
    return replace(found, capsules=capsules, missing=(*found.missing, *without))


def _shapes(built: Built) -> Iterator[Shape]:
    """Yield the geoms that collide."""
    mj = built.part.compiled.model
    paired = {*mj.pair_geom1.tolist(), *mj.pair_geom2.tolist()}
    for geom in range(mj.ngeom):
        body, kind = int(mj.geom_bodyid[geom]), _KINDS[mj.geom_type[geom]]
        collides = mj.geom_contype[geom] or mj.geom_conaffinity[geom] or geom in paired
        if collides and body in built.part.bodies:
            joint, place = built.placed[body]
            name = mj.geom(geom).name or f"{built.part.compiled.bodies[body]} {kind} {geom}"
            points = ()
            if kind in ("mesh", "signed distance"):
                mesh = mj.geom_dataid[geom]
                first = mj.mesh_vertadr[mesh]
                points = mj.mesh_vert[first:first + mj.mesh_vertnum[mesh]]
            yield (name, kind, joint, place * pose(mj.geom_pos[geom], mj.geom_quat[geom]),
                   capsule_of(kind, mj.geom_size[geom], points))
