"""Words of a verdict: who is meant, and numbers with two digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from hierarchy.words import listed

if TYPE_CHECKING:
    from scenarios.measure.runs import Run

TIE = 0.05  # relative difference within which two values are not told apart in words

Clause = tuple[str, str]  # who, or "", and what is said


def value(run: Run, name: str, default: float) -> float:
    """Return a metric of a run, or the default if it is not known."""
    return measured([run], name).get(run.label, default)


def measured(runs: Sequence[Run], name: str) -> dict[str, float]:
    """Return a metric by label, of the runs that have it."""
    return {run.label: known for run in runs
            if name in run.metrics and (known := run.metrics[name].value) is not None}


def within(found: dict[str, float], runs: Sequence[Run], best: float) -> list[Run]:
    """Return the runs whose value is about the best."""
    return [run for run in runs if run.label in found
            and abs(found[run.label] - best) <= TIE * max(abs(best), abs(found[run.label]))]


def at(found: dict[str, float], value: float) -> str:
    """Return the first label that has a value."""
    return next(label for label, one in found.items() if one == value)


def who(some: Sequence[Run], runs: Sequence[Run], every: str = "") -> str:
    """Name some of the runs in the shortest way that is clear."""
    others = [run.label for run in runs if run not in some]
    if not others:
        return runs[0].label if len(runs) == 1 else every or ("both" if len(runs) == 2 else "all")
    return f"all but {listed(others)}" if len(others) < min(len(some), 3) else listed(
        [run.label for run in some])


def mm(metres: float) -> str:
    """Return a length [m] in millimetres."""
    return f"{digits(1e3 * metres)} mm"


def digits(value: float) -> str:
    """Return two digits, and all that stand before the point: 0.14, 1.9, 254."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"
