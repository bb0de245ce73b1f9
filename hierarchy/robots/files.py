"""Models and shapes from URDF and MJCF files; a missing mesh is reported and not an error."""

import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from types import MappingProxyType
from typing import IO, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import OF_PROCESS, RobotError
from hierarchy.robots import found, mjcf, urdf
from hierarchy.robots.found import Found, is_floating, neutral_within_limits
from hierarchy.robots.from_table import ROOT
from hierarchy.robots.joints import held, without
from hierarchy.robots.library import pin
from hierarchy.robots.shapes import capsules_of, of_coal
from hierarchy.robots.table import Base
from hierarchy.words import some

Element = ElementTree.Element


def read_file(path: str | Path, base: Base | None = None, shapes: bool = True,
              locked: Mapping[str, ArrayLike] = MappingProxyType({}),
              root: Sequence[str] = ()) -> Found:
    """Read a robot from a URDF or MJCF file; its root element says which.

    `base` None takes that of the file: floating if its first joint is free, else fixed. Without
    `shapes` no collision geometry is read. `locked` joints are fixed at a value [rad or m], see
    `hierarchy.robots.joints`. `root` are the bodies of an MJCF at which the robot begins. Raises
    RobotError if the file cannot be read.
    """
    path = Path(path)
    element = urdf.root_of(path)
    if element.tag != "robot":
        return mjcf.read(path, base, shapes, locked, root)
    if root:
        raise RobotError(f"robot file {str(path)!r}: root is for an MJCF; a URDF is one robot")
    urdf.check(element, path)
    urdf.complete(element)
    return _read_urdf(path, element, base, shapes, locked)


def _read_urdf(path: Path, root: Element, base: Base | None, shapes: bool,
               locked: Mapping[str, ArrayLike]) -> Found:
    with _printed() as lines:
        try:
            model = model_of(root, base)
            said = tuple(urdf.not_read(lines()))
        except Exception as error:  # the parsers raise many types; all mean an invalid file
            raise RobotError(f"robot file {str(path)!r} cannot be read: "
                             f"{'; '.join([*lines(), _in_one_line(error)])}") from error
        model, coupled = without(model, urdf.coupled(root), locked, str(path))
        rest = neutral_within_limits(model, pin.neutral(model))
        if is_floating(model):  # its position in q is that in the world
            rest[:7] = pin.SE3ToXYZQUAT(model.jointPlacements[1])
            model.jointPlacements[1] = pin.SE3.Identity()
        names = {*model.names, ""}
        robot = Found(model, found.proposed_end_effector(model), rest=rest,
                      missing=(*said, *urdf.remarks(root), *found.remarks(model)),
                      coupled=tuple(one for one in coupled if {one.joint, one.other} <= names))
        if not shapes:
            return robot
        geometries, missing = _geometry(path, root, model)
        capsules, left_out = capsules_of(of_coal(geometries))
    # The world is no part of a robot with a free base.
    of_world = [one.name for one in capsules if one.joint == 0 and is_floating(model)]
    if of_world:
        left_out += (f"collision geometry {some(of_world)} is fixed to the world, not to the "
                     "robot; a scenario may list it as an obstacle",)
    kept = tuple(one for one in capsules if one.name not in of_world
                 and (one.radius > 0.0 or not np.array_equal(one.start, one.end)))
    return replace(robot, capsules=kept, missing=(*missing, *left_out, *robot.missing))


