"""What a comparison comes to, in one sentence made from its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenarios.compare import Run

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def verdict(runs: Sequence[Run]) -> str:
    """Return the sentence about runs of one scenario; only what was measured enters it."""
    finished = [run for run in runs if run.fault is None]
    parts = [_completion(runs, finished)]
    if finished:
        parts += [_distance(finished), _tracking(finished), _speed(finished)]
    return "; ".join(part for part in parts if part) + "."


def in_words(count: int) -> str:
    """Return a small number as a word."""
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _completion(runs: Sequence[Run], finished: Sequence[Run]) -> str:
    seconds = f"{runs[0].scenario.control.duration:.4g} s"
    if len(finished) == len(runs) == 1:
        return f"{runs[0].label} ran the whole {seconds}"
    if len(finished) == len(runs):
        every = "Both" if len(runs) == 2 else f"All {in_words(len(runs))}"
        return f"{every} ways ran the whole {seconds}"
    stopped = ", ".join(run.label for run in runs if run.fault)
    some = f"{in_words(len(finished)).capitalize()} of {in_words(len(runs))} ways"
    return f"{some if finished else 'No way'} ran the whole {seconds} ({stopped} did not)"


def _distance(runs: Sequence[Run]) -> str:
    nearest, value = _extreme(runs, "body_distance_min", largest=False)
    if nearest is None:
        return ""
    if value <= 0.0:
        return f"{nearest.label} touched an obstacle with its body"
    return f"the body kept at least {1e3 * value:.0f} mm from every obstacle"


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
    against = f", {worst.label} takes {1e6 * high:.2g} µs" if high > 1.2 * low else ""
    return f"{best.label} resolves a tick in {1e6 * low:.2g} µs{against}"


def _extreme(runs: Sequence[Run], name: str, largest: bool) -> tuple[Run | None, float]:
    """Return the run with the smallest or largest value of a metric, and that value."""
    values = [(run, run.metrics[name].value) for run in runs if name in run.metrics]
    known = sorted(((value, i, run) for i, (run, value) in enumerate(values) if value is not None),
                   reverse=largest)
    return (known[0][2], known[0][0]) if known else (None, 0.0)


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.2g} mm"
