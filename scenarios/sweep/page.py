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

from scenarios.draw.figures import drawing
from scenarios.draw.figures.palette import looks
from scenarios.files import slug
from scenarios.measure.metrics import Metric
from scenarios.report.parts import chip
from scenarios.sweep import figures
from scenarios.sweep.planning import Plan, Planned
from scenarios.sweep.results import Results, Worst, summary
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
        labels = list(dict.fromkeys(run.label for run in runs))
        each = f", each under {_listed(labels)}, so that all are judged on the same"
        lone = next(iter(self.found.values())) if len(self.found) == 1 else None
        said = f'<p class="verdict">{escape(verdict(lone))}</p>' if lone else ""
        varied = "".join(f"<li><code>{escape(key)}</code>: {escape(str(how))}</li>"
                         for key, how in sweep.parameters.items())
        refused = "".join(f'<p class="quiet">{escape(why)}.</p>' for why in self.plan.refused)
        return f"""<header class="lead"><div>
<p class="quiet">hierarchy sweep · <b>{escape(sweep.name)}</b></p>
<h1>{escape(sweep.title or sweep.name)}</h1>
{said}
<p>{_count(len(runs), "run")}: {_count(sweep.samples, "sample")}{escape(
    each if len(labels) > 1 else f" under {labels[0]}")}. Sampled:</p>
<ul>{varied or "<li>nothing: every run is the scenario as it is</li>"}</ul>{refused}</div>
{_shares(lone) if lone else ""}</header>"""

    def _scenario(self, name: str) -> str:
        results = self.found[name]
        scenario = next(one for one in self.plan.scenarios if one.name == name)
        lead = "" if len(self.found) == 1 else (
            f'<div class="lead"><p class="verdict">{escape(verdict(results))}</p>'
            f"{_shares(results)}</div>")
        return f"""<section><h2>{escape(name)}: {escape(scenario.title)}</h2>
<p class="quiet">{escape(scenario.description)}</p>{lead}
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
        runs: dict[str, list[Worst]] = {}
        for one in results.worst():
            runs.setdefault(one.run.job.key, []).append(one)
        rows = "".join(
            f"<tr><th>{'<br>'.join(escape(_in_full(one)) for one in found)}</th>"
            f"<td>{escape(found[0].run.label)}</td>{self._replay(found[0].run)}</tr>"
            for found in runs.values())
        return f"""<h3>Worst cases</h3>
<p class="quiet">The worst run by each measure, in brackets what came of the same sample otherwise,
and the command that runs it again, with every digit of what was sampled.</p>
<div class="scroll"><table class="plain worst"><thead><tr><th>Worst in</th><th>Under</th>
<th>Sample</th><th>To see it</th></tr></thead><tbody>{rows}</tbody>
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
Dots: the least and the largest; an arrow where they are off the picture, with how many runs and the
farthest.</p><div class="spreads">{panels}</div>""" if panels else ""


def _numbers(results: Results) -> str:
    heads = "".join(f"<th>{chip(look)}{escape(label)}</th>"
                    for label, look in looks(results.labels).items())
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


def _shares(results: Results) -> str:
    chart = drawing.svg(figures.shares(results), f"{results.runs[0].scenario}: shares of runs")
    return f"""<figure>{chart}<figcaption class="quiet">In how many runs. Pale: where the share lies
with 95 % confidence (Wilson).</figcaption></figure>"""


def _in_full(worst: Worst) -> str:
    metric = worst.metric
    others = ", ".join(f"{label} {other.shown()}" for label, other in worst.others.items())
    said = f"{metric.label}: {metric.shown()} {metric.shown_unit}".strip()
    return f"{said} ({others})" if others else said


def _direction(metric: Metric) -> str:
    unit = f"[{metric.shown_unit}]" if metric.shown_unit else ""
    better = {True: "less is better", False: "more is better", None: ""}[metric.lower_is_better]
    return " ".join(part for part in (unit, better) if part)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}".replace(",", " ")


def _listed(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _pairs(pairs: Mapping[str, str]) -> str:
    rows = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in pairs.items())
    return f'<div class="scroll"><table class="plain"><tbody>{rows}</tbody></table></div>'


def _resource(package: str, name: str) -> str:
    return files(f"scenarios.{package}").joinpath(name).read_text(encoding="utf-8")
