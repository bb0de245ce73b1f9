"""Results of a sweep: runs as columns, success rates, worst cases, failures."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.measure import statistics
from scenarios.measure.metrics import Metric
from scenarios.measure.statistics import Paired, Spread, paired, wilson
from scenarios.sweep.planning import Plan, Planned
from scenarios.sweep.store import Store, metrics_of

_TOLERANCE = 1e-6  # [rad] beyond a joint limit that still counts as within it


@dataclass(frozen=True)
class Share:
    """A share of runs, with its 95 % Wilson interval."""

    met: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share, between 0 and 1."""
        return wilson(self.met, self.of)

    def __str__(self) -> str:
        return f"{self.met} of {self.of}"


@dataclass(frozen=True)
class Criterion:
    """A success criterion: its name, and whether each run meets it."""

    label: str
    met: NDArray[np.bool_]


@dataclass(frozen=True)
class Worst:
    """The run with the worst value of a metric, and the values of the others on that sample."""

    metric: Metric
    run: Planned
    others: dict[str, Metric]


@dataclass(frozen=True)
class Failure:
    """A reason why runs stopped early or failed, the first such run, and their number."""

    reason: str
    run: Planned
    count: int


@dataclass(frozen=True)
class Results:
    """Runs that stand side by side, in the order of the plan; unknown values are NaN.

    Those are the runs of one scenario under its resolvers, or, with one resolver, of all scenarios.
    """

    runs: tuple[Planned, ...]
    reasons: tuple[str | None, ...]
    metrics: dict[str, Metric]
    values: dict[str, NDArray[np.float64]]

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Labels of the resolvers in the requested order."""
        return tuple(dict.fromkeys(run.label for run in self.runs))

    @cached_property
    def _of(self) -> dict[str, NDArray[np.bool_]]:
        names = np.array([run.label for run in self.runs])
        return {label: names == label for label in self.labels}

    def of(self, name: str, label: str) -> NDArray[np.float64]:
        """Return the known values of a metric under a resolver."""
        values = self.values[name][self._of[label]]
        return np.asarray(values[np.isfinite(values)])

    @cached_property
    def samples(self) -> int:
        """Number of samples."""
        return 1 + max(run.sample for run in self.runs)

    def column(self, name: str, label: str) -> NDArray[np.float64]:
        """Return a metric under a resolver by sample, (samples,)."""
        found = np.full(self.samples, np.nan)
        for i in np.flatnonzero(self._of[label]):
            found[self.runs[i].sample] = self.values[name][i]
        return found

    def spread(self, name: str, label: str) -> Spread | None:
        """Return the spread of a metric under a resolver; None if it has no value."""
        return statistics.spread(self.column(name, label))

    def paired(self, name: str, label: str, first: str | None = None) -> Paired:
        """Return the paired differences of a metric from a column, by default the first."""
        return paired(self.column(name, first or self.labels[0]), self.column(name, label))

    def best(self, metric: Metric) -> tuple[str, ...]:
        """Return the labels that are better than all others; empty where a test cannot tell."""
        if metric.lower_is_better is None:
            return ()
        return statistics.best({label: self.column(metric.name, label) for label in self.labels},
                               metric.lower_is_better)

    def share(self, criterion: Criterion, label: str) -> Share:
        """Return the share of a resolver's runs that meet a criterion."""
        return Share(int((criterion.met & self._of[label]).sum()), int(self._of[label].sum()))

    def criteria(self, tolerance: float = _TOLERANCE) -> list[Criterion]:
        """Return the criteria that can be judged; a failed run meets none.

        Up to `tolerance` [rad] beyond a joint limit counts as within it.
        """
        finished = np.array([reason is None for reason in self.reasons])
        found = [Criterion("Reached the end", finished)]
        near = [self.values[name] for name in ("body_distance_min", "ee_distance_min")
                if name in self.values]
        contacts = [self.values["contact_ticks"]] if "contact_ticks" in self.values else []
        if near or contacts:
            found.append(Criterion("Touched nothing", np.all(
                [*(values > 0.0 for values in near), *(values == 0.0 for values in contacts)],
                axis=0)))
        for label, name, most in (("Kept the joint limits", "joint_limit_excess", tolerance),
                                  ("Every tick solved", "ticks_not_solved", 0.0)):
            if name in self.values:
                found.append(Criterion(label, self.values[name] <= most))
        return [*found, Criterion("All of the above", np.all([one.met for one in found], axis=0))]

    def shown(self) -> list[Metric]:
        """Return the metrics to compare: those of any run, except computing times.

        Computing times depend on the load of the machine.
        """
        return [metric for name, metric in self.metrics.items()
                if metric.group != "Computing" and np.isfinite(self.values[name]).any()]

    def worst(self) -> list[Worst]:
        """Return the worst run for each metric that has a direction and differs between runs."""
        found = []
        for metric in self.shown():
            values = self.values[metric.name]
            if metric.lower_is_better is None or np.nanmin(values) == np.nanmax(values):
                continue
            i = int(np.nanargmax(values) if metric.lower_is_better else np.nanargmin(values))
            others = {run.label: valued(metric, values[j]) for j, run in enumerate(self.runs)
                      if j != i and run.sample == self.runs[i].sample}
            found.append(Worst(valued(metric, values[i]), self.runs[i], others))
        return found

    def failures(self) -> list[Failure]:
        """Return why runs failed; reasons that differ only in numbers are merged by resolver."""
        found: dict[tuple[str, str], Failure] = {}
        for run, reason in zip(self.runs, self.reasons, strict=True):
            if reason is not None:
                kind = run.label, re.sub(r"\d+(\.\d+)?(e[+-]?\d+)?", "#", reason)
                first = found.get(kind, Failure(reason, run, 0))
                found[kind] = dataclasses.replace(first, count=first.count + 1)
        return sorted(found.values(), key=lambda one: -one.count)


