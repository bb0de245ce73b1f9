"""What a file or a table says of a robot, and what is proposed where it does not."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.avoidance.body import Capsule, ControlPoint
from hierarchy.problem import Array
from hierarchy.robots.library import pin
from hierarchy.robots.table import Table
from hierarchy.words import listed, some

_HUGE = 1e300  # a limit of pinocchio beyond this is none


@dataclass(frozen=True)
class Coupled:
    """A joint that the file couples to another: q = sum of coefficients[i] q_other^i [rad or m].

    An MJCF may couple a joint to none: then `other` is "" and q is a constant.
    """

    joint: str
    other: str
    coefficients: tuple[float, ...]

    @property
    def straight(self) -> bool:
        """Whether the polynomial is a line."""
        return len(self.coefficients) <= 2

    def at(self, value: ArrayLike) -> float:
        """Return the position of the joint where the other has this value [rad or m]."""
        powers = np.asarray(value, dtype=float) ** np.arange(len(self.coefficients))
        return float(powers @ self.coefficients)

    def __str__(self) -> str:
        powers = {0: "", 1: f" {self.other}"}
        terms = [f"{value:g}{powers.get(i, f' {self.other}^{i}')}"
                 for i, value in enumerate(self.coefficients) if value != 0.0]
        return f"{self.joint} = {' + '.join(terms[::-1]) or '0'} in the file".replace("+ -", "- ")


@dataclass(frozen=True)
class Loop:
    """A chain that the file closes: two frames have one origin, and the same axes if `rigid`."""

    name: str
    frames: tuple[str, str]
    rigid: bool


@dataclass(frozen=True)
class Found:
    """A pinocchio model and the other parts of a `Robot`.

    `control_points` is None if they are to be proposed, `rest` for the neutral configuration.
    """

    model: Any
    end_effector: str
    capsules: tuple[Capsule, ...] = ()
    control_points: tuple[ControlPoint, ...] | None = None
    rest: Array | None = None
    missing: tuple[str, ...] = ()
    coupled: tuple[Coupled, ...] = ()
    loops: tuple[Loop, ...] = ()
    starts: Mapping[str, Array] = field(default_factory=dict)
    apart: tuple[tuple[str, str], ...] = ()
    table: Table | None = None


def is_floating(model: Any) -> bool:
    """Whether the first joint of a model is free in space."""
    return model.njoints > 1 and "freeflyer" in str(model.joints[1].shortname()).lower()


def remarks(model: Any) -> Iterator[str]:
    """Yield a sentence for limits and masses that joints lack, and for ambiguous frames."""
    joints = [joint for joint in model.joints[1 + is_floating(model):] if joint.nv > 0]
    for kind, limit in (("velocity", model.upperVelocityLimit), ("effort", model.effortLimit)):
        without = [str(model.names[joint.id]) for joint in joints
                   if not all(0.0 < value < _HUGE
                              for value in limit[joint.idx_v:joint.idx_v + joint.nv])]
        if without:
            yield f"{kind} limits of {some(without)}: none, or 0, which is no limit"
    data = model.createData()
    pin.computeSubtreeMasses(model, data)
    light = [str(model.names[joint.id]) for joint in joints if not (
        data.mass[joint.id] or model.armature[joint.idx_v:joint.idx_v + joint.nv].any())]
    if light and any(data.mass):
        yield f"masses beyond {some(light)}: none, so torques do not hold these joints"
    if names := ambiguous(model):
        yield (f"the frames called {some(names)}: each name is at two places, such as a joint and "
               "a link, so asking for it is an error")


def neutral_within_limits(model: Any, neutral: Array) -> Array:
    """Return `neutral` (nq,) with coordinates of one-coordinate joints moved `inside` limits."""
    q, ends = np.array(neutral), np.array([model.lowerPositionLimit, model.upperPositionLimit])
    for i in (joint.idx_q for joint in model.joints[1:] if joint.nq == joint.nv == 1):
        q[i] = inside(q[i], *ends[:, i])
    return q


def inside(value: float, lower: float, upper: float) -> float:
    """Return a value between limits: outside finite ones their middle, else the nearer limit."""
    if lower <= value <= upper:
        return value
    return (lower + upper) / 2 if np.isfinite([lower, upper]).all() else (
        min(max(value, lower), upper))


def room(joint: str, ends: Mapping[str, tuple[float, float]], coupled: tuple[Coupled, ...]
         ) -> tuple[float, float]:
    """Return the limits of a joint within which those that follow it linearly keep theirs.

    `ends` are limits by joint, if it has any. Where there is no such range, it is the joint's own.
    """
    own = low, high = ends.get(joint, (-np.inf, np.inf))
    for one in coupled:
        if one.other == joint and len(one.coefficients) == 2 and one.coefficients[1]:
            first, by = one.coefficients
            others = tuple(other for other in coupled if other is not one)
            side, far = sorted((end - first) / by for end in room(one.joint, ends, others))
            low, high = max(low, side), min(high, far)
    return (low, high) if low <= high else own


_SAME_PLACE = 1e-9
_KINDS = {"BODY": "link", "JOINT": "joint", "FIXED_JOINT": "fixed joint"}


def frames_called(model: Any, name: str) -> list[Any]:
    """Return the frames with a name that stand at different places, one for each place."""
    found: list[Any] = []
    for frame in model.frames:
        if frame.name == name and not any(
                one.parentJoint == frame.parentJoint
                and one.placement.isApprox(frame.placement, _SAME_PLACE) for one in found):
            found.append(frame)
    return found


def ambiguous(model: Any) -> list[str]:
    """Return the names that frames at different places share, such as a joint and a link."""
    counts = Counter(str(frame.name) for frame in model.frames)
    return [name for name, count in counts.items()
            if count > 1 and len(frames_called(model, name)) > 1]


def in_words(model: Any, frames: list[Any]) -> str:
    """Say what frames are and where: "a link on the body of joint 'wrist' and ..."."""
    return listed([f"a {_KINDS.get(frame.type.name, 'frame')} "
                   + (f"on the body of joint {model.names[frame.parentJoint]!r}"
                      if frame.parentJoint > 0 else "fixed to the world") for frame in frames])


_COUNT = 8  # number of proposed control points
_FIRST = 3  # they start at the origin of this joint of the chain, counted from 1
_NAMED_SO = re.compile(r"(^|[_\W])(tcp|tool\d*|eef?|end_?effector|gripper|flange)($|[_\W])",
                       re.IGNORECASE)


def proposed_end_effector(model: Any) -> str:
    """Return the last frame with a common name of a tool, or the last that most joints move.

    Common names are tcp, tool, ee, eef, end_effector, gripper and flange, between underscores;
    frames that no joint moves do not count, nor do the frames of joints and names at two places.
    """
    unclear = set(ambiguous(model))
    frames = [frame for frame in model.frames if frame.name not in unclear]
    joints = set(model.names)
    named = [frame.name for frame in frames if frame.parentJoint > 0
             and frame.name not in joints and _NAMED_SO.search(frame.name)]
    links = [name for name in named if not name.endswith("joint")]
    carried = [len(model.supports[frame.parentJoint]) for frame in frames]
    farthest = [frame.name for frame, count in zip(frames, carried, strict=True)
                if count == max(carried)]
    return str((links or named or farthest)[-1])


def points_along_chain(model: Any, end_effector: str) -> tuple[ControlPoint, ...]:
    """Return eight points spread evenly over the chain that carries the end effector.

    The chain is the line through the origins of its joints, from the third of those that carry it
    (a floating base does not count) to the end effector, which is omitted because sensors measure
    it anyway. A point between two origins is fixed to the joint before it.
    """
    frame = next(one for one in model.frames if one.name == end_effector)
    chain = [joint for joint in model.supports[frame.parentJoint].tolist()
             if joint > 0 and model.joints[joint].nv == 1]
    chain, data = chain[min(_FIRST, len(chain)) - 1:], model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    ends = [data.oMi[a].actInv(data.oMi[b]).translation for a, b in pairwise(chain)]
    ends.append(np.array(frame.placement.translation))
    lengths = np.array([np.linalg.norm(end) for end in ends])
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    if not chain or starts[-1] < 1e-3:
        return ()
    points = []
    for k in range(1, _COUNT + 1):
        at = k * starts[-1] / (_COUNT + 1)
        i = min(int(np.searchsorted(starts, at, side="right")) - 1, len(chain) - 1)
        offset = ends[i] * ((at - starts[i]) / lengths[i])
        place = (np.round(offset, 3) + 0.0).tolist()  # no -0.0
        points.append(ControlPoint(f"{model.names[chain[i]]} {place}", chain[i], offset))
    return tuple(points)
