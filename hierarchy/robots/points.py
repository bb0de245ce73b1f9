"""Proposals where a file does not say: end effector and control points."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import numpy as np

from hierarchy.avoidance.control_points import ControlPoint
from hierarchy.problem import Array
from hierarchy.robots.found import ambiguous

COUNT = 8            # number of proposed control points
FIRST_MOVED_BY = 3   # they start at the origin of this joint of the chain, counted from 1
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


def points_along_chain(model: Any, end_effector: str, count: int = COUNT,
                       first: int = FIRST_MOVED_BY) -> tuple[ControlPoint, ...]:
    """Return points spread evenly over the chain that carries the end effector.

    The chain is the line through the origins of its joints, from joint number `first` of those that
    carry it (a floating base does not count) to the end effector, which is omitted because sensors
    measure it anyway. A point between two origins is fixed to the joint before it.
    """
    frame = next(one for one in model.frames if one.name == end_effector)
    chain = [joint for joint in model.supports[frame.parentJoint].tolist()
             if joint > 0 and model.joints[joint].nv == 1]
    chain = chain[min(first, len(chain)) - 1:]
    ends = [np.array(_between(model, a, b)) for a, b in pairwise(chain)]
    ends.append(np.array(frame.placement.translation))
    lengths = np.array([np.linalg.norm(end) for end in ends])
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    if not chain or starts[-1] < 1e-3:
        return ()
    points = []
    for k in range(1, count + 1):
        at = k * starts[-1] / (count + 1)
        i = min(int(np.searchsorted(starts, at, side="right")) - 1, len(chain) - 1)
        offset = ends[i] * ((at - starts[i]) / lengths[i])
        points.append(ControlPoint(f"{model.names[chain[i]]} {np.round(offset, 3).tolist()}",
                                   chain[i], offset))
    return tuple(points)


def _between(model: Any, joint: int, below: int) -> Array:
    """Origin of joint `below` in the frame of `joint`, with the joints between them at zero."""
    placement = model.jointPlacements[below]
    parent = model.parents[below]
    while parent != joint:
        placement = model.jointPlacements[parent] * placement
        parent = model.parents[parent]
    return np.asarray(placement.translation)
