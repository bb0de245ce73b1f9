"""Which runs are the same motion, drawn once and named together, and where others diverge."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hierarchy.problem import Array
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
    found: list[tuple[Any, Motion]] = []  # each with what its runs have in common
    for run in runs:
        if run.recording is None or run.recording.ticks < 2:
            continue
        q = run.recording["q"]
        kind = run.scenario.name, q.shape, also(run.recording)
        for i, (other, motion) in enumerate(found):
            if kind == other and (away := float(apart(q, motion.recording["q"]).max())) <= ALIKE:
                found[i] = kind, Motion((*motion.runs, run), max(away, motion.apart))
                break
        else:
            found.append((kind, Motion((run,))))
    return [motion for _, motion in found]


def apart(q: Array, other: Array) -> Array:
    """Return the largest difference of any joint in each of the ticks that both runs have, (T,)."""
    ticks = min(len(q), len(other))
    away = np.abs(q[:ticks] - other[:ticks]).max(axis=-1, initial=0.0)
    return np.asarray(np.nan_to_num(away, nan=np.inf))


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
    accuracy, away = mine.facts.resolver.accuracy, apart(mine["q"], theirs["q"])
    bound = max(BOUND, accuracy)
    found = Parting(label, first, bound, float(away.max()), units_of(mine))
    if not found.largest > bound:
        return found
    tick = int((away > bound).argmax())
    return replace(found, tick=tick, time=float(mine["t"][tick]),
                   why=_why(one, other, tick, accuracy))


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
