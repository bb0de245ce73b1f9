"""Models and shapes from URDF and MJCF files; a missing mesh is reported and not an error."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from hierarchy.errors import RobotError
from hierarchy.robots import mjcf, urdf
from hierarchy.robots.found import Coupled, Found, is_floating, neutral_within_limits
from hierarchy.robots.joints import without
from hierarchy.robots.points import proposed_end_effector
from hierarchy.robots.shapes import capsules_of
from hierarchy.robots.table import Base

SUFFIXES = (".urdf", ".xml", ".mjcf")
Element = ElementTree.Element


def read_file(path: str | Path, base: Base | None = None, shapes: bool = True,
              locked: Mapping[str, ArrayLike] = MappingProxyType({})) -> Found:
    """Read a robot from a URDF (.urdf) or MJCF (.xml, .mjcf) file.

    `base` None takes that of the file: fixed for a URDF, floating for an MJCF whose first body has
    a free joint. Without `shapes` no collision geometry is read. `locked` joints are fixed at a
    value [rad or m], see `hierarchy.robots.joints`. Raises RobotError if the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise RobotError(f"robot file {str(path)!r} does not exist")
    if path.suffix not in SUFFIXES:
        raise RobotError(f"robot file {str(path)!r}: expected .urdf, .xml or .mjcf")
    is_urdf = path.suffix == ".urdf"
    root = urdf.checked(path) if is_urdf else mjcf.expanded(path)
    with _printed() as lines:
        try:
            model = _urdf_model(root, base) if is_urdf else _mjcf_model(root, base)
        except Exception as error:  # the parsers raise many types; all mean an invalid file
            raise RobotError(f"robot file {str(path)!r} cannot be read: "
                             f"{'; '.join([*lines(), _in_one_line(error)])}") from error
        coupled = (urdf if is_urdf else mjcf).coupled(root)
        found = _found(*without(model, coupled, locked, str(path)))
        if not shapes:
            return found
        geometries, missing = _geometry(path, root, model,
                                        _urdf_shapes if is_urdf else _mjcf_shapes)
        capsules, left_out = capsules_of(geometries)
    return replace(found, capsules=_held_by(model, capsules), missing=(*missing, *left_out))


def _found(model: Any, coupled: tuple[Coupled, ...]) -> Found:
    names = set(model.names)
    return Found(model, proposed_end_effector(model),
                 rest=neutral_within_limits(model, pin.neutral(model)),
                 coupled=tuple(one for one in coupled if {one.joint, one.other} <= {*names, ""}))


@contextmanager
def _printed() -> Iterator[Callable[[], list[str]]]:
    """Keep what parsers print on standard error from it; yield a function that returns its lines.

    Lines that name the parser's source files are left out.
    """
    sys.stderr.flush()
    kept = os.dup(2)
    with TemporaryFile("w+", errors="replace") as file:
        def lines() -> list[str]:
            file.seek(0)
            return [re.sub(r"^(Error|Warning):\s*", "", line.strip()) for line in file
                    if line.strip() and not line.strip().startswith("at line ")]

        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def _urdf_model(root: Element, base: Base | None) -> Any:
    free = (pin.JointModelFreeFlyer(),) if base == "floating" else ()
    return pin.buildModelFromXML(ElementTree.tostring(root, encoding="unicode"), *free)


def _mjcf_model(root: Element, base: Base | None) -> Any:
    with _copied(root) as path:
        model = pin.buildModelFromMJCF(path)
        if base == "floating" and not is_floating(model):
            return pin.buildModelFromMJCF(path, pin.JointModelFreeFlyer())
    if base == "fixed" and is_floating(model):
        return pin.buildReducedModel(model, [1], pin.neutral(model))
    return model


@contextmanager
def _copied(root: Element) -> Iterator[str]:
    """Yield the path of a temporary file with the text of an MJCF."""
    with TemporaryDirectory() as copies:
        copy = Path(copies) / "model.xml"
        copy.write_text(ElementTree.tostring(root, encoding="unicode"), encoding="utf-8")
        yield str(copy)


Shapes = Callable[[Path, Element, Any, bool], tuple[Any, list[str]]]


def _geometry(path: Path, root: Element, model: Any, read: Shapes) -> tuple[Any, list[str]]:
    """Return collision geometries; without meshes, or none at all, if they cannot be read."""
    said: list[str] = []
    for meshes in (True, False):
        try:
            geometries, missing = read(path, deepcopy(root), model, meshes)
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
    missing = []
    for link in root.iter("link"):
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            file = _mesh_file(name, path)
            if meshes and file is not None:
                mesh.set("filename", str(file))
                continue
            link.remove(collision)
            if file is None:
                missing.append(f"mesh {name!r} of link {link.get('name')!r} is not there")
    text = ElementTree.tostring(root, encoding="unicode")
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    return geometry.geometryObjects, missing


def _mesh_file(name: str, path: Path) -> Path | None:
    """Return the file of a mesh that a URDF names, or None if it does not exist.

    "package://NAME/..." is searched for in the folders above the URDF: one called NAME, or one that
    contains it.
    """
    if not name.startswith("package://"):
        file = path.parent / name.removeprefix("file://")
        return file.resolve() if file.is_file() else None
    package, _, rest = name.removeprefix("package://").partition("/")
    for folder in path.resolve().parents:
        for at in (folder / package / rest, folder / rest if folder.name == package else folder):
            if at.is_file():
                return at
    return None


def _mjcf_shapes(path: Path, root: Element, model: Any, meshes: bool) -> tuple[Any, list[str]]:
    """Read a copy without the missing meshes."""
    compiler, missing, absent = root.find("compiler"), [], set()
    folder = Path("" if compiler is None else compiler.get("meshdir", ""))
    for mesh in root.iter("mesh"):
        file = mesh.get("file")
        if file is not None and not (folder / file).is_file():
            absent.add(mesh.get("name") or Path(file).stem)
            missing.append(f"mesh {file!r} is not there")
    for parent in list(root.iter()):
        for geom in parent.findall("geom"):
            name = geom.get("mesh")
            if name is not None and (name in absent or not meshes):
                parent.remove(geom)
    with _copied(root) as copy:
        geometry = pin.buildGeomFromMJCF(model, copy, pin.GeometryType.COLLISION)
    return geometry.geometryObjects, missing


def _held_by(model: Any, capsules: tuple[Any, ...]) -> tuple[Any, ...]:
    """Omit capsules that belong to no joint of the model or have no size."""
    return tuple(c for c in capsules if 0 <= c.joint < model.njoints
                 and (c.radius > 0.0 or not np.array_equal(c.start, c.end)))
