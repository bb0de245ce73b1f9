"""The rows of a study: every metric of every start, kept as JSON beside the documents."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmark.reproduce.studies import SEED, Study
from benchmark.reproduce.watched import METRICS, PAIR, PIVOT, jobs, measured
from hierarchy.errors import HierarchyError
from scenarios.config.scenario import OWN
from scenarios.files import write_text
from scenarios.measure.metrics import Metric
from scenarios.measure.statistics import Paired, Spread, paired, spread
from scenarios.results.columns import Results, valued
from scenarios.results.run import outcome
from scenarios.results.sampled import Progress, Workers, compare_starts, complete
from scenarios.results.store import Store

Array = NDArray[np.float64]
_DIGITS = 6  # kept of each value


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


def rows_of_study(study: Study, out: Path, workers: Workers, progress: Progress | None = None
                  ) -> Rows:
    """Run a study and return its rows; runs that `out` has are not repeated.

    Raises what `compare_starts` raises.
    """
    if not study.columns:
        return measured_rows(study, out, workers, progress)
    command = f"hierarchy reproduce {study.name}"
    said = progress and (lambda name, done, total: progress(study.name, done, total))
    done = compare_starts([column.load() for column in study.columns], [OWN], study.starts, SEED,
                          out, workers=workers, progress=said, command=command)
    (results,) = done.found.values()
    return rows_of(study.name, results, command, SEED)


def rows_of(study: str, results: Results, command: str, seed: int) -> Rows:
    """Return the rows of a study from its results."""
    shown = sorted(results.shown(), key=lambda one: one.name)  # found in the order of the runs
    metrics: dict[str, dict[str, object]] = {
        one.name: {"label": one.label, "unit": one.unit} for one in shown}
    values = {label: {one.name: plain(results.column(one.name, label)) for one in shown}
              for label in results.labels}
    ended = {label: sum(run.label == label and reason is None for run, reason in zip(
        results.runs, results.reasons, strict=True)) for label in results.labels}
    return Rows(study, command, results.samples, seed, metrics, values, ended)


def measured_rows(study: Study, out: Path, workers: Workers, progress: Progress | None) -> Rows:
    """Run the scenario from each start, and return what is measured in its ticks."""
    asked, store = jobs(study, SEED), Store(out)
    with store.opened():
        complete(asked, store, workers, study.name, progress,
                 partial(outcome, measured=partial(measured, study)))
        kept = store.outcomes()
    runs = [kept[job.key] for job in asked]
    found = [{one.name: one.value for one in run.metrics} for run in runs]
    metrics = PAIR if study.pairs else PIVOT
    values = {column: {name: plain(np.array([run.get(f"{column} {name}") for run in found],
                                            dtype=float)) for name in metrics}
              for column in study.names}
    ended = sum(run.reason is None for run in runs)
    return Rows(study.name, f"hierarchy reproduce {study.name}", study.starts, SEED,
                {name: {**METRICS[name]} for name in metrics}, values, dict.fromkeys(values, ended))


def plain(values: Array) -> list[float | None]:
    """Return values as they are kept: None for one that is not finite."""
    return [float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
            for value in values.tolist()]


def write(rows: Rows, folder: Path) -> Path:
    """Write rows into a folder, a line for each metric of a column."""
    path = folder / f"{rows.study}.json"
    folder.mkdir(parents=True, exist_ok=True)
    write_text(path, _text(rows))
    return path


def _text(rows: Rows) -> str:
    """Return rows as JSON, the values of a metric on one line."""
    data = asdict(rows)
    columns = data.pop("values")
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in data.items()]
    lines += [f'"values": {{\n{_nested(columns)}\n}}']
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _nested(columns: Mapping[str, Mapping[str, object]]) -> str:
    each = (",\n".join(f"    {json.dumps(name)}: {json.dumps(values)}"
                       for name, values in metrics.items()) for metrics in columns.values())
    return ",\n".join(f"  {json.dumps(column)}: {{\n{text}\n  }}"
                      for column, text in zip(columns, each, strict=True))


def read(folder: Path) -> dict[str, Rows]:
    """Return the rows of all studies of a folder by name."""
    return {path.stem: Rows(**json.loads(path.read_text(encoding="utf-8")))
            for path in sorted(folder.glob("*.json"))}
