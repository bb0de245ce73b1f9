"""What is known of a robot before it is one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.avoidance.control_points import ControlPoint
from hierarchy.avoidance.self_collision import Capsule
from hierarchy.problem import Array


@dataclass(frozen=True)
class Found:
    """A pinocchio model, its shape, and what could not be found.

    `end_effector` is a frame's name; `rest` (nq,) the configuration in which it starts, or None;
    `missing` are sentences. `control_points` is None where they are to be proposed.
    """

    model: Any
    end_effector: str
    capsules: tuple[Capsule, ...] = ()
    control_points: tuple[ControlPoint, ...] | None = None
    rest: Array | None = None
    missing: tuple[str, ...] = ()


def is_floating(model: Any) -> bool:
    """Whether the first joint of a model is free in space."""
    return model.njoints > 1 and "freeflyer" in str(model.joints[1].shortname()).lower()


def neutral_within_limits(model: Any, neutral: Array) -> Array:
    """Return `neutral` (nq,) with each single coordinate that is beyond its limits put midway."""
    q = np.array(neutral)
    for joint in model.joints[1:]:
        if joint.nq == joint.nv == 1:
            i = joint.idx_q
            lower, upper = model.lowerPositionLimit[i], model.upperPositionLimit[i]
            if not lower <= q[i] <= upper:
                q[i] = (lower + upper) / 2 if np.isfinite([lower, upper]).all() else (
                    min(max(q[i], lower), upper))
    return q


