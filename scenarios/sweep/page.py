"""The results of a sweep as one HTML page: success, distributions, worst cases, failures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from hierarchy.words import in_words, listed
from scenarios.config.distributions import Distribution
from scenarios.draw.figures.drawing import svg
from scenarios.draw.figures.palette import Look, looks
from scenarios.files import slug
from scenarios.measure.metrics import Metric
from scenarios.sweep import figures
from scenarios.sweep.planning import Plan, Planned
from scenarios.sweep.results import Failure, Results, Worst, compared, summary
from scenarios.sweep.verdict import verdict
from scenarios.templates import render, resource

_FAILURES = 20  # reasons listed


class Again(NamedTuple):
    """How to repeat a run: the file of its scenario, the sample's number, the command."""

    file: str
    sample: int
    command: str


class Cell(NamedTuple):
    """Median and quartiles of a column, how it compares with the first one, whether it is best."""

    text: str
    compared: str
    best: bool


class Shown(NamedTuple):
    """The content of the page for one group of runs."""

    name: str
    title: str
    about: str
    verdict: tuple[str, ...]
    shares: Markup
    failures: list[tuple[Failure, Again]]
    more_failures: int
    spreads: list[tuple[Metric, str, Markup]]          # metric, unit and direction, figure
    worst: list[tuple[Planned, list[str], Again]]
    numbers: list[tuple[str, list[tuple[str, list[Cell]]]]]  # groups of rows: label, cells
    looks: dict[str, Look]


@dataclass(frozen=True)
class Page:
    """The content of a page; `file` is the text of the sweep file, if there is one."""

    plan: Plan
    found: Mapping[str, Results]
    folder: Path
    command: str
    file: str
    versions: Mapping[str, str]

    def html(self) -> str:
        """Return the page; it refers only to files beside it."""
        return str(render(
            "sweep/page.html", sweep=self.plan.sweep, variations=self._variations(),
            refused=self.plan.refused, made_by="sweep" if self.file else "compare --starts",
            style=resource("report/style.css"), counted=self._counted(),
            scenarios=[self._shown(name, one) for name, one in self.found.items()],
            command=self.command, file=self.file, versions=self.versions))

    def worst_runs(self) -> list[Planned]:
        """Return the runs for which the page shows a command."""
        runs = {run.job.key: run for results in self.found.values()
                for run in (*(worst.run for worst in results.worst()),
                            *(failure.run for failure in results.failures()[:_FAILURES]))}
        return list(runs.values())

    def _variations(self) -> dict[str, dict[str, Distribution]]:
        """Return what is sampled by scenario; "" where all share it."""
        sweep = self.plan.sweep
        each = {one.name: (one.variation if sweep.variation else {}) | sweep.parameters
                for one in self.plan.scenarios}
        first, *others = each.values()
        return {"": first} if all(one == first for one in others) else each

    def _counted(self) -> str:
        """Return the numbers of runs and samples, and the resolvers."""
        runs = self.plan.runs
        labels = list(dict.fromkeys(run.label for run in runs))
        under = (f", each under {listed(labels)}"
                 if len(labels) > 1 else f" under {labels[0]}")
        return f"{_count(len(runs), 'run')}: {_count(self.plan.sweep.samples, 'sample')}{under}"

    def _shown(self, name: str, results: Results) -> Shown:
        failures = results.failures()
        return Shown(
            name, *self._about(name), verdict=verdict(results),
            shares=svg(figures.shares(results), f"{results.runs[0].scenario}: shares of runs"),
            failures=[(one, self._again(one.run)) for one in failures[:_FAILURES]],
            more_failures=max(0, len(failures) - _FAILURES), spreads=_spreads(name, results),
            worst=self._worst(results), numbers=_numbers(results), looks=looks(results.labels))

    def _about(self, name: str) -> tuple[str, str]:
        """Return the title and the description of a group."""
        one = next((one for one in self.plan.scenarios if one.name == name), None)
        if one is not None:
            return one.title, one.description
        each = "; ".join(f"{one.name}: {one.title}" for one in self.plan.scenarios)
        return f"{in_words(len(self.plan.scenarios))} scenarios side by side", f"{each}."

    def _worst(self, results: Results) -> list[tuple[Planned, list[str], Again]]:
        """Return each run that is worst in some metrics, with those metrics as text."""
        measures: dict[str, list[str]] = {}
        runs: dict[str, Planned] = {}
        for one in results.worst():
            runs[one.run.job.key] = one.run
            measures.setdefault(one.run.job.key, []).append(_in_full(one))
        return [(run, measures[key], self._again(run)) for key, run in runs.items()]

    def _again(self, run: Planned) -> Again:
        file = f"worst/{name_of(run)}"
        return Again(file, run.sample, shlex.join(["hierarchy", "run", str(self.folder / file)]))


def name_of(run: Planned) -> str:
    """Return the name of the file that has the scenario of a run."""
    return f"{slug(f'{run.scenario}-{run.job.resolver}-{run.sample}')}-{run.job.key[:6]}.toml"


def _spreads(name: str, results: Results) -> list[tuple[Metric, str, Markup]]:
    return [(metric, _direction(metric),
             svg(figures.spread(results, metric), f"{name}: {metric.label}"))
            for metric in results.shown()
            if np.nanmin(results.values[metric.name]) < np.nanmax(results.values[metric.name])]


def _numbers(results: Results) -> list[tuple[str, list[tuple[str, list[Cell]]]]]:
    """Return the spread of each metric under each resolver, by group."""
    return [(group, [(_with_unit(metric), _cells(results, metric)) for metric in metrics])
            for group, metrics in groupby(results.shown(), key=lambda metric: metric.group)]


def _cells(results: Results, metric: Metric) -> list[Cell]:
    best = results.best(metric)
    return [Cell(summary(results, metric, label), compared(results, metric, label), label in best)
            for label in results.labels]


def _with_unit(metric: Metric) -> str:
    return f"{metric.label} [{metric.shown_unit}]" if metric.shown_unit else metric.label


def _in_full(worst: Worst) -> str:
    metric = worst.metric
    others = ", ".join(f"{label} {other.shown()}" for label, other in worst.others.items())
    said = f"{metric.label}: {metric.shown()} {metric.shown_unit}".strip()
    return f"{said} ({others})" if others else said


def _direction(metric: Metric) -> str:
    unit = f"[{metric.shown_unit}]" if metric.shown_unit else ""
    better = {True: "lower is better", False: "higher is better", None: ""}[metric.lower_is_better]
    return " ".join(part for part in (unit, better) if part)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}".replace(",", " ")