@contextmanager
def _printed() -> Iterator[Callable[[], list[str]]]:
    """Capture what parsers print on standard error; yield a function that returns its lines.

    Lines that name the parser's source files are left out. Other threads wait: the process has one
    standard error, which they would put back in another order.
    """
    with OF_PROCESS, _unnamed() as file:
        def lines() -> list[str]:
            file.seek(0)
            return [re.sub(r"^(Error|Warning):\s*", "", line.strip()) for line in file
                    if line.strip() and not line.strip().startswith("at line ")]

        with suppress(AttributeError, OSError, ValueError):  # none, a full disk, closed
            sys.stderr.flush()
        kept = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def _unnamed() -> IO[str]:
    """Open a file without a name: in memory on Linux, where no folder may be writable."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("stderr"), "w+", errors="replace")
    return TemporaryFile("w+", errors="replace")


def _geometry(path: Path, root: Element, model: Any) -> tuple[Any, list[str]]:
    """Return collision geometries; without meshes, or none at all, if they cannot be read."""
    said: list[str] = []
    for meshes in (True, False):
        try:
            geometries, missing = _urdf_shapes(path, deepcopy(root), model, meshes)
        except Exception as error:  # coal and assimp raise many types
            what = "meshes" if meshes else "collision geometry"
            said.append(f"the {what} cannot be read: {_in_one_line(error)}")
        else:
            return geometries, said + missing
    return (), said


def _in_one_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines()]
    of_use = [line.removeprefix("message:").strip() for line in lines
              if line and not line.startswith(("From file", "in function", "at line"))]
    return " ".join(of_use).strip()[:200] or type(error).__name__


def _urdf_shapes(path: Path, root: Element, model: Any, meshes: bool) -> tuple[Any, list[str]]:
    """Read a copy of the text with absolute mesh paths and without the missing meshes."""
    missing: dict[str, str] = {}
    for link in root.iter("link"):
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            file = _mesh_file(name, path)
            if meshes and file is not None:
                mesh.set("filename", str(file))
                mesh.set("scale", _in_metres(mesh.get("scale", "1 1 1"), file))
                continue
            link.remove(collision)
            if file is None:
                missing.setdefault(urdf.name_of(link), name)
    text = ElementTree.tostring(root, encoding="unicode")
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    name = next(iter(missing.values()), "")
    searched = ("; packages are searched for in the folders above the robot's file"
                if name.startswith("package://") else "")
    return geometry.geometryObjects, [f"meshes of {some(list(missing))} are not there, such as "
                                      f"{name!r}{searched}"] if missing else []


def _in_metres(scale: str, file: Path) -> str:
    """Return a scale times the unit of a Collada file, which coal does not read."""
    unit = re.search(rb"<unit\s[^>]*meter\s*=\s*[\"']([\d.eE+-]+)", file.read_bytes()) if (
        file.suffix.lower() == ".dae") else None
    factors = urdf.numbers_in(scale, 3)
    return scale if unit is None or factors is None else " ".join(
        str(float(unit[1]) * factor) for factor in factors)


def _mesh_file(name: str, path: Path) -> Path | None:
    """Return the file of a mesh that a URDF names, or None if it does not exist.

    "package://NAME/..." is searched for in the folders above the URDF: one called NAME, or one that
    contains it.
    """
    if not name.startswith("package://"):
        file = path.parent / name.removeprefix("file://")
        return file.resolve() if file.is_file() else None
    package, _, rest = name.removeprefix("package://").partition("/")
    places = (folder / package / rest for folder in path.resolve().parents)
    return next(filter(Path.is_file, places), None)


def model_of(root: Element, base: Base | None) -> Any:
    """Build the model of a URDF, whose planar joints move in the plane normal to their axis.

    A floating first joint is the free base; `base` "fixed" fixes it where the file has it, and
    "floating" adds one to a URDF without.
    """
    text = ElementTree.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text)
    if base == "floating" and not is_floating(model):
        if ROOT in list(model.names):
            raise RobotError(f"joint {ROOT!r} has the name that a floating base is given")
        model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    elif base == "fixed" and is_floating(model):
        model = held(model, [1], pin.neutral(model))
    for joint in root.findall("joint"):
        if joint.get("type") == "planar" and joint.get("name") in list(model.names):
            axis = joint.find("axis")
            xyz = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
            _turn(model, model.getJointId(joint.get("name")), np.array(xyz.split(), dtype=float))
    return model


def _turn(model: Any, joint: int, axis: Any) -> None:
    """Turn z of a joint onto `axis` (3,), and leave in place what it carries."""
    z = np.array([0.0, 0.0, 1.0])
    turn = pin.SE3(pin.Quaternion.FromTwoVectors(z, axis), np.zeros(3))
    back = turn.inverse()
    model.jointPlacements[joint] = model.jointPlacements[joint] * turn
    model.inertias[joint] = back.act(model.inertias[joint])
    for child in range(1, model.njoints):
        if model.parents[child] == joint:
            model.jointPlacements[child] = back * model.jointPlacements[child]
    for frame in model.frames:
        if frame.parentJoint == joint:
            frame.placement = back * frame.placement
