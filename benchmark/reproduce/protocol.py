"""The protocol of `protocol.toml`: columns, layouts, claims, and the runs that decide them."""

import gzip
import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from benchmark.reproduce.avoidance import measured
from hierarchy.problem import Array
from scenarios.config import Scenario, load
from scenarios.config.distributions import Value
from scenarios.config.scenario import OWN
from scenarios.files import make_folder, write_bytes
from scenarios.results.plan import Job, Outcome, digest, key_of, outcome
from scenarios.results.sampled import Progress, Workers, complete
from scenarios.results.store import Store

ENDED = "reached_end"
_DIGITS = 6  # kept of each value
_NUMBERS = re.compile(r"\S*\d\S*")
_MEASURED = Path(__file__).with_name("avoidance.py").read_text("utf-8")  # no part of `digest`


@dataclass(frozen=True)
class Column:
    """A scenario with changes at dotted keys, under a resolver."""

    scenario: str
    resolver: str = OWN
    set: Mapping[str, Any] = field(default_factory=dict)

    def load(self, layout: Mapping[str, Any], name: str) -> Scenario:
        """Return the scenario on a layout, under a name."""
        changes = {**layout, **self.set, "name": name}
        return load(self.scenario, changes).with_resolver(self.resolver)


@dataclass(frozen=True)
class Claim:
    """What is said of a column, and the smallest effect that matters; see protocol.toml."""

    name: str
    family: str
    text: str
    of: str
    metric: str = ""
    below: str = ""
    above: str = ""
    least: float = -np.inf
    most: float = np.inf
    percent: bool = False
    matters: float = 0.0
    section: str = ""
    quotation: str = ""

    @property
    def rival(self) -> str:
        """The column that it is compared with, "" for a bound."""
        return self.below or self.above


