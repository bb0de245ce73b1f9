"""Which runs are the same motion: those are drawn once, and named together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from scenarios.measure.runs import Run
    from scenarios.recording.recording import Recording

# [rad] of any joint at any time, within which two runs are the same motion: 0.01 mm at the end of
# an arm of 1 m, which no figure shows.
ALIKE = 1e-5


@dataclass(frozen=True)
class Motion:
    """Runs with the same motion, and the largest difference between their joints [rad]."""

    runs: tuple[Run, ...]
    apart: float = 0.0

    @property
    def label(self) -> str:
        """The label of the first run, which stands for all."""
        return self.runs[0].label

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of all runs."""
        return tuple(run.label for run in self.runs)

    @property
    def recording(self) -> Recording:
        """The first run's recording."""
        assert self.runs[0].recording is not None
        return self.runs[0].recording


def motions(runs: Sequence[Run], alike: float = ALIKE,
            also: Callable[[Run], Any] = lambda run: None) -> list[Motion]:
    """Return the motions of the runs that have more than one tick, in the order of their first.

    Only runs of one scenario can be alike. `also` gives what they must have in common besides.
    """
    found: list[Motion] = []
    for run in runs:
        if run.recording is None or run.recording.ticks < 2:
            continue
        for i, motion in enumerate(found):
            apart = departure(run, motion.runs[0])
            if apart <= alike and also(run) == also(motion.runs[0]):
                found[i] = Motion((*motion.runs, run), max(apart, motion.apart))
                break
        else:
            found.append(Motion((run,)))
    return found


def departure(run: Run, other: Run) -> float:
    """Return the largest difference of any joint between two runs [rad].

    Infinite if it is not known, or the runs are of two scenarios.
    """
    if run.recording is None or other.recording is None or run.scenario.name != other.scenario.name:
        return math.inf
    q, reference = run.recording["q"], other.recording["q"]
    if q.shape != reference.shape:
        return math.inf
    largest = float(np.abs(q - reference).max(initial=0.0))
    return math.inf if math.isnan(largest) else largest
