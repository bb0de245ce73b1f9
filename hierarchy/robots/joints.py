"""Coordinates of joints, and their values: as many numbers as a joint has velocities.

A value is the position of a joint of one coordinate, the angle of a continuous one, whose
coordinates are (cos, sin), and the rotation vector of a ball, whose coordinates are a quaternion
(x, y, z, w). Planar and free joints are made of these: (x, y, angle), and a position followed by a
rotation vector.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import RobotError, check_name, finite_numbers, naming
from hierarchy.problem import Array
from hierarchy.robots.found import Coupled
from hierarchy.robots.library import pin

_MOST = 400  # velocities: pinocchio's data grow with their cube, to 2 GB
_UNIT = 1e-6    # off one to which the length of a quaternion or (cos, sin) may be given
_EXACT = 1e-14  # off one by rounding, which is left


class Part(NamedTuple):
    """A part of joint number `joint`: its coordinates begin at `q`, its velocities at `v`.

    It has `size` coordinates: 1, 2 (cos, sin; one velocity) or 4 (a quaternion; three velocities).
    `unit` is that of its value, "rad" or "m".
    """

    joint: int
    q: int
    v: int
    size: int
    unit: str = "rad"

    @property
    def velocities(self) -> int:
        """Number of velocities."""
        return 3 if self.size == 4 else 1


def parts_of(model: Any) -> tuple[Part, ...]:
    """Return the parts of all joints of a pinocchio model, in the order of its coordinates."""
    parts: list[Part] = []
    for number, joint in enumerate(model.joints):
        q, v = joint.idx_q, joint.idx_v
        for size, unit in _pieces(joint) if number else ():
            parts.append(Part(number, q, v, size, unit))
            q, v = q + size, v + parts[-1].velocities
    return tuple(parts)


_SEVERAL = {"Spherical": [(4, "rad")], "Planar": [(1, "m"), (1, "m"), (2, "rad")],
            "FreeFlyer": [(1, "m"), (1, "m"), (1, "m"), (4, "rad")]}


def _pieces(joint: Any) -> Sequence[tuple[int, str]]:
    """Return the number of coordinates and the unit of each part of a joint."""
    kind = joint.shortname().removeprefix("JointModel")
    if kind in ("Composite", "SphericalZYX", "Universal"):
        raise RobotError(f"joint {joint.id}: in a joint of the kind {kind} axes turn each other, "
                         "which pinocchio does not differentiate; give each a joint of its own")
    if joint.nq == joint.nv > 0:
        return [(1, "m" if kind.startswith(("Translation", "P")) else "rad")] * joint.nq
    if (joint.nq, joint.nv) == (2, 1):
        return [(2, "rad")]
    if kind not in _SEVERAL:
        raise RobotError(f"joint {joint.id}: a joint of {joint.nq} coordinates and {joint.nv} "
                         f"velocities of the kind {kind} is not known")
    return _SEVERAL[kind]


def values_of(parts: Iterable[Part], q: Array) -> Array:
    """Return the values (n,) [rad or m] of a configuration q (nq,)."""
    found: list[float] = []
    for part in parts:
        found += _VALUE[part.size](q[part.q:part.q + part.size])
    return np.array(found)


def coordinates_of(parts: Iterable[Part], values: Array) -> Array:
    """Return the coordinates (nq,) of the parts that have these values, one after the other."""
    found: list[float] = []
    at = 0
    for part in parts:
        found += _COORDINATES[part.size](values[at:at + part.velocities])
        at += part.velocities
    return np.array(found)


# By the number of coordinates.
_VALUE: dict[int, Callable[[Array], list[float]]] = {
    1: np.ndarray.tolist, 2: lambda own: [float(np.arctan2(own[1], own[0]))],
    4: lambda own: pin.log3(pin.Quaternion(own.copy()).toRotationMatrix()).tolist()}
_COORDINATES: dict[int, Callable[[Array], list[float]]] = {
    1: np.ndarray.tolist, 2: lambda own: [float(np.cos(own[0])), float(np.sin(own[0]))],
    4: lambda own: pin.Quaternion(pin.exp3(own)).coeffs().tolist()}


def set_joint(parts: Sequence[Part], q: Array, joint: int, name: str, value: ArrayLike) -> None:
    """Set the coordinates of one joint in q (nq,) in place.

    `value` is its value, one number for each velocity, or its coordinates. RobotError, naming the
    joint, for another count, a number that is not finite, or a length other than one.
    """
    own = [part for part in parts if part.joint == joint]
    given = finite_numbers(f"joint {name!r}", np.atleast_1d(np.asarray(value)))
    counts = sum(part.velocities for part in own), sum(part.size for part in own)
    if len(given) not in counts:
        either = " or ".join(map(str, dict.fromkeys(counts)))
        raise RobotError(f"joint {name!r}: {len(given)} numbers, expected {either}")
    first = own[0].q
    q[first:first + counts[1]] = (given if len(given) == counts[1]
                                  else coordinates_of(own, given))
    normalise(own, q, {joint: name})


def normalise(parts: Iterable[Part], q: Array, names: Any) -> None:
    """Give each quaternion and (cos, sin) in q (nq,) the length one, in place.

    RobotError, naming the joint by `names`, if a length differs from one by more than 1e-6.
    """
    for part in parts:
        if part.size == 1:
            continue
        own = q[part.q:part.q + part.size]
        length = float(np.linalg.norm(own))
        if not abs(length - 1.0) <= _UNIT:
            what = "(cos, sin)" if part.size == 2 else "quaternion (x, y, z, w)"
            raise RobotError(f"joint {names[part.joint]!r}: its {what} {own.tolist()} has length "
                             f"{length:.9g}, not 1")
        if abs(length - 1.0) > _EXACT:
            own /= length


def check_size(model: Any, what: str) -> None:
    """Raise RobotError for a model, such as cloth, whose data would fill the memory."""
    if model.nv > _MOST:
        raise RobotError(f"{what} has {model.nv} velocities, of at most {_MOST}")


def without(model: Any, coupled: tuple[Coupled, ...], locked: Mapping[str, ArrayLike],
            file: str) -> tuple[Any, tuple[Coupled, ...]]:
    """Return a model without its locked joints, and its couplings.

    `locked` has their values. What follows a locked joint is held where that puts it. Raises
    UnknownNameError, and RobotError, naming file and joint, for a value that is none.
    """
    if not locked:
        return model, coupled
    q, parts, names = np.array(pin.neutral(model)), parts_of(model), list(model.names)
    for name, value in locked.items():
        check_name("joint", name, names[1:])
        with naming(f"robot file {file!r}: locked", RobotError):
            set_joint(parts, q, names.index(name), name, value)
    values = values_of(parts, q)
    left = tuple(one if one.other not in locked else Coupled(one.joint, "", (one.at(
        values[model.joints[names.index(one.other)].idx_v]),)) for one in coupled)
    return held(model, [names.index(name) for name in locked], q), left


def held(model: Any, joints: list[int], q: Array) -> Any:
    """Return a model whose `joints` are held at q (nq,).

    pinocchio refers to frames by name, and a link may have the name of a joint. Meanwhile it has
    one that no file can give. The frame of a joint may be turned in it, as that of a planar one.
    """
    places = {frame.name: pin.SE3(frame.placement) for frame in model.frames
              if frame.type == pin.FrameType.JOINT and frame.parentJoint in joints}
    links = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    for frame in links:
        frame.name = f"\n{frame.name}"
    found = pin.buildReducedModel(model, joints, q)
    for frame in found.frames:
        frame.placement = frame.placement * places.get(frame.name, pin.SE3.Identity())
        frame.name = frame.name.removeprefix("\n")
    return found
