"""What a sweep comes to, as one HTML page: verdict, shares, spread, worst cases, failures."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from string import Template

import numpy as np

from scenarios import drawing
from scenarios.folders import slug
from scenarios.metrics import Metric
from scenarios.sweep import figures
from scenarios.sweep.planning import Plan, Planned
from scenarios.sweep.results import Results, summary
from scenarios.sweep.verdict import verdict

_FAILURES = 20  # reasons listed


@dataclass(frozen=True)
class Page:
    """All that a page is made of; `file` is the sweep's file, `folder` as the user named it."""

    plan: Plan
    found: Mapping[str, Results]
    folder: Path
    command: str
    file: str
    versions: Mapping[str, str]

    def html(self) -> str:
        """Return the page; it refers to nothing but files beside it."""
        sections = [self._head(), *(self._scenario(name) for name in self.found)]
        return Template(_resource("sweep", "page.html")).substitute(
            title=escape(f"{self.plan.sweep.name}: a sweep"),
            style=_resource("report", "style.css"), sections="\n".join(sections),
            command=escape(self.command), file=escape(self.file),
            versions=_pairs(self.versions))

    def worst_runs(self) -> list[Planned]:
        """Return the runs that the page has a command for."""
        runs = {run.job.key: run for results in self.found.values()
                for run in (*(worst.run for worst in results.worst()),
                            *(failure.run for failure in results.failures()[:_FAILURES]))}
        return list(runs.values())

    def _head(self) -> str:
        sweep, runs = self.plan.sweep, self.plan.runs
        labels = dict.fromkeys(run.label for run in runs)
        varied = "".join(f"<tr><th><code>{escape(key)}</code></th><td>{escape(str(how))}</td></tr>"
                         for key, how in sweep.parameters.items())
        refused = "".join(f'<p class="quiet">{escape(said)}.</p>' for said in self.plan.refused)
        table = (f'<div class="scroll"><table class="plain"><tbody>{varied}</tbody></table></div>'
                 if varied else "<p>Nothing: every run is the scenario as it is.</p>")
        return f"""<header>
<p class="quiet">hierarchy sweep · <b>{escape(sweep.name)}</b></p>
<h1>{escape(sweep.title or sweep.name)}</h1>
<p>{_count(len(runs), "run")}: {_count(sweep.samples, "sample")} of what is varied below, each
under {escape(_listed(list(labels)))}, so that all are judged on the same samples.</p>{refused}
<details open><summary>What was varied</summary>{table}</details></header>"""

    def _scenario(self, name: str) -> str:
        results = self.found[name]
        scenario = next(one for one in self.plan.scenarios if one.name == name)
        chart = drawing.svg(figures.shares(results), f"{name}: shares of runs")
        return f"""<section><div class="lead"><div>
<h2>{escape(name)}: {escape(scenario.title)}</h2>
<p class="verdict">{escape(verdict(results))}</p>
<p class="quiet">{escape(scenario.description)}</p>{_legend(results.labels)}</div>
<figure>{chart}<figcaption class="quiet">In how many runs. Bar: where the share of all possible
samples lies, with 95 % confidence (Wilson).</figcaption></figure></div>
{self._failures(results)}{_distributions(name, results)}{self._worst(results)}{_numbers(results)}
</section>"""

    def _failures(self, results: Results) -> str:
        found = results.failures()
        if not found:
            return ""
        rows = "".join(f"<tr><th>{escape(one.reason)}</th><td>{escape(one.run.label)}</td>"
                       f"<td>{one.count}</td>{self._replay(one.run)}</tr>"
                       for one in found[:_FAILURES])
        more = f"<p>{len(found) - _FAILURES} more reasons.</p>" if len(found) > _FAILURES else ""
        return f"""<h3 class="alert">Runs that did not reach their end</h3>
<div class="scroll"><table class="plain worst"><thead><tr><th>Reason, of the first</th>
<th>Resolver</th><th>Runs</th><th>Sample</th><th>To see the first</th></tr></thead><tbody>{rows}
</tbody></table></div>{more}"""

    def _worst(self, results: Results) -> str:
        rows = "".join(
            f"<tr><th>{escape(one.metric.label)}</th><td>{escape(_with_unit(one.metric))}</td>"
            f"<td>{escape(one.run.label)}</td><td>{escape(_others(one.others))}</td>"
            f"{self._replay(one.run)}</tr>" for one in results.worst())
        return f"""<h3>Worst cases</h3>
<p class="quiet">The one worst run by each measure, and the command that runs it again, with every
digit of what was sampled.</p>
<div class="scroll"><table class="plain worst"><thead><tr><th></th><th>Worst</th><th>Under</th>
<th>On the same sample</th><th>Sample</th><th>To see it</th></tr></thead><tbody>{rows}</tbody>
</table></div>""" if rows else ""

    def _replay(self, run: Planned) -> str:
        file = f"worst/{name_of(run)}"
        command = shlex.join(["hierarchy", "run", str(self.folder / file)])
        return (f'<td><a href="{escape(file)}">{run.sample}</a></td>'
                f'<td><code class="line">{escape(command)}</code></td>')


