"""What is measured in every tick of sampled runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from benchmark.reproduce.studies import Study
from scenarios.config import Scenario, load
from scenarios.config.sampling import changed, drawn
from scenarios.loop.audit import Audit
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import Metric
from scenarios.recording.recording import Recording
from scenarios.results.run import Job, digest, key_of

Array = NDArray[np.float64]
MEDIAN, LARGEST = "command_difference_median", "command_difference_max"
DAMPED, LEFT = "damped_share", "left_median"
METRICS: dict[str, dict[str, str]] = {
    MEDIAN: {"label": "Difference of the command, median", "unit": "rad/s^2"},
    LARGEST: {"label": "Difference of the command, max", "unit": "rad/s^2"},
    DAMPED: {"label": "Ticks in which its pivot is damped", "unit": "share"},
    LEFT: {"label": "What damping leaves of its step, median", "unit": "share"}}
PAIR, PIVOT = (MEDIAN, LARGEST), (DAMPED, LEFT)
"""The metrics of a pair of resolvers, and of a level."""


class Watch(Audit, Protocol):
    """An audit that sums up a run."""

    def metrics(self) -> dict[str, float]:
        """Return the metrics of the run by name."""


@final
class Beside:
    """Solves every tick with two resolvers more, and keeps the distance between their answers."""

    def __init__(self, pair: tuple[str, str], scenario: Scenario) -> None:
        self._pair = [scenario.with_resolver(spec).make_resolver()
                      for spec in pair]
        self._memory: list[Any] = [None, None]
        self._distances: list[float] = []

    def look(self, tick: int, controller: Controller) -> None:
        """Solve the hierarchy of a tick."""
        answers: list[Array] = []
        for k, resolver in enumerate(self._pair):
            resolution = resolver.solve(controller.hierarchy, self._memory[k])
            self._memory[k] = resolution.memory
            answers.append(resolution.x)
        self._distances.append(float(np.linalg.norm(answers[0] - answers[1])))

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return nothing: the recording is that of the run."""
        return {}

    def metrics(self) -> dict[str, float]:
        """Return the median and the largest distance."""
        return {MEDIAN: float(np.median(self._distances)), LARGEST: max(self._distances)}


@final
class Outside:
    """Measures the pivot of a level of one row: what of it is outside the rows above.

    Damping by lambda leaves pivot^2 / (pivot^2 + lambda^2) of the step of such a level.
    """

    def __init__(self, level: str, scenario: Scenario) -> None:
        resolver = scenario.make_resolver()
        self._level, self._pivots = level, list[float]()
        self._damping, self._threshold = resolver.damping, resolver.threshold

    def look(self, tick: int, controller: Controller) -> None:
        """Measure the pivot in a tick whose stack has the level."""
        h = controller.hierarchy
        if self._level in h.names:
            i = h.offsets[h.names.index(self._level)]
            Q = np.linalg.qr(h.A[:i].T)[0]
            self._pivots.append(float(np.linalg.norm(h.A[i] - Q @ (Q.T @ h.A[i]))))

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return nothing: the recording is that of the run."""
        return {}

    def metrics(self) -> dict[str, float]:
        """Return the share of ticks that are damped, and the median of what is left in a tick."""
        squares = np.square(self._pivots)
        share = np.minimum(1.0, squares / self._threshold**2)
        damping = self._damping**2 * (1.0 - share)
        return {DAMPED: float((share < 1.0).mean()),
                LEFT: float(np.median(squares / (squares + damping)))}


def jobs(study: Study, seed: int) -> list[Job]:
    """Return the runs of a study, one for each start."""
    scenario = load(study.scenario)
    found = []
    for start in range(study.starts):
        values = drawn(scenario, scenario.variation, seed, start)
        text = changed(scenario, values, "variation").to_toml()
        key = key_of(text, f"{study.resolver} {study.pairs} {study.pivots}", digest())
        found.append(Job(key, text, study.resolver, study.scenario, start, values))
    return found


def measured(study: Study, scenario: Scenario) -> tuple[Recording, tuple[Metric, ...]]:
    """Return the recording of a run and what the columns of the study measured in its ticks."""
    watches: dict[str, Watch] = {
        **{name: Beside(pair, scenario) for name, pair in study.pairs.items()},
        **{level: Outside(level, scenario) for level in study.pivots}}
    recording = simulate(scenario, audits=tuple(watches.values()))
    return recording, tuple(
        Metric(f"{column} {name}", METRICS[name]["label"], value, METRICS[name]["unit"])
        for column, watch in watches.items() for name, value in watch.metrics().items())
