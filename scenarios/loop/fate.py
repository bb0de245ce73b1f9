"""What became of each level at the command that was sent: met, not acting, or given up."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell
from solvers.certificate import TOLERANCE


class Fate(IntEnum):
    """What became of a task in a tick."""

    ABSENT = 0   # not in the stack
    UNKNOWN = 1  # in the stack; its rows cannot be written again from the recording
    FREE = 2     # one-sided rows, none of them at a side: it holds nothing back
    MET = 3      # rows that act, and are met
    MISSED = 4   # given up, as far as its violation says


class Judged(NamedTuple):
    """Fate (L,) and violation (L,) of each level, and the `saturated` entries (n,) of x."""

    fate: list[Fate]
    violation: Array
    saturated: NDArray[np.int8]


def judged(cell: Cell, h: Hierarchy, x: Array, accuracy: float) -> Judged:
    """Judge a command x (n,) by the rows of its tick; `accuracy` is that of the resolver."""
    near, violation = tolerance(accuracy, x), h.violations(x)
    return Judged(fates(h, x, violation, near), violation, saturated(cell, h, x, near))


def fates(h: Hierarchy, x: Array, violations: Array, near: float) -> list[Fate]:
    """What became of each level at x (n,); a row this near to a side is on it."""
    found = []
    for violation, (A, lower, upper) in zip(violations, h.levels(), strict=True):
        at_a_side = np.minimum(A @ x - lower, upper - A @ x) <= near
        found.append(Fate.MISSED if violation > near else
                     Fate.MET if at_a_side.any() else Fate.FREE)
    return found


def saturated(cell: Cell, h: Hierarchy, x: Array, near: float) -> NDArray[np.int8]:
    """Side -1 or 1 of the cell's joint limits at which each entry of x (n,) is, else 0."""
    sides, limits = np.zeros(len(x), np.int8), cell.limits
    if limits is None:
        return sides
    lower, upper = (limits.box(cell.state, cell.stack.level) if limits.name not in h.names
                    else list(h.levels())[h.names.index(limits.name)][1:])
    joints = slice(len(x) - len(lower), None)  # a floating base has no limits
    sides[joints] = 1 * (x[joints] >= upper - near) - (x[joints] <= lower + near)
    return sides


def tolerance(accuracy: float, x: Array) -> float:
    """How far off a side a row may be to be on it, at an answer x (n,) of a resolver."""
    return max(TOLERANCE, accuracy) * (1.0 + float(np.linalg.norm(x)))
