"""What a URDF has and the robot made from it lacks, in sentences."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from xml.etree import ElementTree

import numpy as np

from hierarchy.robots.urdf import EXPAND, attribute_of, left_over, name_of, numbers_in
from hierarchy.words import some

Element = ElementTree.Element

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
    ignored = [name_of(joint) for joint in root.findall("joint") if joint.find("limit") is not None
               and joint.get("type") in ("floating", "planar")]
    if ignored:
        yield f"limits of {some(ignored)}: a floating or planar joint has none"
    plain = [name_of(joint) for joint in root.findall("joint")
             if joint.get("type") == "planar" and joint.find("axis") is None]
    if plain:
        yield f"axes of the planar joints {some(plain)}: their planes are normal to x by default"
    moments = {name_of(link): _least_moment(link) for link in root.findall("link")}
    for sign, what in ((-1.0, "negative, which no body has"),
                       (0.0, "zero, though the link has a mass")):
        if names := [name for name, found in moments.items() if found == sign]:
            yield f"inertias of {some(names)}: a principal moment is {what}"


def _least_moment(link: Element) -> float:
    """Return the sign of the least principal moment of a link; 1 without an inertia or a mass."""
    inertia = link.find("inertial/inertia")
    numbers = None if inertia is None else numbers_in(
        " ".join(inertia.get(key, "") for key in _INERTIA), len(_INERTIA))
    if numbers is None:
        return 1.0  # the parser says so
    xx, xy, xz, yy, yz, zz = numbers
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = numbers_in(attribute_of(link, "inertial/mass", "value") or "", 1) or [0.0]
    rounding = _ROUNDING * float(np.abs(moments).max())
    if abs(moments[0]) <= rounding:
        return 0.0 if mass[0] > 0.0 else 1.0
    return float(np.sign(moments[0]))
