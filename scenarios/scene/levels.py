"""What became of each level of the stack in some ticks of a run, judged once more after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance import Measurement
from hierarchy.problem import Array, Hierarchy
from scenarios.build import Cell, build
from scenarios.config import PlantSection
from solvers.certificate import TOLERANCE

if TYPE_CHECKING:
    from scenarios.recording import Recording

_SAME = 1e-9  # [m] of distances that are those recorded


class Fate(IntEnum):
    """What became of a task in a tick."""

    ABSENT = 0   # not in the stack
    UNKNOWN = 1  # in the stack; its rows cannot be written again from the recording
    FREE = 2     # one-sided rows, none of them at a side: it holds nothing back
    MET = 3      # rows that act, and are met
    MISSED = 4   # given up, as far as its violation says


@dataclass(frozen=True)
class Levels:
    """Of F ticks: what became of N tasks and of n joints.

    names (N,) of all tasks that were in the stack in any tick of the run; fate (F, N) values of
    `Fate`; violation (F, N) Euclidean norm of a level's violation by the command that was sent, in
    the unit of its rows, NaN where absent or unknown; saturated (F, n) -1 or 1 where a joint is at
    the lower or upper side of its limits' box of commands, else 0.
    """

    names: tuple[str, ...]
    fate: NDArray[np.int8]
    violation: Array
    saturated: NDArray[np.int8]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether the rows of a tick could be written again: (F,)."""
        return np.asarray(~(self.fate == Fate.UNKNOWN).any(axis=1))


def order_names(recording: Recording) -> tuple[tuple[str, ...], ...]:
    """Return the tasks of each of the recording's orders, most important first."""
    return tuple(tuple(name for name in order.split(" > ") if name) for order in recording.orders)


def judge(recording: Recording, ticks: Sequence[int] | NDArray[np.int64]) -> Levels:
    """Write the rows of some ticks again, and judge by them the command that was sent.

    The rows follow from the recorded joints, if the distances do. Where these were seen by a
    camera, or are not those recorded, or settings had been changed, levels are UNKNOWN.
    """
    orders = order_names(recording)
    names = tuple(dict.fromkeys(name for order in orders for name in order))
    shape = len(ticks), len(names)
    levels = Levels(names, np.zeros(shape, np.int8), np.full(shape, np.nan),
                    np.zeros((len(ticks), recording["v"].shape[1]), np.int8))
    rows = _Rows(recording) if recording.scenario.sensor.kind == "exact" else None
    accuracy = recording.scenario.make_resolver().accuracy
    changed = recording.signals.get("changed", np.zeros(recording.ticks, bool))
    for f, k in enumerate(int(tick) for tick in ticks):
        order = orders[recording["order"][k]]
        columns = [names.index(name) for name in order]
        levels.fate[f, columns] = Fate.UNKNOWN
        h = rows.hierarchy(k, order) if rows and order and not changed[k] else None
        if rows and h:
            x = recording["command"][k]
            near = tolerance(accuracy, x)
            levels.violation[f, columns] = h.violations(x)
            levels.fate[f, columns] = fates(h, x, near)
            levels.saturated[f] = saturated(rows.cell, h, x, near)
    return levels


def fates(h: Hierarchy, x: Array, near: float) -> list[Fate]:
    """What became of each level at x (n,); a row this near to a side is on it."""
    found = []
    for violation, (A, lower, upper) in zip(h.violations(x), h.levels(), strict=True):
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


class _Rows:
    """Moves a new cell through the recorded ticks, without its plant."""

    def __init__(self, recording: Recording) -> None:
        scenario = recording.scenario
        self._recording, self._level = recording, scenario.control.level
        self.cell: Cell = build(scenario.model_copy(update={"plant": PlantSection()}))

    def hierarchy(self, k: int, order: tuple[str, ...]) -> Hierarchy | None:
        """The rows of tick k, valid until the next; None if they are not those of the run."""
        recording, cell = self._recording, self.cell
        t, q, v = (recording[name] for name in ("t", "q", "v"))
        if cell.state.period > 0.0:  # differences are against the tick before
            cell.state.move(t[max(k - 1, 0)], q[max(k - 1, 0)], v[max(k - 1, 0)])
        if not cell.state.move(t[k], q[k], v[k]):
            return None
        if self._level == "velocity":
            cell.state.commanded = recording["command"][k - 1] if k else v[0]
        cone = cell.pointing.cone_error(cell.state) if cell.pointing else float("nan")
        seen = cell.sensor.measure(cell.state) if cell.sensor else None
        if not self._is_as_recorded(k, seen) or cell.order(seen, cone).order != order:
            return None
        return cell.stack.hierarchy(cell.state, order)

    def _is_as_recorded(self, k: int, seen: Measurement | None) -> bool:
        if seen is None:
            return True
        known = [*self._recording["control_point_distance"][k], self._recording["ee_distance"][k]]
        return bool(np.allclose(seen.distance, known, rtol=0.0, atol=_SAME))
