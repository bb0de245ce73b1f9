"""Control points: points of the robot that are kept away from obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import expect_each
from hierarchy.problem import Array


@dataclass(frozen=True)
class ControlPoint:
    """A point fixed to the body that `joint` (an index) moves; offset (3,) [m] in its frame."""

    name: str
    joint: int
    offset: Array


def pack_points(points: Sequence[ControlPoint]) -> tuple[NDArray[np.int64], Array]:
    """Joint indices (K,) and offsets (K, 3) [m] of control points, for the kernels."""
    expect_each("control points", points, ControlPoint, "make one with robot.control_point(...)")
    joints = np.array([point.joint for point in points], dtype=np.int64)
    offsets = np.array([point.offset for point in points], dtype=float).reshape(-1, 3)
    return joints, offsets
