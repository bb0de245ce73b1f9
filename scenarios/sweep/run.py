"""One run of a sweep: from a scenario's text to what was measured, wherever it is computed."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from time import perf_counter

from scenarios.measure.metrics import Metric

# What only asks for runs or shows them; a change to it does not change what is measured.
_NOT_IN_A_RUN = ("bench/", "cli/", "draw/", "export/", "library/", "report/", "scene/", "sweep/",
                 "files.py", "words.py", *(f"measure/{name}.py" for name in (
                     "comparison", "motions", "partings", "runs", "verdict")))
_PLACE = ("system", "processor")  # of versions(): on which machine, not with what
_ONE_AT_A_TIME = threading.Lock()  # the kernels' work arrays belong to the process


@dataclass(frozen=True)
class Job:
    """A run to be made: the scenario's text, the resolver, and the key of both."""

    key: str
    text: str
    resolver: str


@dataclass(frozen=True)
class Outcome:
    """What came of a run.

    `fault` says why it ended early, `error` why there is nothing measured; None if neither is so.
    `versions` is the `digest` of the code that made it.
    """

    key: str
    ticks: int
    fault: str | None
    error: str | None
    wall_seconds: float
    versions: str
    metrics: tuple[Metric, ...] = ()


class OtherVersionsError(RuntimeError):
    """A worker has other versions of this package, or of what it uses, than who asks."""


def key_of(text: str, resolver: str, versions: str) -> str:
    """Return the key of a run: the same scenario, resolver and code have the same one."""
    return hashlib.sha256("\0".join((text, resolver, versions)).encode()).hexdigest()[:32]


@cache
def digest() -> str:
    """Return a digest of all that a run's numbers depend on besides its scenario.

    That is the source of what takes part in a run, kernels included, and the versions of what it
    uses.
    """
    from scenarios.loop.recording import versions

    root = Path(__file__).parents[2]
    files = (path for package in ("hierarchy", "solvers", "scenarios")
             for path in sorted((root / package).rglob("*.py")))
    used = {name: version for name, version in versions().items() if name not in _PLACE}
    found = hashlib.sha256(json.dumps(used, sort_keys=True).encode())
    for name, path in ((path.relative_to(root).as_posix(), path) for path in files):
        if not name.removeprefix("scenarios/").startswith(_NOT_IN_A_RUN):
            found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def run(text: str, resolver: str, key: str) -> Outcome:
    """Run a scenario under a resolver and measure it; whatever breaks becomes its `error`."""
    from scenarios import simulate
    from scenarios.config import Scenario
    from scenarios.measure.metrics import measure

    begun = perf_counter()
    try:
        scenario = Scenario.from_toml(text).with_resolver(resolver)
        recording = simulate(scenario)
        measured = tuple(measure(recording).values())
    except Exception as error:  # a row like any other, and the reason is its content
        return Outcome(key, 0, None, f"{type(error).__name__}: {error}",
                       perf_counter() - begun, digest())
    return Outcome(key, recording.ticks, recording.fault, None, perf_counter() - begun, digest(),
                   measured)


def run_batch(jobs: Sequence[Job], versions: str) -> list[Outcome]:
    """Run jobs one after the other; raises OtherVersionsError unless this code is `versions`."""
    if digest() != versions:
        raise OtherVersionsError("a worker has other versions of task-hierarchy, or of what it "
                                 "uses, than this machine; install the same on both")
    with _ONE_AT_A_TIME:
        return [run(job.text, job.resolver, job.key) for job in jobs]
