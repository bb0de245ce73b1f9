"""A robot as plain numbers: its kinematic tree, its placements, and its links as capsules."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule
from hierarchy.problem import Array

Kind = Literal["turn", "wheel", "slide", "ball"]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

_AXES: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_SLIDES: list[tuple[Kind, Vector]] = [("slide", axis) for axis in _AXES]
# Pinocchio's joints by name, those about or along one axis without its name: elementary motions.
_SINGLE: dict[str, Kind] = {
    "R": "turn", "RevoluteUnaligned": "turn", "RUB": "wheel", "RevoluteUnboundedUnaligned": "wheel",
    "P": "slide", "PrismaticUnaligned": "slide"}
_SEVERAL: dict[str, list[tuple[Kind, Vector]]] = {
    "Translation": _SLIDES, "FreeFlyer": [*_SLIDES, ("ball", _AXES[2])],
    "Spherical": [("ball", _AXES[2])], "Planar": [*_SLIDES[:2], ("wheel", _AXES[2])],
    "SphericalZYX": [("turn", _AXES[2]), ("turn", _AXES[1]), ("turn", _AXES[0])]}
# Units of a motion's coordinates, and of a small step along it.
_UNITS: dict[Kind, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "turn": (("rad",), ("rad",)), "wheel": (("1", "1"), ("rad",)), "slide": (("m",), ("m",)),
    "ball": (("1",) * 4, ("rad",) * 3)}
_STILL: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Motion:
    """One elementary motion of a joint, behind a fixed placement.

    kind : "turn" about `axis` by an angle [rad], "wheel" about it by a cosine and a sine, "slide"
        along it [m], or "ball", by a unit quaternion x, y, z, w.
    coordinate : index in q of its first coordinate.
    position (3,) [m], rotation (3, 3) : of the placement before it.
    """

    kind: Kind
    coordinate: int
    axis: Vector
    position: Vector = _STILL
    rotation: Matrix = _AXES


@dataclass(frozen=True)
class Joint:
    """A joint by name, the joint `parent` that carries it (0: the base), and its motions."""

    name: str
    parent: int
    motions: tuple[Motion, ...]


def tree_of(robot: Robot) -> tuple[Joint, ...]:
    """Return the joints of a robot, each behind its parent.

    Raises HierarchyError for a kind of joint that is not known here, such as a screw.
    """
    model = robot.model
    return tuple(
        Joint(name, parent, tuple(_motions(name, joint, placement)))
        for name, parent, joint, placement in zip(
            robot.joint_names, robot.parents[1:], list(model.joints)[1:],
            list(model.jointPlacements)[1:], strict=True))


def joint_units(joints: Sequence[Joint]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the units of q (nq,) and of a small step (n,): "rad", "m", or "1" of a ratio."""
    units = [_UNITS[motion.kind] for joint in joints for motion in joint.motions]
    return (tuple(unit for positions, _ in units for unit in positions),
            tuple(unit for _, steps in units for unit in steps))


def _motions(name: str, joint: Any, placement: Any) -> Iterator[Motion]:
    """Yield the motions of a joint of pinocchio; one made of several has them in turn."""
    kind = joint.shortname().removeprefix("JointModel")
    if kind == "Composite":
        parts = joint.extract()
        for i, (part, before) in enumerate(zip(parts.joints, parts.jointPlacements, strict=True)):
            yield from _motions(name, part, placement * before if i == 0 else before)
        return
    if kind in _SEVERAL:
        motions = _SEVERAL[kind]
    elif (single := _SINGLE.get(kind.rstrip("XYZ"))) is not None:
        motions = [(single, _axis_of(joint))]
    else:
        raise HierarchyError(f"joint {name!r} is of the kind {kind}, which cannot be recorded")
    coordinate = int(joint.idx_q)
    before = _vector(placement.translation), _matrix(placement.rotation)
    for motion, axis in motions:
        yield Motion(motion, coordinate, axis, *before)
        coordinate, before = coordinate + len(_UNITS[motion][0]), (_STILL, _AXES)


def _axis_of(joint: Any) -> Vector:
    """Axis of a joint with one velocity: the half of its motion subspace that is not zero."""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.idx_q + joint.nq))
    subspace = np.ravel(data.S)
    return _vector(subspace[:3] + subspace[3:])


