"""The page of a sweep: success, numbers, distributions, worst cases, failures."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hierarchy.problem import Array
from hierarchy.words import counted, in_words, listed
from scenarios.config import Scenario
from scenarios.config.validation import unit_at
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK, svg
from scenarios.draw.figures.palette import looks
from scenarios.files import slug
from scenarios.measure.metrics import Metric
from scenarios.measure.run_folder import versions
from scenarios.measure.runs import caveats
from scenarios.recording.facts import resolver_facts
from scenarios.results.columns import Results, rows, verdict
from scenarios.results.plan import Job, Plan
from scenarios.templates import render, resource

_FAILURES = 20  # reasons listed
_NARROW = 18  # letters of a label beside a narrow figure
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
    samples = len({run.sample for run in plan.runs})  # without those drawn twice
    count = f"{counted(len(plan.runs), 'run')}: {counted(samples, 'sample')}, each under {labels}"
    each = {one.name: [  # key, distribution and unit of each parameter
        (key, str(how), unit_at(Scenario, key.split("."))) for key, how in (
            (one.variation if sweep.variation else {}) | sweep.parameters).items()]
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
    marked = caveats({run.label: resolver_facts(run.load()) for run in
                      {run.label: run for run in results.runs}.values()})
    one = next((one for one in plan.scenarios if one.name == name), None)
    each = "; ".join(f"{one.name}: {one.title}" for one in plan.scenarios
                     if one.name in results.labels)
    return {
        "name": name, "title": one.title if one else
        f"{in_words(len(results.labels))} scenarios side by side",
        "about": one.description if one else f"{each}.", "verdict": verdict(results),
        "shares": svg(_shares(results), f"{name}: shares of runs"),
        "failures": [(one, *_again(one.run, folder)) for one in failures[:_FAILURES]],
        "more_failures": max(0, len(failures) - _FAILURES),
        "spreads": [(metric, _BETTER[metric.lower_is_better],
                     svg(_spread(results, metric), f"{name}: {metric.label}"))
                    for metric in results.varied()],
        "worst": [(*one, *_again(one[1], folder)) for one in results.worst()],
        "numbers": rows(results), "looks": looks(results.labels),
        "heads": {label: [("quiet", ", ".join(text))] if text else []
                  for label, text in marked.items()}}


def _again(run: Job, folder: Path) -> tuple[str, str]:
    """Return the file of a run's scenario and the command that repeats it."""
    file = f"worst/{name_of(run)}"
    return file, shlex.join(["hierarchy", "run", str(folder / file)])


def _shares(results: Results) -> Figure:
    """Draw the share of runs that meet each criterion under each resolver, with its interval."""
    criteria, labels = results.shares(), results.labels
    rows = len(criteria) * (len(labels) + 1)
    fig, (ax,) = drawing.figure(width=5.4, height=0.5 + 0.2 * rows)
    colours = drawing.colours(labels)
    for i, (criterion, by) in enumerate(criteria.items()):
        top = i * (len(labels) + 1)
        ax.text(0.0, top - 0.62, criterion, fontweight="bold", va="center", fontsize=9)
        for j, (label, share) in enumerate(by.items()):
            y, colour = top + j + 0.15, colours[label]
            ax.hlines(y, 0.0, 1.0, color=INK, alpha=0.1, lw=5.0)
            ax.hlines(y, *share.interval, color=colour, lw=5.0, alpha=0.4)
            ax.plot([share.met / share.of], [y], "o", color=colour, ms=6.0)
            ax.text(1.04, y, f"{share}", va="center", fontsize=8)
            ax.text(-0.03, y, label, va="center", ha="right", fontsize=8)
    ax.set_ylim(rows - 1.2, -1.1)
    ax.set_xlim(-0.02, 1.02)
    ax.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0 %", "25 %", "50 %", "75 %", "100 %"])
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.grid(False)
    return fig


def _spread(results: Results, metric: Metric) -> Figure:
    """Draw the distribution of a metric over the samples, one row per resolver.

    Box: quartiles with the median; line: 5th to 95th percentile; dots: smallest and largest value,
    where they are near. How many lie beyond the axis stands at its end.
    """
    columns = {label: results.column(metric.name, label) for label in results.labels}
    known = {label: metric.scale * values[np.isfinite(values)]
             for label, values in columns.items() if np.isfinite(values).any()}
    names = [fill(label, _NARROW) for label in known]
    lines = max(name.count("\n") for name in names) + 1
    fig, (ax,) = drawing.figure(width=3.9, height=0.5 + max(0.3, 0.17 * lines) * len(known))
    colours = drawing.colours(results.labels)
    low, high = _limits(list(known.values()))
    for y, (label, values) in enumerate(known.items()):
        p5, q1, median, q3, p95 = np.percentile(values, [5.0, 25.0, 50.0, 75.0, 95.0])
        ax.hlines(y, p5, p95, color=colours[label], lw=1.2)
        ax.barh(y, q3 - q1, left=q1, height=0.56, color=colours[label], alpha=0.4, lw=0)
        ax.vlines(median, y - 0.28, y + 0.28, color=colours[label], lw=2.4)
        seen = values[(values >= low) & (values <= high)]
        ax.plot([seen.min(), seen.max()], [y, y], ".", color=colours[label], ms=4.5)
        if beyond := values.size - seen.size:
            farthest = max(values, key=lambda value: max(low - value, value - high))
            ax.text(1.0, y, f"{beyond} beyond, to {farthest:.3g}", fontsize=7.5,
                    ha="right", va="bottom", transform=ax.get_yaxis_transform())
    ax.set_yticks(range(len(known)), names)
    ax.set_ylim(len(known) - 0.5, -0.5)
    ax.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.spines["left"].set_visible(False)
    ax.locator_params(axis="x", nbins=4)
    return fig


def _limits(rows: list[Array], reach: float = 2.0) -> tuple[float, float]:
    """Return the ends of the values near the middle 90 % of all rows.

    Those are at most `reach` times its width away. The ends are at least a hundredth of the
    values apart: what differs by less is drawn as the same, on an axis without an offset.
    """
    values = np.concatenate(rows)
    low = min(float(np.percentile(row, 5.0)) for row in rows)
    high = max(float(np.percentile(row, 95.0)) for row in rows)
    far = reach * (high - low) or reach * max(abs(high), 1e-12)
    near = values[(values >= low - far) & (values <= high + far)]
    low, high = float(near.min()), float(near.max())
    room = max(0.0, 0.01 * (max(-low, high) or 1.0) - (high - low)) / 2.0
    return low - room, high + room
