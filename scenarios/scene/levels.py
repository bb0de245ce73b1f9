"""What became of each level of the stack in some ticks of a run, judged once more after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hierarchy.avoidance import Measurement
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell, build
from scenarios.config import Scenario
from scenarios.config.plant import PlantSection
from scenarios.loop.fate import Fate, judged

if TYPE_CHECKING:
    from scenarios.loop.recording import Recording

_SAME = 1e-9  # [m] of distances that are those recorded


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

    The rows follow from the recorded joints, if the distances do; where these were seen by a
    camera, `simulate` has judged every tick. Where distances are not those recorded, or settings
    had been changed, levels are UNKNOWN.
    """
    orders = order_names(recording)
    names = tuple(dict.fromkeys(name for order in orders for name in order))
    shape = len(ticks), len(names)
    levels = Levels(names, np.zeros(shape, np.int8), np.full(shape, np.nan),
                    np.zeros((len(ticks), recording["v"].shape[1]), np.int8))
    if "level_fate" in recording:
        return _as_judged(recording, levels, ticks)
    rows = _Rows(recording) if recording.scenario.sensor.kind == "exact" else None
    accuracy = recording.scenario.make_resolver().accuracy
    changed = recording.signals.get("changed", np.zeros(recording.ticks, bool))
    for f, k in enumerate(int(tick) for tick in ticks):
        order = orders[recording["order"][k]]
        columns = [names.index(name) for name in order]
        levels.fate[f, columns] = Fate.UNKNOWN
        h = rows.hierarchy(k, order) if rows and order and not changed[k] else None
        if rows and h:
            found = judged(rows.cell, h, recording["command"][k], accuracy)
            levels.fate[f, columns], levels.violation[f, columns] = found.fate, found.violation
            levels.saturated[f] = found.saturated
    return levels


def _as_judged(recording: Recording, levels: Levels, ticks: Sequence[int] | NDArray[np.int64]
               ) -> Levels:
    """Fill in what was judged while the run was made."""
    judged_names = _without_plant(recording.scenario).stack.names
    columns = [judged_names.index(name) for name in levels.names]
    levels.fate[:] = recording["level_fate"][ticks][:, columns]
    levels.violation[:] = recording["level_violation"][ticks][:, columns]
    levels.saturated[:] = recording["saturated"][ticks]
    orders = order_names(recording)
    for f, k in enumerate(ticks):  # ticks without an answer were not judged
        unknown = [levels.names.index(name) for name in orders[recording["order"][k]]]
        levels.fate[f, unknown] = np.maximum(levels.fate[f, unknown], Fate.UNKNOWN)
    return levels


def _without_plant(scenario: Scenario) -> Cell:
    return build(scenario.model_copy(update={"plant": PlantSection()}))


class _Rows:
    """Moves a new cell through the recorded ticks, without its plant."""

    def __init__(self, recording: Recording) -> None:
        scenario = recording.scenario
        self._recording, self._level = recording, scenario.control.level
        self.cell = _without_plant(scenario)

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
