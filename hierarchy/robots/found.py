"""What a reader of a file or a table finds about a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.avoidance.control_points import ControlPoint
from hierarchy.avoidance.self_collision import Capsule
from hierarchy.problem import Array


@dataclass(frozen=True)
class Coupled:
    """A joint that the file couples to another one: q = factor q_other + offset [rad or m]."""

    joint: str
    other: str
    factor: float
    offset: float

    def __str__(self) -> str:
        rest = f" {'-' if self.offset < 0 else '+'} {abs(self.offset):g}" if self.offset else ""
        return f"{self.joint} = {self.factor:g} {self.other}{rest} in the file"


@dataclass(frozen=True)
class Found:
    """A pinocchio model, its shapes, and what is missing.

    `end_effector` is a frame's name; `rest` (nq,) the default initial configuration, or None;
    `missing` are sentences. `control_points` is None if they are to be proposed. `coupled` joints
    move on their own here.
    """

    model: Any
    end_effector: str
    capsules: tuple[Capsule, ...] = ()
    control_points: tuple[ControlPoint, ...] | None = None
    rest: Array | None = None
    missing: tuple[str, ...] = ()
    coupled: tuple[Coupled, ...] = ()


def is_floating(model: Any) -> bool:
    """Whether the first joint of a model is free in space."""
    return model.njoints > 1 and "freeflyer" in str(model.joints[1].shortname()).lower()


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


