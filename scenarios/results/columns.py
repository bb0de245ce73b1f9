"""Results of a sweep: runs as columns, success rates, worst cases, failures."""

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.words import gathered, listed
from scenarios.measure import statistics
from scenarios.measure.metric import NOTHING, finite
from scenarios.measure.metrics import Metric
from scenarios.measure.runs import Cell, Row, by_name, grouped
from scenarios.measure.statistics import Paired, paired, wilson
from scenarios.results.plan import Job, Outcome, Plan

# What is weighed in the verdict.
_WEIGHED = ("position_error_median_settled", "body_distance_min", "ee_distance_min",
            "cone_violation_max", "speed_max", "acceleration_max")
# Criteria, and the values of metrics with which a run does not meet them; 1e-6 rad are rounding.
_BROKEN: dict[str, dict[str, tuple[Callable[..., NDArray[np.bool_]], float]]] = {
    "Touched nothing": {"body_distance_min": (np.less_equal, 0.0),
                        "ee_distance_min": (np.less_equal, 0.0),
                        "contact_ticks": (np.greater, 0.0)},
    "Kept the joint limits": {"joint_limit_excess": (np.greater, 1e-6)},
    "Every tick solved": {"ticks_not_solved": (np.greater, 0.0)},
    "Kept the distance asked for": {"body_below_share": (np.greater, 0.0),
                                    "ee_below_share": (np.greater, 0.0)}}
_NUMBER = re.compile(r"\d+(\.\d+)?(e[+-]?\d+)?")


