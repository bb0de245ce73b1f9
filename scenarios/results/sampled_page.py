"""The page of a sweep: success, numbers, distributions, worst cases, failures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hierarchy.words import counted, in_words, listed
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import svg
from scenarios.draw.figures.palette import looks
from scenarios.files import slug
from scenarios.measure.metrics import Metric
from scenarios.measure.run_folder import versions
from scenarios.results import curves
from scenarios.results.columns import Results, flags, rows, verdict
from scenarios.results.plan import Plan
from scenarios.results.run import Job
from scenarios.templates import render, resource

_FAILURES = 20  # reasons listed
_BETTER = {True: "lower is better", False: "higher is better", None: ""}
_ABOUT_ROWS = ("After an interruption, the same command continues. Computing times are only in the "
               "table, since many runs shared the machine.")


def sampled_page(plan: Plan, found: Mapping[str, Results], folder: Path, command: str,
                 file: str) -> str:
    """Return the page; it refers only to files beside it.

    file : the text of the sweep file, "" if there is none.
    """
    sweep, made_by = plan.sweep, "sweep" if file else "compare --starts"
    labels = listed(list(dict.fromkeys(run.label for run in plan.runs)))
    count = (f"{counted(len(plan.runs), 'run')}: {counted(sweep.samples, 'sample')}, each under "
             f"{labels}")
    each = {one.name: (one.variation if sweep.variation else {}) | sweep.parameters
            for one in plan.scenarios}
    first, *others = each.values()
    with drawing.styled(drawing.SCREEN):
        shown = [_shown(name, one, plan, folder) for name, one in found.items()]
    return str(render(
        "results/sampled_page.html", title=f"{sweep.name}: {made_by}", sweep=sweep,
        variations={"": first} if all(one == first for one in others) else each,
        refused=plan.refused, made_by=made_by, unfinished="",
        style=resource("results/style.css"), script=resource("results/page.js"), counted=count,
        scenarios=shown, about_rows=_ABOUT_ROWS, command=command, file=file, versions=versions()))


def worst_runs(found: Mapping[str, Results]) -> list[Job]:
    """Return the runs for which the page shows a command."""
    runs = {run.key: run for results in found.values()
            for run in (*(run for _, run in results.worst()),
                        *(failure.run for failure in results.failures()[:_FAILURES]))}
    return list(runs.values())


def name_of(run: Job) -> str:
    """Return the name of the file that has the scenario of a run."""
    return f"{slug(f'{run.scenario}-{run.resolver}-{run.sample}')}-{run.key[:6]}.toml"


def _shown(name: str, results: Results, plan: Plan, folder: Path) -> dict[str, Any]:
    """Return the content of the page for one group of runs."""
    failures = results.failures()
    marked = flags({label: next(run for run in results.runs if run.label == label).load()
                    for label in results.labels})
    worst: dict[str, list[Metric]] = {}
    for metric, run in results.worst():
        worst.setdefault(run.key, []).append(metric)
    of_key = {run.key: run for run in results.runs}
    one = next((one for one in plan.scenarios if one.name == name), None)
    each = "; ".join(f"{one.name}: {one.title}" for one in plan.scenarios)
    return {
        "name": name, "title": one.title if one else
        f"{in_words(len(plan.scenarios))} scenarios side by side",
        "about": one.description if one else f"{each}.", "verdict": verdict(results),
        "shares": svg(curves.shares(results), f"{name}: shares of runs"),
        "failures": [(one, *_again(one.run, folder)) for one in failures[:_FAILURES]],
        "more_failures": max(0, len(failures) - _FAILURES),
        "spreads": [(metric, _BETTER[metric.lower_is_better],
                     svg(curves.spread(results, metric), f"{name}: {metric.label}"))
                    for metric in results.shown() if np.nanmin(results.values[metric.name])
                    < np.nanmax(results.values[metric.name])],
        "worst": [(metrics, of_key[key], *_again(of_key[key], folder))
                  for key, metrics in worst.items()],
        "numbers": rows(results), "looks": looks(results.labels),
        "heads": {label: [("quiet", text)] if text else [] for label, text in marked.items()}}


def _again(run: Job, folder: Path) -> tuple[str, str]:
    """Return the file of a run's scenario and the command that repeats it."""
    file = f"worst/{name_of(run)}"
    return file, shlex.join(["hierarchy", "run", str(folder / file)])
