"""One run of a sweep: from the text of a scenario to its metrics."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

from hierarchy import plugins
from scenarios.config import Scenario
from scenarios.measure.metrics import Metric
from scenarios.recording.recording import Recording

# Code that only requests or shows runs: changing it does not change the measurements.
_NOT_IN_A_RUN = ("cli/", "draw/", "export/", "library/", "problems/", "results/", "scene/",
                 "files.py", "templates.py", *(f"measure/{name}.py" for name in (
                     "goals", "motions", "runs", "statistics", "verdict")))
_PLACE = ("system", "processor")  # entries of versions() that describe the machine


@dataclass(frozen=True)
class Job:
    """A planned run: the scenario's text, the resolver, the key of both, and needed plugins.

    sample, values : the number of the sample, and what was sampled by dotted key. group, label :
    the runs that it stands beside, and its column there.
    """

    key: str
    text: str
    resolver: str
    scenario: str = ""
    sample: int = 0
    values: Mapping[str, Any] = field(default_factory=dict)
    plugins: tuple[str, ...] = ()
    group: str = ""
    label: str = ""

    def load(self) -> Scenario:
        """Return the scenario under its resolver, after importing the plugins."""
        for module in self.plugins:
            plugins.allow(module)
        return Scenario.from_toml(self.text).with_resolver(self.resolver)


@dataclass(frozen=True)
class Outcome:
    """What came of a run; `reason` says why it did not reach its end, otherwise None."""

    key: str
    ticks: int
    reason: str | None
    wall_seconds: float
    metrics: tuple[Metric, ...] = ()


Measured = Callable[["Scenario"], tuple["Recording", tuple[Metric, ...]]]


def key_of(text: str, resolver: str, versions: str) -> str:
    """Return the key of a run, which is the same for the same scenario, resolver and code."""
    return hashlib.sha256("\0".join((text, resolver, versions)).encode()).hexdigest()[:32]


def digest() -> str:
    """Return a digest of everything besides the scenario that the numbers of a run depend on.

    This is the source code used in a run, including kernels and plugins, and the versions of
    dependencies.
    """
    return _of_the_package() + plugins.fingerprint()


@cache
def _of_the_package() -> str:
    from scenarios.measure.run_folder import versions

    root = Path(__file__).parents[2]
    used = {name: version for name, version in versions().items() if name not in _PLACE}
    found = hashlib.sha256(json.dumps(used, sort_keys=True).encode())
    for package in ("hierarchy", "solvers", "scenarios"):
        for path in sorted((root / package).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if not name.removeprefix("scenarios/").startswith(_NOT_IN_A_RUN):
                found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def simulated(scenario: Scenario) -> tuple[Recording, tuple[Metric, ...]]:
    """Return the recording of a run and what is measured on it."""
    from scenarios import simulate
    from scenarios.measure.metrics import measure

    recording = simulate(scenario)
    return recording, tuple(measure(recording).values())


def outcome(job: Job, measured: Measured = simulated) -> Outcome:
    """Make a run and measure it; an exception becomes its reason."""
    begun = perf_counter()
    try:
        recording, metrics = measured(job.load())
    except Exception as error:  # the failed run is a row too, with the reason
        return Outcome(job.key, 0, f"{type(error).__name__}: {error}", perf_counter() - begun)
    return Outcome(job.key, recording.ticks, recording.fault, perf_counter() - begun, metrics)
