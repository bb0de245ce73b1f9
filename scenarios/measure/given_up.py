"""Which levels a run gave up, for how long, and what held them back."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.cell.build import build
from scenarios.measure.judging import Rows
from scenarios.recording.fate import Fate
from scenarios.recording.recording import Recording
from solvers.explain import held_back_by, most_missed
from solvers.resolvers.hcod import Hcod

_LOOKED_AT = 20   # ticks of a level, spread over those in which it was missed
_LEAST = 0.01     # share of a level's ticks: what is given up for less is not said
_OFTEN = 0.25     # share of the ticks looked at: what holds back less often is not said


@dataclass(frozen=True)
class GivenUp:
    """A level that was missed: the share of its ticks, seconds, its rows, and what held it back.

    Rows are inequalities. They and what held the level back have shares of the ticks looked at.
    """

    level: str
    share: float
    seconds: float
    held_by: tuple[tuple[str, float], ...]
    rows: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        held, at = (", ".join(f"{name} ({100.0 * share:.0f} %)" for name, share in named)
                    for named in (self.held_by, self.rows))
        return (f"row missed: {self.level} in {100.0 * self.share:.0f} % of its ticks "
                f"({self.seconds:.3g} s)" + (f", at {at}" if at else "")
                + (f"; held back by {held}" if held else ""))


def given_up(recording: Recording) -> tuple[GivenUp, ...]:
    """Return the levels that a run missed in 1 % of their ticks or more, most important first.

    What held a level back is that of the exact resolver, at up to 20 of the ticks in which the
    level was missed. It is left out where the rows of a tick do not follow from the recording: with
    an image sensor, in a smooth stack, or where settings were changed by hand.
    """
    if "level_fate" not in recording or not recording.ticks:
        return ()
    fate = recording["level_fate"]
    found = []
    for column, name in enumerate(recording.task_names):
        known, missed = fate[:, column] > Fate.UNKNOWN, fate[:, column] == Fate.MISSED
        if missed.sum() >= max(1.0, _LEAST * known.sum()):
            found.append((name, float(missed.sum() / known.sum()), np.flatnonzero(missed)))
    period = recording.scenario.control.period
    blocked = _blocked(recording, {name: ticks for name, _, ticks in found})
    return tuple(GivenUp(name, share, len(ticks) * period, *blocked.get(name, ((), ())))
                 for name, share, ticks in found)


Shares = tuple[tuple[str, float], ...]


def _blocked(recording: Recording, missed: dict[str, NDArray[np.int64]]
             ) -> dict[str, tuple[Shares, Shares]]:
    """Return what held each level back, and which of its inequalities were missed."""
    scenario = recording.scenario
    if not missed or scenario.sensor.kind != "exact" or scenario.control.stack == "smooth":
        return {}
    cell = build(scenario)
    rows, exact = Rows(recording, cell), Hcod()
    found = {}
    for name, ticks in missed.items():
        held, at, looked = Counter[str](), Counter[str](), 0
        for tick in ticks[np.unique(np.linspace(0, len(ticks) - 1, _LOOKED_AT).astype(int))]:
            h = rows.hierarchy(int(tick))
            if h is not None and name in h.names:
                names = cell.stack.row_names(h.names)
                level, solved = h.names.index(name), exact.solve(h)
                held.update(held_back_by(h, solved, level, names))
                at.update(most_missed(h, solved.x, level, names))
                looked += 1
        blocked, rows_at = (tuple(
            (what, times / looked) for what, times in count.most_common(4)
            if times >= _OFTEN * looked) for count in (held, at))
        found[name] = blocked, rows_at
    return found