def valued(metric: Metric, value: float) -> Metric:
    """Return a metric with a value, None for NaN."""
    return dataclasses.replace(metric, value=float(value) if math.isfinite(value) else None)


def summary(results: Results, metric: Metric, label: str) -> str:
    """Return "median [lower quartile, upper quartile]" of a metric under a resolver."""
    found = results.spread(metric.name, label)
    if found is None:
        return "–"
    median, low, high = (valued(metric, value).shown()
                         for value in (found.median, found.lower, found.upper))
    return median if low == high else f"{median} [{low}, {high}]"


def compared(results: Results, metric: Metric, label: str) -> str:
    """Return how a metric under a resolver compares with the first column; "" for that one."""
    return "" if label == results.labels[0] else str(results.paired(metric.name, label))


def joined(plan: Plan, store: Store) -> Any:
    """Return the table of all runs of a plan: scenario, resolver, sampled values and outcome.

    Raises KeyError if a run of the plan has not been made.
    """
    import pyarrow as pa

    kept = store.table()
    place = {key: i for i, key in enumerate(kept["key"].to_pylist())}
    kept = kept.take(pa.array([place[run.job.key] for run in plan.runs], pa.int64()))
    asked = {"scenario": [run.scenario for run in plan.runs],
             "resolver": [run.job.resolver for run in plan.runs],
             "sample": [run.sample for run in plan.runs]}
    for key in dict.fromkeys(key for run in plan.runs for key in run.values):
        asked[key] = _of_one_type([run.values.get(key) for run in plan.runs])
    table = pa.table(asked)
    for field in kept.schema:
        table = table.append_column(field, kept[field.name])
    return table


def results(plan: Plan, table: Any) -> dict[str, Results]:
    """Return the results of each group of runs from the table that `joined` returns.

    A group is a scenario; with one resolver and several scenarios there is one group, named after
    the resolver, whose columns are the scenarios.
    """
    metrics = metrics_of(table)
    columns = {name: _floats(table[name]) for name in metrics}
    faults, errors = table["fault"].to_pylist(), table["error"].to_pylist()
    names = np.array([run.group for run in plan.runs])
    found = {}
    for name in dict.fromkeys(names.tolist()):
        chosen = np.flatnonzero(names == name)
        known = {key: metric for key, metric in metrics.items()
                 if np.isfinite(columns[key][chosen]).any()}
        found[name] = Results(tuple(plan.runs[i] for i in chosen),
                              tuple(errors[i] or faults[i] for i in chosen), known,
                              {key: columns[key][chosen] for key in known})
    return found


def _floats(column: Any) -> NDArray[np.float64]:
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=float)


def _of_one_type(values: Sequence[Any]) -> list[Any]:
    """Return values of one type for a column: unchanged, or as text if types differ."""
    same = len({type(value) for value in values if value is not None}) == 1
    return list(values) if same else [None if value is None else str(value) for value in values]
