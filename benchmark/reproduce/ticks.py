"""What is measured in every tick of sampled runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, final

import numpy as np

from benchmark.machine import on_all_cores
from hierarchy.problem import Array, Hierarchy
from scenarios.config import Scenario
from scenarios.config.sampling import changed, drawn
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording

MEDIAN, LARGEST = "command_difference_median", "command_difference_max"
DAMPED, LEFT = "damped_share", "left_median"
METRICS: dict[str, dict[str, dict[str, object]]] = {
    "pairs": {MEDIAN: {"label": "Difference of the command, median", "unit": "rad/s^2"},
              LARGEST: {"label": "Difference of the command, max", "unit": "rad/s^2"}},
    "pivots": {DAMPED: {"label": "Ticks in which its pivot is damped", "unit": "share"},
               LEFT: {"label": "What damping leaves of its step, median", "unit": "share"}}}
"""The metrics of pairs of resolvers, and of levels."""


@final
class Watch:
    """Keeps a number of each tick's hierarchy, or none; an Audit without signals."""

    def __init__(self, measure: Callable[[Hierarchy], float | None]) -> None:
        self._measure, self.found = measure, list[float]()

    def look(self, tick: int, controller: Controller) -> None:
        """Measure a tick."""
        value = self._measure(controller.hierarchy)
        self.found += [] if value is None else [value]

    def signals(self, recording: Recording) -> Mapping[str, Any]:
        """Return nothing: the recording is that of the run."""
        return {}


def apart(pair: tuple[str, str], scenario: Scenario) -> Callable[[Hierarchy], float]:
    """Return the distance between the answers of two resolvers, each with its memory."""
    solvers = [scenario.with_resolver(spec).make_resolver() for spec in pair]
    memory: list[Any] = [None, None]

    def measure(h: Hierarchy) -> float:
        answers: list[Array] = []
        for k, resolver in enumerate(solvers):
            found = resolver.solve(h, memory[k])
            memory[k] = found.memory
            answers.append(found.x)
        return float(np.linalg.norm(answers[0] - answers[1]))

    return measure


def pivot(level: str) -> Callable[[Hierarchy], float | None]:
    """Return the length of a level's one row outside the rows above, where the stack has it."""
    def measure(h: Hierarchy) -> float | None:
        if level not in h.names:
            return None
        i = h.offsets[h.names.index(level)]
        Q = np.linalg.qr(h.A[:i].T)[0]
        return float(np.linalg.norm(h.A[i] - Q @ (Q.T @ h.A[i])))

    return measure


def measured(scenario: Scenario, pairs: Mapping[str, tuple[str, str]], pivots: tuple[str, ...],
             starts: int, seed: int) -> tuple[list[dict[tuple[str, str], float]], int]:
    """Return the metrics of each start by column and name, and how many runs reached their end."""
    found = on_all_cores(_run, [
        (changed(scenario, drawn(scenario, scenario.variation, seed, start), "variation"),
         dict(pairs), pivots) for start in range(starts)])
    return [metrics for metrics, _ in found], sum(ended for _, ended in found)


def _run(scenario: Scenario, pairs: Mapping[str, tuple[str, str]], pivots: tuple[str, ...]
         ) -> tuple[dict[tuple[str, str], float], bool]:
    beside = {name: Watch(apart(pair, scenario)) for name, pair in pairs.items()}
    outside = {level: Watch(pivot(level)) for level in pivots}
    run = simulate(scenario, audits=(*beside.values(), *outside.values()))
    metrics = {(name, key): float(of(watch.found)) for name, watch in beside.items()
               for key, of in ((MEDIAN, np.median), (LARGEST, np.max))}
    resolver = scenario.make_resolver()
    for level, watch in outside.items():
        # Damping by lambda leaves pivot^2 / (pivot^2 + lambda^2) of the step of such a level.
        squares = np.square(watch.found)
        share = np.minimum(1.0, squares / resolver.threshold**2)
        damping = resolver.damping**2 * (1.0 - share)
        metrics |= {(level, DAMPED): float((share < 1.0).mean()),
                    (level, LEFT): float(np.median(squares / (squares + damping)))}
    return metrics, run.fault is None
