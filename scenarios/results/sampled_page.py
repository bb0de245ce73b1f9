"""The page of a sweep: success, numbers, distributions, worst cases, failures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from hierarchy.words import counted, in_words, listed
from scenarios.config.distributions import Distribution
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import svg
from scenarios.draw.figures.palette import looks
from scenarios.files import slug
from scenarios.measure.metrics import Metric
from scenarios.results import spreads
from scenarios.results.columns import Results, Worst, compared, flags, summary, verdict
from scenarios.results.plan import Plan, Planned
from scenarios.results.tables import Cell
from scenarios.templates import render, resource

_FAILURES = 20  # reasons listed
_ABOUT_ROWS = ("After an interruption, the same command continues. Computing times are only in the "
               "table, since many runs shared the machine.")


class Again(NamedTuple):
    """How to repeat a run: the file of its scenario, the sample's number, the command."""

    file: str
    sample: int
    command: str


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
        sweep, made_by = self.plan.sweep, "sweep" if self.file else "compare --starts"
        with drawing.styled(drawing.SCREEN):
            shown = [self._shown(name, one) for name, one in self.found.items()]
        return str(render(
            "results/sampled_page.html", title=f"{sweep.name}: {made_by}", sweep=sweep,
            variations=self._variations(), refused=self.plan.refused, made_by=made_by,
            style=resource("results/style.css"), script=resource("results/page.js"),
            unfinished="", counted=self._counted(), scenarios=shown, about_rows=_ABOUT_ROWS,
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
        labels = listed(list(dict.fromkeys(run.label for run in self.plan.runs)))
        return (f"{counted(len(self.plan.runs), 'run')}: "
                f"{counted(self.plan.sweep.samples, 'sample')}, each under {labels}")

    def _shown(self, name: str, results: Results) -> dict[str, Any]:
        """Return the content of the page for one group of runs."""
        failures = results.failures()
        marked = flags({run.label: run.job.load() for run in results.firsts()})
        return {
            "name": name, **self._about(name), "verdict": verdict(results),
            "shares": svg(spreads.shares(results), f"{name}: shares of runs"),
            "failures": [(one, self._again(one.run)) for one in failures[:_FAILURES]],
            "more_failures": max(0, len(failures) - _FAILURES), "spreads": _spreads(name, results),
            "worst": self._worst(results), "numbers": _numbers(results),
            "heads": {label: [("quiet", text)] if text else [] for label, text in marked.items()},
            "looks": looks(results.labels)}

    def _about(self, name: str) -> dict[str, str]:
        """Return the title and the description of a group."""
        one = next((one for one in self.plan.scenarios if one.name == name), None)
        if one is not None:
            return {"title": one.title, "about": one.description}
        each = "; ".join(f"{one.name}: {one.title}" for one in self.plan.scenarios)
        return {"title": f"{in_words(len(self.plan.scenarios))} scenarios side by side",
                "about": f"{each}."}

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
        return Again(file, run.job.sample,
                     shlex.join(["hierarchy", "run", str(self.folder / file)]))


def name_of(run: Planned) -> str:
    """Return the name of the file that has the scenario of a run."""
    job = run.job
    return f"{slug(f'{job.scenario}-{job.resolver}-{job.sample}')}-{job.key[:6]}.toml"


def _spreads(name: str, results: Results) -> list[tuple[Metric, str, Markup]]:
    return [(metric, _direction(metric),
             svg(spreads.spread(results, metric), f"{name}: {metric.label}"))
            for metric in results.shown()
            if np.nanmin(results.values[metric.name]) < np.nanmax(results.values[metric.name])]


def _numbers(results: Results) -> dict[str, list[tuple[str, str, list[Cell]]]]:
    """Return the spread of each metric under each resolver, by group."""
    found: dict[str, list[tuple[str, str, list[Cell]]]] = {}
    for metric in results.shown():
        found.setdefault(metric.group, []).append(
            (metric.label, metric.shown_unit, _cells(results, metric)))
    return found


def _cells(results: Results, metric: Metric) -> list[Cell]:
    best = results.best(metric)
    return [Cell(summary(results, metric, label), "best" if label in best else "",
                 more=compared(results, metric, label)) for label in results.labels]


def _in_full(worst: Worst) -> str:
    metric = worst.metric
    others = ", ".join(f"{label} {other.shown()}" for label, other in worst.others.items())
    said = f"{metric.label}: {metric.shown()} {metric.shown_unit}".strip()
    return f"{said} ({others})" if others else said


def _direction(metric: Metric) -> str:
    unit = f"[{metric.shown_unit}]" if metric.shown_unit else ""
    better = {True: "lower is better", False: "higher is better", None: ""}[metric.lower_is_better]
    return " ".join(part for part in (unit, better) if part)