class Share(NamedTuple):
    """A share of runs."""

    met: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share after Wilson, between 0 and 1."""
        return wilson(*self)

    def __str__(self) -> str:
        return f"{self.met} of {self.of}"


@dataclass(frozen=True)
class Failure:
    """A reason why runs stopped early or failed, the first such run, and their number."""

    reason: str
    run: Job
    count: int


@dataclass(frozen=True)
class Results:
    """Runs that stand side by side, in the order of the plan; unknown values are NaN.

    Those are the runs of one scenario under its resolvers, or, with one resolver, of all scenarios.
    """

    runs: tuple[Job, ...]
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

    @cached_property
    def samples(self) -> int:
        """Number of samples."""
        return 1 + max(run.sample for run in self.runs)

    @cached_property
    def _ended(self) -> NDArray[np.bool_]:
        return np.array([reason is None for reason in self.reasons])

    def column(self, name: str, label: str) -> NDArray[np.float64]:
        """Return a metric under a resolver by sample, (samples,)."""
        return self._by_sample(self.values[name], label)

    def compared(self, name: str, label: str) -> NDArray[np.float64]:
        """Return a column with NaN for runs that stopped early: their numbers cover less time."""
        return self._by_sample(np.where(self._ended, self.values[name], np.nan), label)

    def _by_sample(self, values: NDArray[Any], label: str) -> NDArray[np.float64]:
        found = np.full(self.samples, np.nan)
        for i in np.flatnonzero(self._of[label]):
            found[self.runs[i].sample] = values[i]
        return found

    def paired(self, name: str, label: str) -> Paired:
        """Return the paired differences of a metric from the first column."""
        return paired(self.compared(name, self.labels[0]), self.compared(name, label))

    def best(self, metric: Metric, of: int = 1) -> tuple[str, ...]:
        """Return the labels that are better than all others; empty where a test cannot tell.

        of : number of metrics that are asked for at once, for which the level is corrected.
        """
        if metric.lower_is_better is None:
            return ()
        return statistics.best({label: self.compared(metric.name, label) for label in self.labels},
                               metric.lower_is_better, statistics.LEVEL / of)

    def shares(self) -> dict[str, dict[str, Share]]:
        """Return the share of each resolver's runs that meet a criterion, by criterion and label.

        Those are the criteria that any run has metrics of. A run without them meets a criterion if
        it reached its end: it asked for no distance, or its robot has no limits.
        """
        met = {"Reached the end": self._ended}
        for what, of in _BROKEN.items():
            if found := [(self.values[name], *of[name]) for name in of if name in self.values]:
                known = np.any([np.isfinite(values) for values, *_ in found], axis=0)
                met[what] = (known | self._ended) & ~np.any(
                    [beyond(values, limit) for values, beyond, limit in found], axis=0)
        met["All of the above"] = np.all(list(met.values()), axis=0)
        return {what: {label: Share(int((runs & of).sum()), int(of.sum()))
                       for label, of in self._of.items()} for what, runs in met.items()}

    def shown(self) -> list[Metric]:
        """Return the metrics to compare: those of any run, except computing times.

        Computing times depend on the load of the machine.
        """
        return [metric for name, metric in self.metrics.items()
                if metric.group != "Computing" and np.isfinite(self.values[name]).any()]

    def varied(self) -> list[Metric]:
        """Return those to compare that differ between runs by more than rounding."""
        return [metric for metric in self.shown()
                if np.nanmax(values := self.values[metric.name]) - np.nanmin(values) > NOTHING]

    def worst(self) -> list[tuple[list[Metric], Job]]:
        """Return the runs that are the worst in metrics with a direction that are `varied`."""
        found: dict[str, tuple[list[Metric], Job]] = {}
        for metric in self.varied():
            values = self.values[metric.name]
            if metric.lower_is_better is None:
                continue
            i = int(np.nanargmax(values) if metric.lower_is_better else np.nanargmin(values))
            found.setdefault(self.runs[i].key, ([], self.runs[i]))[0].append(
                valued(metric, values[i]))
        return list(found.values())

    def alike(self) -> list[list[str]]:
        """Return the labels, together where no metric of any sample differs, nor how it ended."""
        found: list[list[str]] = []
        ends = np.unique([str(reason) for reason in self.reasons], return_inverse=True)[1]
        each = [ends, *(self.values[metric.name] for metric in self.shown())]
        for label in self.labels:
            like = (group for group in found if not any(
                paired(self._by_sample(one, group[0]), self._by_sample(one, label)).differ
                for one in each))  # a metric that a resolver does not have differs in nothing
            if (group := next(like, [])) == []:
                found.append(group)
            group.append(label)
        return found

    def failures(self) -> list[Failure]:
        """Return why runs failed; reasons that differ only in numbers are merged by resolver."""
        found = gathered(((run.label, _NUMBER.sub("#", reason)), (reason, run)) for run, reason in
                         zip(self.runs, self.reasons, strict=True) if reason is not None)
        return sorted((Failure(*of[0], len(of)) for of in found.values()),
                      key=lambda one: -one.count)


def verdict(results: Results) -> list[str]:
    """Return three lines of fixed form: what was not met, what is the same, what is best."""
    met = dict(list(results.shares().items())[:-1])
    missed = [f"{name}: " + ", ".join(f"{label} {share}" for label, share in shares.items())
              for name, shares in met.items()
              if any(share.met < share.of for share in shares.values())]
    lines = [f"Not in every run: {'; '.join(missed)}." if missed else
             f"In all {len(results.runs)} runs: {listed([name.lower() for name in met])}."]
    if same := [group for group in results.alike() if len(group) > 1]:
        lines.append(f"The same in every sample: {'; '.join(map(listed, same))}.")
    if len(results.labels) > 1:
        weighed = [metric for metric in results.shown() if metric.name in _WEIGHED]
        best = {metric.label: results.best(metric, len(weighed)) for metric in weighed}
        said = "; ".join(f"{name}: {listed(who)}" for name, who in best.items() if who)
        lines.append(f"Best beyond chance: {said or 'none'}.")
    return lines


def valued(metric: Metric, value: float) -> Metric:
    """Return a metric with a value, None for NaN."""
    return dataclasses.replace(metric, value=finite(value))


def rows(results: Results) -> list[Row]:
    """Return a row for each metric: median and quartiles, and how they compare with the first."""
    return grouped([Row(metric.label, metric.shown_unit, metric.group, metric.name, tuple(
        Cell(_summary(results, metric, label), "best" if label in best else "",
             more="" if label == results.labels[0] else str(results.paired(metric.name, label)))
        for label in results.labels))
        for metric in results.shown() for best in [results.best(metric)]])


def _summary(results: Results, metric: Metric, label: str) -> str:
    """Return "median [lower quartile, upper quartile]" of a metric under a resolver."""
    found = statistics.spread(results.column(metric.name, label))
    if not found:
        return "–"
    median, low, high = (valued(metric, found[key]).shown() for key in ("median", "lower", "upper"))
    return median if low == high else f"{median} [{low}, {high}]"


def results(plan: Plan, kept: Mapping[str, Outcome]) -> dict[str, Results]:
    """Return the results of each group of runs from their outcomes by key.

    A group is a scenario; with one resolver and several scenarios there is one group, named after
    the resolver, whose columns are the scenarios.
    """
    found = {}
    for name, runs in gathered((run.group, run) for run in plan.runs).items():
        each = [{one.name: one for one in kept[run.key].metrics if one.value is not None}
                for run in runs]
        metrics = by_name(each)
        values = {metric: np.array([known[metric].value if metric in known else np.nan
                                    for known in each], dtype=float) for metric in metrics}
        found[name] = Results(tuple(runs), tuple(kept[run.key].reason for run in runs), metrics,
                              values)
    return found
