"""A robot's links as capsules, and their positions in the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hierarchy import Robot, State
from hierarchy.avoidance import Capsule
from hierarchy.problem import Array

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
