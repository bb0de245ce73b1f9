"""The fate of each level under the command that was sent: met, inactive or missed."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import sqrt
from typing import TYPE_CHECKING, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell
from solvers.certificate import TOLERANCE

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.recording.recording import Recording


class Fate(IntEnum):
    """The fate of a task in one tick."""

    ABSENT = 0   # not in the stack
    UNKNOWN = 1  # in the stack; its rows are not known after the run
    FREE = 2     # one-sided rows, none of them at a side: it does not act
    MET = 3      # rows that act, and are met
    MISSED = 4   # by the norm of its violation


PHRASES = {Fate.MET: "row met", Fate.FREE: "row inactive", Fate.MISSED: "row missed",
           Fate.UNKNOWN: "in the stack, not judged", Fate.ABSENT: "not in the stack"}
_UNITS = {"position": "m", "avoidance": "m", "separation": "m", "joint limits": "rad",
          "posture": "rad"}  # of the errors of tasks that no section lists


def phrase(fate: Fate, violation: float, unit: str = "") -> str:
    """Return a fate in words, with the violation where the level is missed."""
    by = f" by {violation:.2g} {unit}".rstrip()
    return PHRASES[fate] + (by if fate is Fate.MISSED else "")


def row_units(scenario: Scenario, names: Sequence[str]) -> tuple[str, ...]:
    """Return the unit of the rows of each task, "" where they differ or it is not known."""
    sections = {task.title: task for task in scenario.tasks}
    rate = "/s" if scenario.control.level == "velocity" else "/s²"

    def unit(name: str) -> str:
        section = sections.get(name)
        if section is None:
            return _UNITS[name] + rate if name in _UNITS else ""
        if section.of_forces:
            return section.unit
        if section.unit.endswith(" s"):  # a momentum, whose rate is a force
            return section.unit.removesuffix(" s")
        mixed = hasattr(section, "rotation") or not section.unit
        return "" if mixed else section.unit + rate

    return tuple(unit(name) for name in names)


class Judged(NamedTuple):
    """Fate (L,) and violation (L,) of each level, and the saturated entries (n,) of x."""

    fate: NDArray[np.int8]
    violation: Array
    saturated: NDArray[np.int8]


def judged(cell: Cell, h: Hierarchy, x: Array, accuracy: float) -> Judged:
    """Judge a command x (n,) by the rows of its tick; `accuracy` is the resolver's."""
    near, levels = tolerance(accuracy, x), len(h.sizes)
    n = cell.robot.n
    found = Judged(np.zeros(levels, np.int8), np.zeros(levels), np.zeros(n, np.int8))
    lower = h.lower if cell.activation is None else cell.activation.demanded(h)
    _judge_levels(h.A, lower, h.upper, h.offsets, x, near, found.fate, found.violation)
    if (limits := cell.limits) is not None:
        lower, upper = (limits.box(cell.state, "velocity" if cell.stack.level == "velocity"
                                   else "acceleration") if limits.name not in h.names
                        else _sides(h, limits.name))
        _find_saturated(x[:n], lower, upper, near, found.saturated)
    return found


def tolerance(accuracy: float, x: Array) -> float:
    """Distance from a side within which a row counts as on it, at an answer x (n,)."""
    return max(TOLERANCE, accuracy) * (1.0 + sqrt(float(x @ x)))


@final
class Fates:
    """Collects the fates of the tasks called `names` tick by tick."""

    def __init__(self, names: tuple[str, ...], ticks: int, joints: int) -> None:
        self._names = names
        self._fate = np.zeros((ticks, len(names)), np.int8)
        self._violation = np.full((ticks, len(names)), np.nan)
        self._saturated = np.zeros((ticks, joints), np.int8)
        self._columns: dict[tuple[str, ...], NDArray[np.int64]] = {}

    def judge(self, tick: int, cell: Cell, h: Hierarchy, x: Array, accuracy: float) -> None:
        """Judge the command x (n,) of a tick; see `judged`."""
        columns = self._columns.get(h.names)
        if columns is None:
            columns = np.array([self._names.index(name) for name in h.names], dtype=np.int64)
            self._columns[h.names] = columns
        found = judged(cell, h, x, accuracy)
        self._fate[tick, columns], self._violation[tick, columns] = found.fate, found.violation
        self._saturated[tick] = found.saturated

    def signals(self, recording: Recording) -> dict[str, NDArray[np.int8] | Array]:
        """Return the signals of a Recording; levels that were not judged are UNKNOWN."""
        columns = [self._names.index(name) for name in recording.task_names]
        fate, rows = self._fate[:recording.ticks, columns], slice(recording.ticks)
        return {"level_fate": np.maximum(fate, unknown(recording)),
                "level_violation": self._violation[rows, columns],
                "saturated": self._saturated[rows]}


def unknown(recording: Recording) -> NDArray[np.int8]:
    """Return UNKNOWN for each task of each tick's stack, ABSENT for others: (T, N)."""
    orders, names = recording.order_names, recording.task_names
    table = np.array([[name in order for name in names] for order in orders],
                     dtype=np.int8).reshape(len(orders), len(names))
    return np.asarray(Fate.UNKNOWN * table[recording["order"]], dtype=np.int8)


def _sides(h: Hierarchy, name: str) -> tuple[Array, Array]:
    level = h.names.index(name)
    rows = slice(h.offsets[level], h.offsets[level + 1])
    return h.lower[rows], h.upper[rows]


@compiled
def _judge_levels(A, lower, upper, offsets, x, near, fate, violation):
    """Write fate and violation of each level; a row within `near` of a side is on it."""
    for k in range(len(fate)):
        squared, acts = 0.0, False
        for i in range(offsets[k], offsets[k + 1]):
            value = 0.0
            for j in range(len(x)):
                value += A[i, j] * x[j]
            room = min(value - lower[i], upper[i] - value)
            acts |= room <= near
            if room < 0.0:
                squared += room * room
        violation[k] = sqrt(squared)
        fate[k] = 4 if violation[k] > near else 3 if acts else 2  # MISSED, MET, FREE


@compiled
def _find_saturated(x, lower, upper, near, saturated):
    """Write the side, -1 or 1, of its box at which each entry of x is; a floating base has none."""
    base = len(x) - len(lower)
    for i in range(len(lower)):
        saturated[base + i] = int(x[base + i] >= upper[i] - near) - int(
            x[base + i] <= lower[i] + near)
