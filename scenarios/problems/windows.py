"""Consecutive problems of closed loops: what a controller asks its resolver, tick after tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from hierarchy.problem import Hierarchy
from scenarios.config import Scenario, ScenarioError, load
from scenarios.config.sampling import changed, drawn
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording

SCENARIOS = {
    "ellipse-hqp": "an arm on a path, with joint limits, distances and a cone as inequalities",
    "ellipse-limits": "an arm on a path inside its joint limits, with Algorithm 1",
    "human-hqp": "an arm beside a moving hand, seen by a camera",
    "humanoid-reach": "a humanoid asked to reach farther than it can",
    "stand-push": "a pushed humanoid, torque motors: dynamics, contacts, friction (extra `sim`)"}
"""Scenarios that are recorded, by name."""
PERIODS = {"ellipse-hqp": 0.001, "ellipse-limits": 0.001, "human-hqp": 0.005,
           "humanoid-reach": 0.005, "stand-push": 0.001}
"""Time between two ticks [s]."""
_WITHIN = (0.1, 0.7)  # share of a run at which a window begins
_PUBLIC = 0.4         # the same for the public set
_RUNS = 20            # sampled runs tried until one lasts to the end of its window


def recorded(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return the problems of `count` consecutive ticks of a scenario's closed loop.

    seed : 0 for the scenario as shipped; any other samples its start from its [variation], and the
        tick at which the window begins.

    Raises
    ------
    ScenarioError : no run lasts to the end of its window.
    """
    shipped, begin = load(name), _PUBLIC
    if seed:
        begin = float(np.random.default_rng([seed, 3]).uniform(*_WITHIN))
    first = int(begin * shipped.control.ticks)
    longest = (first + count) * shipped.control.period
    for run in range(_RUNS if seed else 1):
        window = Window(first)
        scenario = _varied(shipped, seed, run) if seed else shipped
        simulate(changed(scenario, {"control.duration": longest}, name), audits=[window])
        if len(window.problems) >= count:
            return window.problems[:count]
    raise ScenarioError(f"{name}: no run with seed {seed} has {count} problems from tick {first} "
                        "on")


def _varied(scenario: Scenario, seed: int, run: int) -> Scenario:
    if not scenario.variation:
        return scenario
    return changed(scenario, drawn(scenario, scenario.variation, seed, run), scenario.name)


@final
class Window:
    """Keeps the problems of all ticks from one on; an Audit."""

    def __init__(self, first: int) -> None:
        self.first = first
        self.problems: list[Hierarchy] = []

    def look(self, tick: int, controller: Controller) -> None:
        """Keep the problem of a tick."""
        if tick >= self.first:
            self.problems.append(controller.hierarchy.copy())

    def signals(self, recording: Recording) -> Mapping[str, Any]:
        """Return no signals."""
        return {}
