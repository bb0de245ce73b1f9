"""Consecutive problems of closed loops: what a controller asks its resolver, tick after tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from hierarchy.problem import Hierarchy
from scenarios.config import Scenario, load
from scenarios.config.sampling import changed, drawn
from scenarios.loop.controller import Controller
from scenarios.loop.recording import Recording
from scenarios.loop.simulation import simulate

SCENARIOS = {
    "ellipse-hqp": "an arm on a path, with joint limits, distances and a cone as inequalities",
    "ellipse-limits": "an arm on a path inside its joint limits, with Algorithm 1",
    "human-hqp": "an arm beside a moving hand, seen by a camera",
    "humanoid-reach": "a humanoid asked to reach farther than it can"}
"""Scenarios that are recorded, by name."""
PERIODS = {"ellipse-hqp": 0.001, "ellipse-limits": 0.001, "human-hqp": 0.005,
           "humanoid-reach": 0.005}
"""Time between two ticks [s]."""
_WITHIN = (0.1, 0.7)  # share of a run at which a window begins
_PUBLIC = 0.4         # the same for the public half


def recorded(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return the problems of `count` consecutive ticks of a scenario's closed loop.

    seed : 0 for the scenario as shipped; any other samples its start from its [variation], and the
        tick at which the window begins.
    """
    scenario, begin = load(name), _PUBLIC
    if seed:
        scenario = _varied(scenario, seed)
        begin = float(np.random.default_rng([seed, 3]).uniform(*_WITHIN))
    first = int(begin * scenario.control.ticks)
    longest = (first + count) * scenario.control.period
    window = _Window(first)
    simulate(changed(scenario, {"control.duration": longest}, name), audits=[window])
    return window.problems[:count]


def _varied(scenario: Scenario, seed: int) -> Scenario:
    if not scenario.variation:
        return scenario
    return changed(scenario, drawn(scenario, scenario.variation, seed, 0), scenario.name)


@final
class _Window:
    """Keeps the problems of all ticks from one on; an Audit."""

    def __init__(self, first: int) -> None:
        self.first = first
        self.problems: list[Hierarchy] = []

    def look(self, tick: int, controller: Controller) -> None:
        """Copy the problem of a tick, whose arrays the next one writes again."""
        if tick >= self.first:
            h = controller.hierarchy
            self.problems.append(Hierarchy(h.A.copy(), h.lower.copy(), h.upper.copy(),
                                           h.sizes.copy(), h.reference.copy(), h.names,
                                           None if h.metric is None else h.metric.copy()))

    def signals(self, recording: Recording) -> Mapping[str, Any]:
        """Return no signals."""
        return {}
