"""The studies of `studies.toml`, run from sampled starts, and their rows, kept as JSON."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from scenarios.config import Scenario, load
from scenarios.config.groups import load_group
from scenarios.config.scenario import OWN
from scenarios.files import make_folder, write_text
from scenarios.measure.metrics import Metric
from scenarios.measure.statistics import Paired, Spread, paired, spread
from scenarios.results.columns import valued
from scenarios.results.sampled import Progress, Workers, compare_starts

_TOML = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
BLOCKS: Mapping[str, Mapping[str, Any]] = _TOML["block"]
SEED: int = _TOML["seed"]
_DIGITS = 6  # kept of each value


@dataclass(frozen=True)
class Column:
    """One column of a study: a scenario with changes at dotted keys, under a resolver."""

    name: str
    scenario: str
    resolver: str = OWN
    set: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Scenario:
        """Return the scenario, named after the column."""
        scenario = load(self.scenario, {**self.set, "name": self.name})
        return scenario.with_resolver(self.resolver)


@dataclass(frozen=True)
class Study:
    """Columns that are run from the same sampled starts; or what is measured in every tick.

    scenario, resolver : whose ticks are measured. pairs : two resolvers, as specs, whose answers
    are compared, by column. pivots : levels of one row, whose share outside the rows above is
    measured.
    """

    name: str
    title: str
    columns: tuple[Column, ...] = ()
    scenario: str = ""
    resolver: str = ""
    pairs: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    pivots: tuple[str, ...] = ()
    starts: int = _TOML["starts"]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns."""
        return (*(column.name for column in self.columns), *self.pairs, *self.pivots)

    @classmethod
    def of(cls, name: str, given: Mapping[str, Any]) -> Study:
        """Return the study of a table; a group stands for a column for each of its scenarios."""
        rest = {key: value for key, value in given.items() if key not in ("columns", "group")}
        group = load_group(given["group"]).scenarios if "group" in given else ()
        columns = given.get("columns") or {one: {"scenario": one} for one in group}
        return cls(name, columns=tuple(Column(key, **value) for key, value in columns.items()),
                   **rest)


STUDIES = {name: Study.of(name, given) for name, given in _TOML["study"].items()}
"""The studies by name."""


@dataclass(frozen=True)
class Rows:
    """What came of a study.

    command, starts, seed : how to make it again. metrics : name to label, unit and direction.
    values : column to metric to the value of each start, None where there is none.
    ended : column to the number of starts from which it reached its end.
    """

    study: str
    command: str
    starts: int
    seed: int
    metrics: dict[str, dict[str, object]]
    values: dict[str, dict[str, list[float | None]]]
    ended: dict[str, int]

    def column(self, column: str, metric: str) -> Array:
        """Return a metric of a column by start; raises HierarchyError for unknown names."""
        try:
            return np.array(self.values[column][metric], dtype=float)
        except KeyError as error:
            raise HierarchyError(f"study {self.study!r} has no {error} (asked for {metric} of "
                                 f"{column})") from None

    def spread(self, column: str, metric: str) -> Spread | None:
        """Return the spread of a metric of a column."""
        return spread(self.column(column, metric))

    def paired(self, metric: str, first: str, second: str) -> Paired:
        """Return the paired differences of a metric: second minus first."""
        return paired(self.column(first, metric), self.column(second, metric))

    def metric(self, name: str, value: float = np.nan) -> Metric:
        """Return a metric with its unit and a value."""
        known = self.metrics[name]
        return valued(Metric(name, str(known["label"]), None, str(known["unit"])), value)


def rows_of(study: Study, out: Path, workers: Workers, progress: Progress | None = None) -> Rows:
    """Run a study and return its rows; runs that `out` has are not repeated.

    Raises what `compare_starts` raises.
    """
    command = f"hierarchy reproduce {study.name}"
    said = progress and (lambda name, done, total: progress(study.name, done, total))
    done = compare_starts([column.load() for column in study.columns], [OWN], study.starts, SEED,
                          out, workers=workers, progress=said, command=command)
    (results,) = done.found.values()
    shown = sorted(results.shown(), key=lambda one: one.name)  # found in the order of the runs
    reasons = [(run.label, reason) for run, reason in zip(results.runs, results.reasons,
                                                          strict=True)]
    return Rows(study.name, command, results.samples, SEED,
                {one.name: {"label": one.label, "unit": one.unit} for one in shown},
                {label: {one.name: plain(results.column(one.name, label)) for one in shown}
                 for label in results.labels},
                {label: reasons.count((label, None)) for label in results.labels})


def plain(values: Any) -> list[float | None]:
    """Return values as they are kept: None for one that is not finite."""
    return [float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None for value in values]


def write(rows: Rows, folder: Path) -> Path:
    """Write rows into a folder, a line for each metric of a column."""
    path = make_folder(folder) / f"{rows.study}.json"
    text = json.dumps(asdict(rows), indent=1)
    write_text(path, re.sub(r"\[[^][]*\]", lambda found: " ".join(found[0].split()), text) + "\n")
    return path


def read(folder: Path) -> dict[str, Rows]:
    """Return the rows of all studies of a folder by name."""
    return {path.stem: Rows(**json.loads(path.read_text(encoding="utf-8")))
            for path in sorted(folder.glob("*.json"))}