def name_of(run: Planned) -> str:
    """Return the name of the file that has the scenario of a run."""
    return f"{slug(f'{run.scenario}-{run.job.resolver}-{run.sample}')}-{run.job.key[:6]}.toml"


def _distributions(name: str, results: Results) -> str:
    varied = [metric for metric in results.shown()
              if np.nanmin(results.values[metric.name]) < np.nanmax(results.values[metric.name])]
    panels = "".join(
        f"<figure><figcaption><b>{escape(metric.label)}</b> "
        f'<span class="quiet">{escape(_direction(metric))}</span></figcaption>'
        f"{drawing.svg(figures.spread(results, metric), f'{name}: {metric.label}')}</figure>"
        for metric in varied)
    return f"""<h3>How the runs are spread</h3>
<p class="quiet">Box: the middle half of the runs, with the median. Line: from 5 % to 95 % of them.
Dots: the least and the largest.</p><div class="panels wide">{panels}</div>""" if panels else ""


def _numbers(results: Results) -> str:
    heads = "".join(f"<th>{_chip(colour)}{escape(label)}</th>"
                    for label, colour in drawing.colours(results.labels).items())
    body = []
    for group, metrics in groupby(results.shown(), key=lambda metric: metric.group):
        body.append(f'<tr class="group"><th colspan="{len(results.labels) + 1}">{escape(group)}'
                    "</th></tr>")
        for metric in metrics:
            cells = "".join(f"<td>{escape(summary(results, metric, label))}</td>"
                            for label in results.labels)
            unit = f" [{metric.shown_unit}]" if metric.shown_unit else ""
            body.append(f"<tr><th>{escape(metric.label + unit)}</th>{cells}</tr>")
    return f"""<h3>In numbers</h3>
<p class="quiet">Median of the runs, and in brackets the worst.</p>
<div class="scroll"><table><thead><tr><th></th>{heads}</tr></thead><tbody>{"".join(body)}</tbody>
</table></div>"""


def _others(others: Mapping[str, Metric]) -> str:
    return ", ".join(f"{label} {metric.shown()}" for label, metric in others.items()) or "–"


def _with_unit(metric: Metric) -> str:
    return f"{metric.shown()} {metric.shown_unit}".strip()


def _direction(metric: Metric) -> str:
    unit = f"[{metric.shown_unit}]" if metric.shown_unit else ""
    better = {True: "less is better", False: "more is better", None: ""}[metric.lower_is_better]
    return " ".join(part for part in (unit, better) if part)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}".replace(",", " ")


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _legend(labels: Sequence[str]) -> str:
    chips = "".join(f"<span>{_chip(colour)}{escape(label)}</span>"
                    for label, colour in drawing.colours(labels).items())
    return f'<div class="legend">{chips}</div>'


def _chip(colour: str) -> str:
    return f'<span class="chip" style="background:{colour}"></span>'


def _pairs(pairs: Mapping[str, str]) -> str:
    rows = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in pairs.items())
    return f'<div class="scroll"><table class="plain"><tbody>{rows}</tbody></table></div>'


def _resource(package: str, name: str) -> str:
    return files(f"scenarios.{package}").joinpath(name).read_text(encoding="utf-8")
