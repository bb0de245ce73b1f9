"""Which levels a run gave up, for how long, and what held them back."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.cell.build import build
from scenarios.loop.fate import Fate
from scenarios.loop.judging import Rows
from scenarios.loop.recording import Recording
from solvers.explain import held_back_by
from solvers.resolvers.hcod import Hcod

_LOOKED_AT = 20   # ticks of a level, spread over those in which it was missed
_LEAST = 0.01     # share of a level's ticks: what is given up for less is not said
_OFTEN = 0.25     # share of the ticks looked at: what holds back less often is not said


@dataclass(frozen=True)
class GivenUp:
    """A level that was missed: the share of its ticks, seconds, and what held it back, by share."""

    level: str
    share: float
    seconds: float
    held_by: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        held = ", ".join(f"{name} ({100.0 * share:.0f} %)" for name, share in self.held_by)
        return (f"{self.level} was missed in {100.0 * self.share:.0f} % of its ticks "
                f"({self.seconds:.3g} s)" + (f"; held back by {held}" if held else ""))


def given_up(recording: Recording) -> tuple[GivenUp, ...]:
    """Return the levels that a run missed in 1 % of their ticks or more, most important first.

    What held a level back is that of the exact resolver, at up to 20 of the ticks in which the
    level was missed. It is left out where the rows of a tick do not follow from the recording: with
    an image sensor, in a smooth stack, or where settings were changed by hand.
    """
    fate = recording.signals.get("level_fate")
    if fate is None or not recording.ticks:
        return ()
    found = []
    for column, name in enumerate(recording.task_names):
        known, missed = fate[:, column] > Fate.UNKNOWN, fate[:, column] == Fate.MISSED
        if missed.sum() >= max(1.0, _LEAST * known.sum()):
            found.append((name, float(missed.sum() / known.sum()), np.flatnonzero(missed)))
    period = recording.scenario.control.period
    blocked = _blocked(recording, {name: ticks for name, _, ticks in found})
    return tuple(GivenUp(name, share, len(ticks) * period, blocked.get(name, ()))
                 for name, share, ticks in found)


def _blocked(recording: Recording, missed: dict[str, NDArray[np.int64]]
             ) -> dict[str, tuple[tuple[str, float], ...]]:
    scenario = recording.scenario
    if not missed or scenario.sensor.kind != "exact" or scenario.control.stack == "smooth":
        return {}
    cell = build(scenario)
    rows, exact, orders = Rows(recording, cell), Hcod(), recording.order_names
    found = {}
    for name, ticks in missed.items():
        count, looked = Counter[str](), 0
        for tick in ticks[np.unique(np.linspace(0, len(ticks) - 1, _LOOKED_AT).astype(int))]:
            h = rows.hierarchy(int(tick), orders[recording["order"][tick]])
            if h is not None and name in h.names:
                names = cell.stack.row_names(h.names)
                count.update(held_back_by(h, exact.solve(h), h.names.index(name), names))
                looked += 1
        found[name] = tuple((what, times / looked) for what, times in count.most_common(4)
                            if times >= _OFTEN * looked)
    return found
