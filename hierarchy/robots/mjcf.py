"""What an MJCF says, with the files that it includes in their places."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from hierarchy.errors import RobotError
from hierarchy.robots.found import Coupled
from hierarchy.robots.urdf import read_xml

Element = ElementTree.Element

_JOINTS = ("joint", "freejoint")


def expanded(path: Path) -> Element:
    """Return the root of an MJCF with its includes in place and its mesh folder absolute.

    Paths of included files are relative to the folder of `path`, as in MuJoCo. Raises RobotError
    that names the include or the joint at fault.
    """
    root = read_xml(path)
    if root.tag != "mujoco":
        raise RobotError(f"robot file {str(path)!r} is no MJCF: it starts with <{root.tag}>, "
                         "not with <mujoco>")
    _include(root, path, {path.resolve()})
    _merge(root)
    if wrong := next(_complaints(root), None):
        raise RobotError(f"robot file {str(path)!r}: {wrong}")
    compiler = root.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(root, "compiler")
    folder = path.parent / (compiler.get("meshdir") or compiler.get("assetdir") or "")
    compiler.set("meshdir", str(folder.resolve()))
    return root


def coupled(root: Element) -> tuple[Coupled, ...]:
    """Return the joints that follow another one: equalities of joints that are lines."""
    return tuple(_of_equality(one) for one in root.findall("equality/joint")
                 if one.get("joint2") is not None and one.get("active") != "false"
                 and not any(_coefficients(one)[2:]))


def _of_equality(one: Element) -> Coupled:
    return Coupled(str(one.get("joint1")), str(one.get("joint2")), tuple(_coefficients(one)[:2]))


def _coefficients(one: Element) -> list[float]:
    given = [float(part) for part in one.get("polycoef", "0 1 0 0 0").split()]
    return [*given, *[0.0] * (5 - len(given))]


def _include(element: Element, main: Path, seen: set[Path]) -> None:
    for i, child in reversed(list(enumerate(element))):
        if child.tag != "include":
            _include(child, main, seen)
            continue
        file = main.parent / child.get("file", "")
        if not file.is_file():
            raise RobotError(f"robot file {str(main)!r}: the file {child.get('file')!r}, which it "
                             "includes, does not exist")
        if file.resolve() in seen:
            raise RobotError(f"robot file {str(main)!r}: the file {child.get('file')!r} is "
                             "included more than once")
        seen.add(file.resolve())
        part = read_xml(file)
        _include(part, main, seen)
        element[i:i + 1] = list(part)


def _merge(root: Element) -> None:
    """Make one section of those that have the same tag: pinocchio reads the first only."""
    first: dict[str, Element] = {}
    for section in list(root):
        if (kept := first.setdefault(section.tag, section)) is not section:
            kept.attrib.update(section.attrib)
            kept.extend(section)
            root.remove(section)


def _complaints(root: Element) -> Iterator[str]:
    if root.find("worldbody/body") is None:
        yield "it has no body: give the file of a robot, or a scene that includes one"
    bodies = [joint for body in root.iterfind("worldbody//body") for joint in body
              if joint.tag in _JOINTS]
    names = Counter(joint.get("name") for joint in bodies if joint.get("name") is not None)
    yield from (f"joint {name!r} occurs {count} times" for name, count in names.items()
                if count > 1)
    for joint in bodies:
        axis = joint.get("axis")
        try:
            if axis is not None and not any(map(float, axis.split())):
                yield f"joint {joint.get('name', '')!r}: its axis is zero: {axis!r}"
        except ValueError:
            yield f"joint {joint.get('name', '')!r}: its axis {axis!r} is not three numbers"
