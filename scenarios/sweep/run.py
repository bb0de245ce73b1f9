"""One run of a sweep: from the text of a scenario to its metrics."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from hierarchy import plugins
from scenarios.measure.metrics import Metric

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.recording.recording import Recording

# Code that only requests or shows runs: changing it does not change the measurements.
_NOT_IN_A_RUN = ("bench/", "cli/", "draw/", "export/", "library/", "report/", "scene/", "sweep/",
                 "files.py", "words.py", *(f"measure/{name}.py" for name in (
                     "comparison", "goals", "motions", "partings", "runs", "verdict")),
                 *(f"reproduce/{name}.py" for name in (
                     "blocks", "claims", "commands", "pages", "rows", "studies", "whole")))
_PLACE = ("system", "processor")  # entries of versions() that describe the machine
_ONE_AT_A_TIME = threading.Lock()  # the kernels' work arrays are shared in a process


@dataclass(frozen=True)
class Job:
    """A planned run: the scenario's text, the resolver, the key of both, and needed plugins."""

    key: str
    text: str
    resolver: str
    plugins: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """The outcome of a run.

    `fault` is the reason why it stopped early, `error` why nothing was measured, otherwise None.
    `versions` is the `digest` of the code that made it.
    """

    key: str
    ticks: int
    fault: str | None
    error: str | None
    wall_seconds: float
    versions: str
    metrics: tuple[Metric, ...] = ()


Measured = Callable[["Scenario"], tuple["Recording", tuple[Metric, ...]]]


class OtherVersionsError(RuntimeError):
    """A worker has other versions of this package or its dependencies than the client."""


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
    files = (path for package in ("hierarchy", "solvers", "scenarios")
             for path in sorted((root / package).rglob("*.py")))
    used = {name: version for name, version in versions().items() if name not in _PLACE}
    found = hashlib.sha256(json.dumps(used, sort_keys=True).encode())
    for name, path in ((path.relative_to(root).as_posix(), path) for path in files):
        if not name.removeprefix("scenarios/").startswith(_NOT_IN_A_RUN):
            found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def simulated(scenario: Scenario) -> tuple[Recording, tuple[Metric, ...]]:
    """Return the recording of a run and what is measured on it."""
    from scenarios import simulate
    from scenarios.measure.metrics import measure

    recording = simulate(scenario)
    return recording, tuple(measure(recording).values())


def run(text: str, resolver: str, key: str, measured: Measured = simulated) -> Outcome:
    """Run a scenario under a resolver and measure it; an exception becomes its `error`."""
    from scenarios.config import Scenario

    begun = perf_counter()
    try:
        recording, metrics = measured(Scenario.from_toml(text).with_resolver(resolver))
    except Exception as error:  # the failed run is a row too, with the reason
        return Outcome(key, 0, None, f"{type(error).__name__}: {error}",
                       perf_counter() - begun, digest())
    return Outcome(key, recording.ticks, recording.fault, None, perf_counter() - begun, digest(),
                   metrics)


def run_batch(jobs: Sequence[Job], versions: str, measured: Measured = simulated) -> list[Outcome]:
    """Run jobs one after the other; raises OtherVersionsError unless this code is `versions`."""
    for module in dict.fromkeys(name for job in jobs for name in job.plugins):
        plugins.allow(module)  # as the process that planned the runs has done
    if digest() != versions:
        raise OtherVersionsError("a worker has other versions of task-hierarchy or its "
                                 "dependencies than this machine; install the same on both")
    with _ONE_AT_A_TIME:
        return [run(job.text, job.resolver, job.key, measured) for job in jobs]
