"""Whether each level of the stack was met, in some ticks of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.recording.fate import Fate, row_units
from scenarios.recording.recording import Recording


@dataclass(frozen=True)
class Levels:
    """Fates of N tasks and saturation of n joints in F ticks.

    names (N,) of all tasks that are in the stack in any tick of the run, units (N,) of their rows,
    "" where not known; fate (F, N) values of
    `Fate`; violation (F, N) Euclidean norm of a level's violation by the command that was sent, in
    the unit of its rows, NaN where absent or unknown; saturated (F, n) -1 or 1 where a joint is at
    the lower or upper side of its limits' box of commands, else 0.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    fate: NDArray[np.int8]
    violation: Array
    saturated: NDArray[np.int8]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether every fate in a tick is known: (F,)."""
        return np.asarray(~(self.fate == Fate.UNKNOWN).any(axis=1))


def levels_at(recording: Recording, ticks: Sequence[int] | NDArray[np.int64]) -> Levels:
    """Return the recorded fates of the levels in some ticks; UNKNOWN if none were recorded."""
    ticks, names = np.asarray(ticks, dtype=np.int64), recording.task_names
    units = row_units(recording.scenario, names)
    if "level_fate" in recording:
        return Levels(names, units, *(recording[name][ticks] for name in (
            "level_fate", "level_violation", "saturated")))
    shape = len(ticks), len(names)
    return Levels(names, units,
                  np.int8(Fate.UNKNOWN) * recording.in_stack[ticks], np.full(shape, np.nan),
                  np.zeros((len(ticks), recording["v"].shape[1]), np.int8))
