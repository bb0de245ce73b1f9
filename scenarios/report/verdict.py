"""What a comparison comes to, in one sentence made from its numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scenarios.compare import Run

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def verdict(runs: Sequence[Run], alike: float = 1e-6, nearly: float = 1e-2) -> str:
    """Return the sentence about runs side by side; only what was measured enters it.

    Runs whose joints stay within `alike` [rad] of the first run's count as the same motion, and
    those within `nearly` are said to be near it.
    """
    finished = [run for run in runs if run.fault is None]
    parts = [_completion(runs, finished)]
    if len({run.scenario.name for run in runs}) > 1:
        parts += [_collision(finished), *_contrasts(finished)]
    elif finished:
        same, others, apart = _groups(finished, alike)
        near, others, near_apart = _groups(others, nearly, finished[0])
        parts += [_agreement(same, near, others, apart),
                  _nearness(near, finished[0], near_apart), _collision(finished)]
        parts += [] if others and len(same) > 1 else [_distance(finished), _tracking(finished)]
        parts += [_speed(finished)]
    return "; ".join(part for part in parts if part) + "."


def in_words(count: int) -> str:
    """Return a small number as a word."""
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _completion(runs: Sequence[Run], finished: Sequence[Run]) -> str:
    durations = {f"{run.scenario.control.duration:.4g} s" for run in runs}
    seconds = durations.pop() if len(durations) == 1 else "duration"
    noun = "ways" if len({run.scenario.name for run in runs}) == 1 else "scenarios"
    if len(finished) == len(runs) == 1:
        return f"{runs[0].label} ran the whole {seconds}"
    if len(finished) == len(runs):
        every = "Both" if len(runs) == 2 else f"All {in_words(len(runs))}"
        return f"{every} {noun} ran the whole {seconds}"
    stopped = ", ".join(run.label for run in runs if run.fault)
    some = f"{in_words(len(finished)).capitalize()} of {in_words(len(runs))} {noun}"
    return f"{some if finished else f'No {noun[:-1]}'} ran the whole {seconds} ({stopped} did not)"


def _groups(runs: Sequence[Run], alike: float, first: Run | None = None
            ) -> tuple[list[Run], list[Run], float]:
    """Return the runs that move as the first one does, the others, and how far the first differ."""
    apart = {run.label: departure(run, first or runs[0]) for run in runs}
    same = [run for run in runs if apart[run.label] <= alike]
    others = [run for run in runs if apart[run.label] > alike]
    return same, others, max((apart[run.label] for run in same), default=0.0)


def departure(run: Run, other: Run) -> float:
    """Return the largest difference of any joint between two runs [rad]; infinite if unknown."""
    if run.recording is None or other.recording is None:
        return math.inf
    q, reference = run.recording["q"], other.recording["q"]
    if q.shape != reference.shape:
        return math.inf
    largest = float(np.abs(q - reference).max())
    return math.inf if math.isnan(largest) else largest


def _agreement(same: Sequence[Run], near: Sequence[Run], others: Sequence[Run], apart: float
               ) -> str:
    if len(same) < 2:
        return "no two moved the arm alike" if others and not near else ""
    to = f"alike to {apart:.0e} rad" if apart > 0.0 else "alike to the last bit"
    if not others:
        return f"{_listed(same) if near else 'all'} moved the arm {to}"
    return f"{_listed(same)} moved the arm {to}, {_listed(others)} did not{_instead(same, others)}"


def _nearness(near: Sequence[Run], first: Run, apart: float) -> str:
    return f"{_listed(near)} stayed within {apart:.0e} rad of {first.label}" if near else ""


def _instead(same: Sequence[Run], others: Sequence[Run]) -> str:
    """Return in brackets what the others did worse or better, where it can be seen."""
    said = []
    for what, name, largest in (("body to obstacle", "body_distance_min", False),
                                ("median path error", "position_error_median_settled", True)):
        (known, usual), (one, value) = _extreme(same[:1], name, largest), _extreme(
            others, name, largest)
        if known and one and abs(value - usual) > 0.05 * abs(usual):
            said.append(f"{what} {_mm(value)} against {_mm(usual)}")
    return f" ({', '.join(said)})" if said else ""


def _contrasts(runs: Sequence[Run]) -> list[str]:
    """Return where scenarios differ by half and more in what they ask of the arm."""
    said = []
    for what, name, scale, unit in (("the largest joint speed step is", "velocity_step_max", 1.0,
                                     "rad/s"),
                                    ("the body came within", "body_distance_min", 1e3, "mm")):
        (least, low), (most, high) = (_extreme(runs, name, largest=False),
                                      _extreme(runs, name, largest=True))
        if least and most and high > 1.5 * low:
            said.append(f"{what} {_digits(scale * low)} {unit} in {least.label}, "
                        f"{_digits(scale * high)} {unit} in {most.label}")
    return said


def _collision(runs: Sequence[Run]) -> str:
    touched = [run for run in runs
               if (distance := run.metrics.get("body_distance_min")) is not None
               and distance.value is not None and distance.value <= 0.0]
    return f"{_listed(touched)} touched an obstacle with the body" if touched else ""


def _distance(runs: Sequence[Run]) -> str:
    nearest, value = _extreme(runs, "body_distance_min", largest=False)
    if nearest is None or value <= 0.0:
        return ""
    return f"the body kept at least {_mm(value)} from every obstacle"


def _tracking(runs: Sequence[Run]) -> str:
    name = "position_error_median_settled"
    best, low = _extreme(runs, name, largest=False)
    worst, high = _extreme(runs, name, largest=True)
    if best is None or worst is None:
        return ""
    if len(runs) == 1 or high <= 1.05 * low:
        return f"half of the time the tool was within {_mm(low)} of its path"
    return (f"half of the time the tool was within {_mm(low)} of its path under {best.label}, "
            f"{_mm(high)} under {worst.label}")


def _speed(runs: Sequence[Run]) -> str:
    name = "time_resolve_median"
    best, low = _extreme(runs, name, largest=False)
    worst, high = _extreme(runs, name, largest=True)
    if best is None or worst is None:
        return ""
    against = f", {worst.label} in {_digits(1e6 * high)} µs" if high > 1.2 * low else ""
    return f"{best.label} resolves a tick in {_digits(1e6 * low)} µs{against}"


def _extreme(runs: Sequence[Run], name: str, largest: bool) -> tuple[Run | None, float]:
    """Return the run with the smallest or largest value of a metric, and that value."""
    values = [(run, run.metrics[name].value) for run in runs if name in run.metrics]
    known = sorted(((value, i, run) for i, (run, value) in enumerate(values) if value is not None),
                   reverse=largest)
    return (known[0][2], known[0][0]) if known else (None, 0.0)


def _mm(metres: float) -> str:
    return f"{_digits(1e3 * metres)} mm"


def _digits(value: float) -> str:
    """Return two digits, and all that stand before the point: 0.14, 1.9, 254."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"


def _listed(runs: Sequence[Run]) -> str:
    *first, last = [run.label for run in runs]
    return f"{', '.join(first)} and {last}" if first else last
