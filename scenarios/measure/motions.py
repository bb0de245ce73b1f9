"""Which runs are the same motion, drawn once and named together, and where others diverge."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.measure.runs import Run
from scenarios.measure.safety import units_of
from scenarios.recording.recording import Recording

# [rad or m] of any joint, or what the resolver declares as its accuracy where that is more
BOUND = 1e-6
Labelled = tuple[str, Recording]
# [rad or m] of any joint at any time, within which two runs are the same motion: 0.01 mm at the end
# of an arm of 1 m, which no figure shows.
ALIKE = 1e-5


@dataclass(frozen=True)
class Motion:
    """Runs with the same motion, and the largest difference between their joints."""

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


def motions(runs: Sequence[Run], also: Callable[[Recording], Any] = lambda one: None
            ) -> list[Motion]:
    """Return the motions of the runs that have more than one tick, in the order of their first.

    Only runs of one scenario can be alike. `also` gives what they must have in common.
    """
    found: list[Motion] = []
    for run in runs:
        if run.recording is None or run.recording.ticks < 2:
            continue
        for i, motion in enumerate(found):
            apart = departure(run, motion.runs[0])
            if apart <= ALIKE and also(run.recording) == also(motion.recording):
                found[i] = Motion((*motion.runs, run), max(apart, motion.apart))
                break
        else:
            found.append(Motion((run,)))
    return found


def departure(run: Run, other: Run) -> float:
    """Return the largest difference of any joint; infinite for runs of two scenarios."""
    q, reference = (one.recording["q"] if one.recording else np.empty(0) for one in (run, other))
    if run.scenario.name != other.scenario.name or q.shape != reference.shape:
        return math.inf
    return float(np.nan_to_num(np.abs(q - reference), nan=np.inf).max(initial=0.0))


@dataclass(frozen=True)
class Parting:
    """How one strict resolver's run stands to that of the first strict one.

    tick : the first at which a joint is more than `bound` away, or None where none is.
    largest : over all ticks that both runs have, in the `unit` of the joints.
    why : what was different up to that tick, as half a sentence; "" where tick is None.
    """

    label: str
    other: str
    bound: float
    largest: float
    unit: str
    tick: int | None = None
    time: float = 0.0
    why: str = ""

    def __str__(self) -> str:
        if self.largest == 0.0:
            return f"{self.label} moves as {self.other} to the last bit"
        if self.tick is None:
            return (f"{self.label} stays within {self.largest:.1e} {self.unit} of {self.other} "
                    "to the end")
        return (f"{self.label} diverges from {self.other} by more than {self.bound:.0e} "
                f"{self.unit} at tick {self.tick} ({self.time:.2f} s), by {self.largest:.2g} "
                f"{self.unit} at most: {self.why}")


def partings(runs: Sequence[Run]) -> list[Parting]:
    """Return one for each strict resolver after the first, where they ran the same scenario.

    Only resolvers whose answer is the strict one at any rank ought to agree.
    """
    if len({run.scenario.name for run in runs}) != 1:
        return []
    strict = [(run.label, run.recording) for run in runs if run.recording and run.recording.ticks
              and run.recording.facts.resolver.strict]
    return [_parting(one, strict[0]) for one in strict[1:]]


def _parting(one: Labelled, other: Labelled) -> Parting:
    (label, mine), (first, theirs) = one, other
    ticks, accuracy = min(mine.ticks, theirs.ticks), mine.facts.resolver.accuracy
    bound = max(BOUND, accuracy)
    apart = abs(mine["q"][:ticks] - theirs["q"][:ticks]).max(axis=1)
    beyond = np.flatnonzero(~(apart <= bound))
    largest = float(np.nan_to_num(apart, nan=np.inf).max())
    if not beyond.size:
        return Parting(label, first, bound, largest, units_of(mine))
    tick = int(beyond[0])
    return Parting(label, first, bound, largest, units_of(mine), tick, float(mine["t"][tick]),
                   _why(one, other, tick, accuracy))


def _why(one: Labelled, other: Labelled, tick: int, accuracy: float) -> str:
    for label, recording in (one, other):
        failed = np.flatnonzero(recording["status"][:tick + 1] != 0)
        if failed.size:
            return f"tick {failed[0]} of {label} was not solved"
    mine, theirs = one[1].facts, other[1].facts
    if mine.limits_in_stack != theirs.limits_in_stack:
        return "the limits are in the stack of one, and a guard outside it for the other"
    if mine.asks == "bounds" and "bounds" in (mine.resolver.handles, theirs.resolver.handles):
        return ("while limits act, sns scales what it cannot meet"
                if "sns" in (mine.resolver.name, theirs.resolver.name) else
                "while limits act, they agree only without damping")
    stacks = [run.stacks()[:tick + 1] for _, run in (one, other)]
    switched = np.flatnonzero(stacks[0] != stacks[1])
    if switched.size:
        return (f"the stack is another one at tick {switched[0]}, where a switch came earlier or "
                "later for errors below that bound")
    return (f"no tick failed and the stacks are the same; the motion magnifies the errors of each "
            f"tick (declared: {accuracy:.0e})")