def placements(joints: Sequence[Joint], q: ArrayLike) -> Array:
    """Return the placements (..., J + 1, 12) of the joints' frames at positions q (..., nq).

    Each is a rotation, column by column, then a translation [m], as in a State.
    """
    q = np.asarray(q, dtype=float)
    rotation = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    placed = [(rotation, np.zeros((*q.shape[:-1], 3)))]
    for joint in joints:
        R, p = placed[joint.parent]
        for motion in joint.motions:
            R, p = R @ np.array(motion.rotation), p + R @ np.array(motion.position)
            R, p = _moved(R, p, motion, q[..., motion.coordinate:])
        placed.append((R, p))
    return np.stack([np.concatenate([np.swapaxes(R, -1, -2).reshape(*q.shape[:-1], 9), p], axis=-1)
                     for R, p in placed], axis=-2)


def _moved(R: Array, p: Array, motion: Motion, q: Array) -> tuple[Array, Array]:
    axis = np.array(motion.axis)
    if motion.kind == "slide":
        return R, p + (R @ axis) * q[..., :1]
    if motion.kind == "ball":
        return R @ _of_quaternion(q[..., :4]), p
    cosine, sine = (q[..., 0], q[..., 1]) if motion.kind == "wheel" else (
        np.cos(q[..., 0]), np.sin(q[..., 0]))
    return R @ _about(axis, cosine, sine), p


def _about(axis: Array, cosine: Array, sine: Array) -> Array:
    """Rotations (..., 3, 3) about an axis, after Rodrigues."""
    c, s = cosine[..., None, None], sine[..., None, None]
    return np.asarray(c * np.eye(3) + (1.0 - c) * np.outer(axis, axis) + s * _cross(axis))


def _of_quaternion(quaternion: Array) -> Array:
    """Rotations (..., 3, 3) of unit quaternions (..., 4) x, y, z, w."""
    K, w = _cross(quaternion[..., :3]), quaternion[..., 3, None, None]
    return np.asarray(np.eye(3) + 2.0 * (w * K + K @ K))


def _cross(v: Array) -> Array:
    """The matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    return np.asarray(np.cross(v[..., None, :], np.eye(3))).swapaxes(-1, -2)


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _matrix(values: Any) -> Matrix:
    x, y, z = (_vector(row) for row in values)
    return x, y, z


_STICK = 0.08  # radius of a link without capsules, relative to the robot's longest link


def capsules(robot: Robot, foot: float = 0.0) -> tuple[Capsule, ...]:
    """Return a robot's links: its capsules or, without any, sticks from joint to joint.

    With `foot` > 0 [m] the first is a column of that height below the base.
    """
    links = robot.capsules or _sticks(robot)
    if foot == 0.0 or robot.base == "floating" or not links:
        return links
    return (Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), links[0].radius), *links)


def _sticks(robot: Robot) -> tuple[Capsule, ...]:
    end = robot.frame(robot.end_effector)
    sticks = [(body.name, body.parent, body.position) for body in robot.bodies()]
    sticks = [stick for stick in (*sticks, (end.name, end.joint, end.offset))
              if np.linalg.norm(stick[2]) > 0.0]
    radius = _STICK * max((float(np.linalg.norm(stick[2])) for stick in sticks), default=0.0)
    return tuple(Capsule(name, joint, (0.0, 0.0, 0.0), (float(x), float(y), float(z)), radius)
                 for name, joint, (x, y, z) in sticks)


def lowest(robot: Robot, links: Sequence[Capsule]) -> float:
    """Height [m] of the lowest point of a robot at rest, at most that of its base."""
    low = ends(links, State.at(robot, robot.rest).placements)[..., 2].min(axis=-1)
    return float((low - [link.radius for link in links]).min(initial=0.0))


def ends(links: Sequence[Capsule], placements: Array) -> Array:
    """Return start and end of each capsule in the world: (..., C, 2, 3) [m].

    placements (..., J + 1, 12), as in a State.
    """
    joints = np.array([link.joint for link in links], dtype=np.int64)
    return np.stack([place(placements, joints, [getattr(link, side) for link in links])
                     for side in ("start", "end")], axis=-2)


def place(placements: Array, joints: Any, offsets: Any) -> Array:
    """Return the world positions (..., K, 3) [m] of offsets (K, 3) in the frames of joints (K,)."""
    rows = placements[..., np.asarray(joints, dtype=np.int64), :]
    columns = rows[..., :9].reshape(*rows.shape[:-1], 3, 3)
    turned = np.einsum("...kci,kc->...ki", columns, np.reshape(offsets, (-1, 3)))
    return np.asarray(turned + rows[..., 9:])
