"""What a reader of a file or a table finds about a robot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hierarchy.avoidance.control_points import ControlPoint
from hierarchy.avoidance.self_collision import Capsule
from hierarchy.problem import Array
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

    def __str__(self) -> str:
        powers = ["", f" {self.other}", *(f" {self.other}^{i}" for i in range(2, 5))]
        terms = [f"{value:g}{power}" for value, power
                 in zip(self.coefficients[::-1], powers[len(self.coefficients) - 1::-1],
                        strict=True) if value != 0.0]
        return f"{self.joint} = {' + '.join(terms) or '0'} in the file".replace("+ -", "- ")


@dataclass(frozen=True)
class Loop:
    """A chain that the file closes: two frames have one origin, and the same axes if `rigid`."""

    name: str
    frames: tuple[str, str]
    rigid: bool


@dataclass(frozen=True)
class Found:
    """A pinocchio model, its shapes, and what is missing.

    `end_effector` is a frame's name; `rest` (nq,) the default initial configuration, or None;
    `missing` are sentences. `control_points` is None if they are to be proposed. `coupled` joints
    follow others, `loops` are closed chains; `starts` are configurations (nq,) that the file names,
    and `apart` pairs of bodies, by the joints that move them, whose distance it does not watch.
    `table` is the table that the model was made from, or None.
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
    """Yield a sentence for each kind of limit that joints lack, and for ambiguous frames."""
    joints = [joint for joint in model.joints[1 + is_floating(model):] if joint.nv > 0]
    for kind, limit in (("velocity", model.upperVelocityLimit), ("effort", model.effortLimit)):
        without = [str(model.names[joint.id]) for joint in joints
                   if not all(0.0 < value < _HUGE
                              for value in limit[joint.idx_v:joint.idx_v + joint.nv])]
        if without:
            yield f"{kind} limits of {some(without)}: none, or 0, which is no limit"
    if names := ambiguous(model):
        yield (f"the frames called {some(names)}: each name is at two places, such as a joint and "
               "a link, so asking for it is an error")


def neutral_within_limits(model: Any, neutral: Array) -> Array:
    """Return `neutral` (nq,) with each coordinate of one-coordinate joints moved inside its limits.

    A coordinate outside finite limits goes to their middle, else to the nearer limit.
    """
    q = np.array(neutral)
    for joint in model.joints[1:]:
        if joint.nq == joint.nv == 1:
            i = joint.idx_q
            lower, upper = model.lowerPositionLimit[i], model.upperPositionLimit[i]
            if not lower <= q[i] <= upper:
                q[i] = (lower + upper) / 2 if np.isfinite([lower, upper]).all() else (
                    min(max(q[i], lower), upper))
    return q


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
