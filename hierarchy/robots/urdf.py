"""Checks of a URDF before pinocchio, which names no joint; what a robot made of it lacks."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from itertools import pairwise
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from hierarchy.errors import RobotError
from hierarchy.robots.found import Coupled
from hierarchy.words import listed, some

Element = ElementTree.Element

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
_WITH_LIMIT = ("revolute", "prismatic")
_MOST = 5  # complaints that are told
_LARGEST = 1e50  # of a mass, an inertia, a place or a size: their products are finite
EXPAND = "expand macros first: xacro in.xacro > out.urdf"
_EXPECTED = "expected a URDF (<robot>) or an MJCF (<mujoco>)"
_OTHERS = {  # by root element, in small letters
    "sdf": "is an SDF (Gazebo), which is not read; give the URDF that it was made from",
    "mujocoinclude": "is a part of an MJCF; give the file that includes it",
    "collada": "is a mesh; give the URDF or MJCF that names it"}


def read_xml(path: Path) -> Element:
    """Return the root of an XML file; raises RobotError with the line of a fault in it.

    As in pinocchio a prefix is a part of a name, whether or not a namespace is bound to it, and
    space in front of the file does not count. Of an MJCF that is not quite XML, which MuJoCo may
    read, only the empty root.
    """
    tree, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = tree.start, tree.end
    parser.CharacterDataHandler = tree.data
    try:
        parser.Parse(path.read_bytes().lstrip(), True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if _first_tag(path) == "mujoco":
            return Element("mujoco")
        if path.suffix == ".toml":
            raise RobotError(f"robot file {str(path)!r} is a TOML file; {_EXPECTED}. A scenario "
                             "is read by scenarios.load or `hierarchy run`") from error
        raise RobotError(f"robot file {str(path)!r} is not valid XML: {error}; {_EXPECTED}"
                         ) from error
    return tree.close()


def _first_tag(path: Path) -> str:
    """Return the name of the first element of a file, "" if it has none."""
    text = path.read_text(encoding="utf-8", errors="replace")
    found = re.search(r"<([A-Za-z][\w:.-]*)", re.sub(r"<!--.*?-->", "", text, flags=re.S))
    return found[1] if found else ""


def root_of(path: Path) -> Element:
    """Return the root of a URDF or MJCF file, whatever its suffix.

    Raises RobotError that says what another file is, and what to give instead.
    """
    if path.is_dir():
        raise RobotError(f"robot file {str(path)!r} is a folder; give the URDF or MJCF in it")
    if not path.is_file():
        raise RobotError(f"robot file {str(path)!r} does not exist")
    root = read_xml(path)
    if root.tag not in ("robot", "mujoco"):
        what = _OTHERS.get(root.tag.lower(), "is no robot")
        raise RobotError(f"robot file {str(path)!r} {what}: it starts with <{root.tag}>; "
                         f"{_EXPECTED}")
    return root


def check(root: Element, path: Path) -> None:
    """Raise a RobotError that names the joints or links at fault, and macros left in."""
    macros = left_over(root)
    if macros and path.suffix == ".xacro":
        raise RobotError(f"robot file {str(path)!r} has macros, such as {macros[0]}; {EXPAND}")
    if wrong := list(_complaints(root)):
        more = f"; and {len(wrong) - _MOST} more" if len(wrong) > _MOST else ""
        remedy = f". It has macros, such as {macros[0]}; {EXPAND}" if macros else ""
        raise RobotError(f"robot file {str(path)!r}: {'; '.join(wrong[:_MOST])}{more}{remedy}")


def left_over(root: Element) -> list[str]:
    """Return the macros of xacro that were not expanded: elements, and values of links and joints.

    Definitions of arguments and properties stand for nothing and do not count.
    """
    prefixes = {"xacro", *(key.removeprefix("xmlns:") for key, value in root.attrib.items()
                           if key.startswith("xmlns:") and value.rstrip("/").endswith("xacro"))}
    tags = [element.tag for element in root.iter()]
    elements = [f"<{tag}>" for tag in tags if tag.partition(":")[0] in prefixes and ":" in tag
                and tag.partition(":")[2] not in ("property", "arg")]
    values = [value for part in (*root.findall("link"), *root.findall("joint"))
              for element in part.iter() for value in element.attrib.values()
              if "${" in value or "$(" in value]
    return list(dict.fromkeys([*elements, *values]))


_LEFT_OUT = {"limit": ("effort", "velocity"), "inertia": ("ixy", "ixz", "iyz"),
             "dynamics": ("damping",), "safety_controller": ("k_velocity",)}


def complete(root: Element) -> None:
    """Make a URDF, in place, one that the parser reads: it refuses more than says what a robot is.

    Numbers lose the space around them, those of which only 0 can be meant where they are left out
    are 0, and what is only seen goes.
    """
    for element in root.iter():
        for key, value in element.items():
            if numbers_in(value, 1) is not None:
                element.set(key, value.strip())
        for key in _LEFT_OUT.get(element.tag, ()):
            element.attrib.setdefault(key, "0")
    for parent, tag in ((root, "material"), *((link, "visual") for link in root.findall("link"))):
        for seen in parent.findall(tag):
            parent.remove(seen)


def coupled(root: Element) -> tuple[Coupled, ...]:
    """Return the joints that follow another one (`mimic`); one that is fixed leaves a constant."""
    fixed = {name_of(joint) for joint in root.findall("joint") if joint.get("type") == "fixed"}
    found = []
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and name_of(joint) not in fixed:
            other, offset = str(mimic.get("joint")), float(mimic.get("offset", 0.0))
            slope = float(mimic.get("multiplier", 1.0))
            found.append(Coupled(name_of(joint), "", (offset,)) if other in fixed
                         else Coupled(name_of(joint), other, (offset, slope)))
    return tuple(found)


def _complaints(root: Element) -> Iterator[str]:
    links, joints = ([name_of(one) for one in root.findall(tag)] for tag in ("link", "joint"))
    for tag, names in (("link", links), ("joint", joints)):
        yield from (f"{tag} {name!r} occurs {count} times"
                    for name, count in Counter(names).items() if count > 1)
    if root.get("name") is None:
        yield "its <robot> has no name"
    if not links:
        yield "it has no link"
    if root.get("version", "1.0") == "1.0":
        yield from (f"{part.tag} {name_of(part)!r}: its quat_xyzw is ignored before "
                    '<robot version="1.1">; give rpy'
                    for part in (*root.findall("joint"), *root.findall("link"))
                    for path in ("origin", "inertial/origin", "collision/origin")
                    for origin in part.findall(path) if origin.get("quat_xyzw"))
    kinds = {name_of(joint): joint.get("type") for joint in root.findall("joint")}
    for joint in root.findall("joint"):
        name = f"joint {name_of(joint)!r}"
        yield from (f"{name}: {said}" for said in _of_joint(joint, links, kinds))
    for link in root.findall("link"):
        yield from (f"link {name_of(link)!r}: {said}" for said in _of_link(link))
    yield from _of_tree(root, links)


def _of_joint(joint: Element, links: list[str], kinds: dict[str, str | None]) -> Iterator[str]:
    kind = joint.get("type")
    if kind not in _KINDS:
        yield f"its type is {kind!r}; expected one of {', '.join(_KINDS)}"
    for end in ("parent", "child"):
        link = attribute_of(joint, end, "link")
        if link not in links:
            yield f"its {end} link {link!r} does not exist"
    if kind in _WITH_AXIS:
        yield from _unread(joint, "axis", 3, xyz="")
        axis = attribute_of(joint, "axis", "xyz")
        squared = sum(x * x for x in numbers_in(axis or "", 3) or (1.0,))
        if not np.finfo(float).tiny <= squared < np.inf:  # else it cannot be made of length 1
            yield f"its axis is {'too long' if squared > 1.0 else 'zero'}: {axis!r}"
    yield from _unread(joint, "origin", 3, xyz="0 0 0", rpy="0 0 0")
    yield from _unread(joint, "limit", 1, lower="0", upper="0", velocity="0", effort="0")
    yield from _of_limit(joint, kind)
    yield from _unread(joint, "mimic", 1, multiplier="0", offset="0")
    yield from _too_large(joint, "origin", "mimic")
    if joint.find("mimic") is not None:
        leader = attribute_of(joint, "mimic", "joint") or ""
        if leader == name_of(joint):
            yield "it is to follow itself"
        if leader not in kinds:
            yield f"it is to follow joint {leader!r}, which does not exist"
        if several := {"floating", "planar"} & {kind, kinds.get(leader)}:
            yield (f"it is to follow joint {leader!r}, and a {listed(sorted(several), 'or')} joint "
                   "has several positions")


def _of_limit(joint: Element, kind: str | None) -> Iterator[str]:
    limit = joint.find("limit")
    if limit is None:
        if kind in _WITH_LIMIT:
            yield f"it is {kind} and has no <limit>" + (
                "; without limits it is of type continuous" if kind == "revolute" else "")
        return
    lower, upper, velocity, effort = ((numbers_in(limit.get(key, "0"), 1) or (0.0,))[0]
                                      for key in ("lower", "upper", "velocity", "effort"))
    if kind in _WITH_LIMIT and lower > upper:
        yield f"its lower limit {lower:g} is above its upper limit {upper:g}"
    yield from (f"its limit {key} = {value:g} is negative"
                for key, value in (("velocity", velocity), ("effort", effort)) if value < 0.0)


def _unread(parent: Element, tag: str, count: int, **defaults: str) -> Iterator[str]:
    """Yield the attributes of a part that are not `count` finite numbers."""
    part, numbers = parent.find(tag), "a finite number" if count == 1 else "three finite numbers"
    if part is not None:
        yield from (f"its {tag} {key} = {part.get(key)!r} is not {numbers}"
                    for key, default in defaults.items()
                    if numbers_in(part.get(key, default), count) is None)


def _too_large(element: Element, *paths: str) -> Iterator[str]:
    """Yield the attributes of parts with a number with which the equations of motion overflow."""
    for part in (part for path in paths for part in element.findall(path)):
        yield from (f"its {part.tag} {key} = {value!r} is larger than {_LARGEST:g}"
                    for key, value in part.items()
                    if max(map(abs, numbers_in(value, len(value.split())) or [0.0])) > _LARGEST)


def _of_link(link: Element) -> Iterator[str]:
    mass = attribute_of(link, "inertial/mass", "value")
    number = None if mass is None else numbers_in(mass, 1)
    if mass is not None and (number is None or number[0] < 0.0):
        yield f"its mass {mass!r} is not a number from 0 on"
    yield from _too_large(link, "inertial/*", "collision/origin", "collision/geometry/*")
    for collision in link.findall("collision"):
        yield from _unread(collision, "origin", 3, xyz="0 0 0", rpy="0 0 0")
        for shape in collision.findall("geometry/*"):
            yield from (f"its {shape.tag} has {key} = {shape.get(key)!r}"
                        for key, count in (("radius", 1), ("length", 1), ("size", 3))
                        if shape.get(key) is not None
                        and not min(numbers_in(str(shape.get(key)), count) or (-1.0,)) >= 0.0)


def _of_tree(root: Element, links: list[str]) -> Iterator[str]:
    """Yield why the links are no tree: two parents, several roots, or a loop."""
    above: dict[str, tuple[str, str]] = {}
    for joint in root.findall("joint"):
        child, parent = (str(attribute_of(joint, end, "link")) for end in ("child", "parent"))
        if child in above:
            yield (f"link {child!r} is the child of joint {above[child][0]!r} and of joint "
                   f"{name_of(joint)!r}; a URDF is a tree: close a loop with a task")
        above[child] = name_of(joint), parent
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        yield f"links {', '.join(map(repr, roots))} have no parent; a URDF has one root"
    for link in links:
        around = [link]
        while around[-1] in above and len(around) <= len(links):
            around.append(above[around[-1]][1])
            if around[-1] == link:
                by = ", ".join(repr(above[child][0]) for child, _ in pairwise(around))
                yield f"joints {by} are a loop: a URDF is a tree"
                return


def numbers_in(text: str, count: int) -> list[float] | None:
    """Return `count` finite numbers of a text, None if it has others."""
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        return None
    return numbers if len(numbers) == count and all(map(isfinite, numbers)) else None


def attribute_of(element: Element, path: str, key: str) -> str | None:
    """Return an attribute of the element at a path, None if one of the two is not there."""
    found = element.find(path)
    return None if found is None else found.get(key)


def name_of(element: Element) -> str:
    """Return the name of a link or joint, "" if it has none."""
    return element.get("name", "")


_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_MACROS = 5        # that are named
_ROUNDING = 1e-12  # of a principal moment relative to the largest
_NOT_READ = re.compile(r"Could not parse (\w+) element for Link \[(.*)\]")


def not_read(lines: Iterable[str]) -> Iterator[str]:
    """Yield what the parser printed, one sentence for all links with the same fault."""
    links: dict[tuple[str, str], list[str]] = defaultdict(list)
    why: list[str] = []
    for line in lines:
        if (found := _NOT_READ.match(line)) is None:
            why.append(line)
            continue
        links[found[1], "; ".join(why)].append(found[2])
        why = []
    for (part, reason), names in links.items():
        told = f": {reason}" if reason else ""
        yield f"{part} of {some(list(dict.fromkeys(names)))} cannot be read{told}"
    yield from dict.fromkeys(why)


def remarks(root: Element) -> Iterator[str]:
    """Yield a sentence for each thing that a URDF has and the robot made from it lacks."""
    if macros := left_over(root):
        yield (f"what the macros {some(macros, _MACROS)} stand for is not in the robot; {EXPAND}")
    joints, flaws = root.findall("joint"), [(_flaw(link), link) for link in root.findall("link")]
    for what, why, found in (
            ("joints of Gazebo, or that close a loop,", "left out; a URDF is a tree", [
                *root.findall("gazebo/joint"), *root.findall("loop_joint")]),
            ("limits of", "a floating or planar joint has none", [
                joint for joint in joints if joint.find("limit") is not None
                and joint.get("type") in ("floating", "planar")]),
            ("position limits of", "a continuous joint has none", [
                joint for joint in joints if joint.get("type") == "continuous"
                and any(numbers_in(attribute_of(joint, "limit", side) or "0", 1) != [0.0]
                        for side in ("lower", "upper"))]),
            ("soft limits of", "those of <limit> count", [
                joint for joint in joints if joint.find("safety_controller") is not None]),
            ("axes of the planar joints", "their planes are normal to x by default", [
                joint for joint in joints
                if joint.get("type") == "planar" and joint.find("axis") is None]),
            *(("inertias of", f"a principal moment is {kind}", [
                link for flaw, link in flaws if flaw == kind])
              for kind in (_NEGATIVE, _ZERO, _LARGE))):
        if found:
            yield f"{what} {some([name_of(one) for one in found])}: {why}"
    passive = [key for key in ("damping", "friction") for joint in root.findall("joint")
               if numbers_in(attribute_of(joint, "dynamics", key) or "0", 1) not in ([0.0], None)]
    if passive:
        yield f"{listed(list(dict.fromkeys(passive)))} of joints: not in the equations of motion"


_NEGATIVE, _ZERO = "negative, which no body has", "zero, though the link has a mass"
_LARGE = "larger than the sum of the others, which no body has"


def _flaw(link: Element) -> str:
    """Return what is wrong with the principal moments of a link; "" without an inertia."""
    inertia = link.find("inertial/inertia")
    numbers = None if inertia is None else numbers_in(
        " ".join(inertia.get(key, "") for key in _INERTIA), len(_INERTIA))
    if numbers is None:
        return ""  # the parser says so
    xx, xy, xz, yy, yz, zz = numbers
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = numbers_in(attribute_of(link, "inertial/mass", "value") or "", 1) or [0.0]
    rounding = _ROUNDING * float(np.abs(moments).max())
    if abs(moments[0]) <= rounding:
        return _ZERO if mass[0] > 0.0 else ""
    if moments[0] < 0.0:
        return _NEGATIVE
    return _LARGE if moments[2] > moments[0] + moments[1] + rounding else ""