@dataclass(frozen=True)
class Protocol:
    """Columns run on every layout from `starts` starts of each seed, and what is claimed of them.

    noise : added to every sampled number when all is run again. level : of Holm's procedure.
    share : of the starts from which a bound is to be kept. untested : what is not decided, and why.
    """

    layouts: Mapping[str, Mapping[str, Any]]
    columns: Mapping[str, Column]
    claims: tuple[Claim, ...]
    seeds: tuple[int, ...]
    starts: int
    noise: float
    level: float
    share: float
    untested: Mapping[str, str]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the protocol of a file."""
        given = tomllib.loads(path.read_text(encoding="utf-8"))
        return cls(given["layout"],
                   {name: Column(**one) for name, one in given["column"].items()},
                   tuple(Claim(name, **one) for name, one in given["claim"].items()),
                   tuple(given["seeds"]), *(given[key] for key in (
                       "starts", "noise", "level", "share", "untested")))

    @property
    def metrics(self) -> set[str]:
        """The metrics that decide claims."""
        return {claim.metric for claim in self.claims} - {""}


PROTOCOL = Protocol.read(Path(__file__).with_suffix(".toml"))


@dataclass(frozen=True)
class Rows:
    """What came of the runs: values[noisy][column][metric], by layout, seed and start.

    A value is None where the run ended in a fault, which reasons[noisy][column] counts by its text,
    or has no such metric. metrics : name to label, unit, and whether lower is better.
    """

    layouts: list[str]
    seeds: list[int]
    starts: int
    metrics: dict[str, dict[str, Any]]
    values: list[dict[str, dict[str, list[float | None]]]]
    reasons: list[dict[str, dict[str, int]]]

    @cached_property
    def blocks(self) -> NDArray[np.int64]:
        """The block of each run, of one layout and seed, (runs,)."""
        return np.repeat(np.arange(len(self.layouts) * len(self.seeds)), self.starts)

    def layout(self, name: str) -> NDArray[np.bool_]:
        """Return which runs are on a layout, (runs,)."""
        return np.asarray(self.blocks // len(self.seeds) == self.layouts.index(name))

    def column(self, column: str, metric: str, noisy: int = 0) -> Array:
        """Return a metric (runs,), at its worst where the run ended in a fault."""
        worst = np.inf if self.metrics[metric]["lower"] else -np.inf
        found = np.array(self.values[noisy][column][metric], dtype=float)
        return np.where(np.isnan(found), worst, found)

    def ended(self, column: str, noisy: int = 0) -> NDArray[np.bool_]:
        """Return which runs reached their end, (runs,)."""
        return np.asarray(np.array(self.values[noisy][column][ENDED]) == 1.0)


def planned(scenario: Scenario, text: str, start: int, values: Mapping[str, Value]) -> Job:
    """Return a run of a scenario, with its text, from a start; `work` applies what is sampled."""
    key = key_of(text + json.dumps(values), OWN, digest() + _MEASURED)
    return Job(key, text, OWN, scenario.name, start, values)


def work(job: Job) -> Outcome:
    """Make a run in a process of the pool."""
    return outcome(job, lambda scenario: measured(
        scenario.with_drawn(job.values, scenario.name)))


def made(jobs: Sequence[Job], out: Path, workers: Workers, progress: Progress | None = None
         ) -> dict[str, Outcome]:
    """Make the runs that a folder does not have; return all of it by key. Raises as `sweep`."""
    store = Store(out)
    with store.opened():
        complete(jobs, store, workers, out.name, progress, work)
        return store.outcomes()


def run(protocol: Protocol, out: Path, workers: Workers, progress: Progress | None = None
        ) -> Iterator[Rows]:
    """Make the runs that `out` does not have, seed by seed; yield those of all seeds so far.

    Each seed is run without and with noise. Raises what `scenarios.results.sampled.sweep` raises.
    """
    for count in range(1, len(protocol.seeds) + 1):
        some = replace(protocol, seeds=protocol.seeds[:count])
        runs = list(_runs(some))
        yield _rows(some, runs, made([job for *_, job in runs], out, workers, progress))


def _rows(protocol: Protocol, runs: Sequence[tuple[int, str, Job]],
          kept: Mapping[str, Outcome]) -> Rows:
    values: list[dict[str, dict[str, list[float | None]]]] = [{}, {}]
    reasons: list[dict[str, dict[str, int]]] = [{}, {}]
    metrics: dict[str, dict[str, Any]] = {}
    for noisy, column, one in runs:
        found = kept[one.key]
        of = values[noisy].setdefault(column, {})
        of.setdefault(ENDED, []).append(float(found.reason is None))
        if found.reason is not None:  # without its numbers, so that alike ones are counted together
            kind, told = _NUMBERS.sub("#", found.reason), reasons[noisy].setdefault(column, {})
            told[kind] = told.get(kind, 0) + 1
        known = {} if found.reason else {one.name: one.value for one in found.metrics}
        for name in sorted(protocol.metrics):
            value = known.get(name)
            of.setdefault(name, []).append(
                None if value is None or not np.isfinite(value) else float(f"{value:.{_DIGITS}g}"))
        metrics |= {metric.name: {"label": metric.label, "unit": metric.unit,
                                  "lower": metric.lower_is_better is not False}
                    for metric in found.metrics if metric.name in protocol.metrics}
    return Rows(list(protocol.layouts), list(protocol.seeds), protocol.starts, metrics, values,
                reasons)


def _runs(protocol: Protocol) -> Iterator[tuple[int, str, Job]]:
    """Yield the runs with whether they have noise, and their column."""
    for noisy, (name, column), (layout, changes) in product(
            (0, 1), protocol.columns.items(), protocol.layouts.items()):
        scenario = column.load(changes, f"{name}-{layout}")
        text = scenario.to_toml()
        for seed, start in product(protocol.seeds, range(protocol.starts)):
            values = scenario.drawn(seed, start)
            if noisy:
                values = _with_noise(values, protocol.noise, (seed, start))
            yield noisy, name, planned(scenario, text, start, values)


def _with_noise(values: Mapping[str, Value], noise: float, seed: tuple[int, int]
                ) -> dict[str, Value]:
    """Return values with normal noise on every number."""
    random = np.random.default_rng(seed)

    def moved(value: Any) -> Any:
        if isinstance(value, list):
            return [moved(one) for one in value]
        return value + noise * random.standard_normal() if isinstance(value, float) else value

    return {key: moved(value) for key, value in values.items()}


def write(rows: Rows, path: Path) -> None:
    """Write rows as compressed JSON; the same rows give the same bytes."""
    make_folder(path.parent)
    write_bytes(path, gzip.compress(json.dumps(asdict(rows)).encode(), mtime=0))


def read(path: Path) -> Rows:
    """Return the rows of a file."""
    return Rows(**json.loads(gzip.decompress(path.read_bytes())))
