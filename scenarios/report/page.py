"""A comparison as one self-contained HTML page: verdict, table, figures, settings, versions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from itertools import groupby
from string import Template
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from scenarios import drawing, panels
from scenarios.parting import BOUND, partings
from scenarios.picture import picture
from scenarios.report import figures
from scenarios.report.verdict import in_words, verdict

if TYPE_CHECKING:
    from scenarios.compare import Comparison, Row, Run
    from scenarios.recording import Recording


def page(comparison: Comparison) -> str:
    """Return the page; it refers to nothing outside itself but the run folders beside it."""
    groups = comparison.groups()
    sections = [_group(name, runs) for name, runs in groups.items()]
    return Template(_resource("page.html")).substitute(
        title=escape(f"{', '.join(groups)}: a comparison"),
        style=_resource("style.css"), sections="\n".join([*sections, _refused(comparison)]),
        command=escape(comparison.command), versions=_pairs(comparison.versions))


def _refused(comparison: Comparison) -> str:
    return "".join(f'<p class="quiet">{escape(said)}.</p>' for said in comparison.refused)


def _group(name: str, runs: Sequence[Run]) -> str:
    recordings = {run.label: run.recording for run in runs
                  if run.recording is not None and run.recording.ticks > 1}
    parts = [_lead(name, runs, recordings), _faults(runs), _table(runs), _partings(runs)]
    if recordings:
        parts += [_overlays(name, recordings), *_panels(name, recordings)]
    return "\n".join([*parts, _settings(runs)])


def _lead(name: str, runs: Sequence[Run], recordings: Mapping[str, Recording]) -> str:
    asked = {run.scenario.name: run.scenario for run in runs}
    if len(asked) > 1:
        title = f"{in_words(len(asked)).capitalize()} scenarios, resolved by {name}"
    else:
        ways = "one way" if len(runs) == 1 else f"{in_words(len(runs))} ways"
        title = f"{runs[0].scenario.title or name}, resolved in {ways}"
    about = "".join(f'<p class="quiet"><b>{escape(key)}</b>: {escape(one.title)}</p>'
                    for key, one in asked.items())
    if len(asked) == 1:
        about = f'<p class="quiet">{escape(runs[0].scenario.description)}</p>'
    drawn = {label: r for label, r in recordings.items() if "ee_position" in r}
    scene = _svg(picture(drawn), f"{name}: the paths taken") if drawn else ""
    caption = ("Dashed: the path asked for. Red: obstacles with ε₁ and ε₂ around them, and control "
               f"points. The arm is that of {next(iter(drawn), '')}, where it is nearest to one.")
    figure = (f'<figure>{scene}<figcaption class="quiet">{escape(caption)}</figcaption></figure>'
              if scene else "")
    return f"""<header class="lead"><div>
<p class="quiet">hierarchy compare · <b>{escape(name)}</b></p>
<h1>{escape(title)}</h1>
<p class="verdict">{escape(verdict(runs))}</p>
{about}
{_legend([run.label for run in runs])}</div>
{figure}</header>"""


def _faults(runs: Sequence[Run]) -> str:
    return "".join(f'<p class="alert"><b>{escape(run.label)}</b> did not reach the end: '
                   f"{escape(str(run.fault))}.</p>" for run in runs if run.fault)


def _table(runs: Sequence[Run]) -> str:
    from scenarios.compare import table

    colour = drawing.colours([run.label for run in runs])
    heads = "".join(f"<th>{_chip(colour[run.label])}{escape(run.label)}{_stopped(run)}</th>"
                    for run in runs)
    out = [run.fault is not None for run in runs]
    body = []
    for group, rows in groupby(table(runs, details=False), key=lambda row: row.group):
        body.append(f'<tr class="group"><th colspan="{len(runs) + 1}">{escape(group)}</th></tr>')
        body += [_line(row, out) for row in rows]
    detour = any(run.recording and "repulsion_active" in run.recording
                 and run.recording["repulsion_active"].any() for run in runs)
    marks = ("Best of each row in colour, with a dot; within 1 % is as good, and a row where all "
             "are is unmarked." if len({run.scenario.name for run in runs}) == 1 else
             "Different scenarios ask for different things, so none is marked as best.")
    why = (" The position error contains the detour by which the end effector is pushed around an "
           "obstacle on its path." if detour else "")
    return f"""<section><h2>In numbers</h2>
<p class="quiet">{marks}{why}</p>
<div class="scroll"><table><thead><tr><th></th>{heads}</tr></thead>
<tbody>{"".join(body)}</tbody></table></div></section>"""


def _partings(runs: Sequence[Run]) -> str:
    said = "".join(f"<li>{escape(str(one))}.</li>" for one in partings(runs))
    return f"""<section><h2>Where they part</h2>
<p class="quiet">Resolvers that are strict at every rank solve the same problem at every tick, so
their joints should follow the same path; the bound is {BOUND:.0e} rad, or the accuracy that a
resolver declares where that is more.</p>
<ul>{said}</ul></section>""" if said else ""


def _stopped(run: Run) -> str:
    if run.fault is None:
        return ""
    seconds = run.recording["t"][-1] if run.recording and run.recording.ticks else 0.0
    return f'<br><small class="alert">stopped at {seconds:.2f} s</small>'


def _line(row: Row, out: Sequence[bool]) -> str:
    unit = f" <small class='quiet'>[{escape(row.unit)}]</small>" if row.unit else ""
    cells = []
    for i, (cell, note) in enumerate(zip(row.cells, row.notes, strict=True)):
        kind = "best" if i in row.best else "out" if out[i] else ""
        title = f' title="{escape(note)}"' if note else ""
        cells.append(f'<td class="{kind}"{title}>{escape(cell)}</td>')
    return f"<tr><th>{escape(row.label)}{unit}</th>{''.join(cells)}</tr>"


def _overlays(name: str, recordings: Mapping[str, Recording]) -> str:
    first = next(iter(recordings))
    drawn = []
    if all("position_error" in r for r in recordings.values()):
        drawn.append(("Distance from the path [mm]",
                      figures.overlay(panels.position_error, recordings)))
    if len({r.scenario.name for r in recordings.values()}) < len(recordings):
        drawn.append((f"How far the joints depart from those of {first} [rad]",
                      figures.departure(recordings)))
    if all("time_tick" in r for r in recordings.values()):
        drawn.append(("Time per tick: kinematics, rows, resolve (light to full, medians); "
                      "whole tick | median, × 99.9 %", figures.computing_time(recordings)))
    body = "".join(f"<figure><figcaption><b>{escape(title)}</b></figcaption>"
                   f"{_svg(fig, f'{name}: {title}')}</figure>" for title, fig in drawn)
    return (f"<section><h2>Laid over each other</h2>{_legend(recordings)}"
            f'<div class="wide">{body}</div></section>')


def _panels(name: str, recordings: Mapping[str, Recording]) -> list[str]:
    sections, colour = [], drawing.colours(recordings)
    for panel in panels.PANELS:
        drawn = figures.side_by_side(panel, recordings)
        body = "".join(f"<figure><figcaption>{_chip(colour[label])}{escape(label)}</figcaption>"
                       f"{_svg(fig, f'{name}, {label}: {panel.title}')}</figure>"
                       for label, fig in drawn.items())
        if drawn:
            unit = f"<small class='quiet'>[{escape(panel.unit)}] over time [s]</small>"
            sections.append(f"<section><h2>{escape(panel.title)} {unit}</h2>"
                            f'<p class="quiet">{escape(panel.explains)}</p>'
                            f"{_joints(recordings) if panel.name == 'joint-velocities' else ''}"
                            f'<div class="panels">{body}</div></section>')
    return sections


def _settings(runs: Sequence[Run]) -> str:
    rows = "".join(
        f"<tr><th>{escape(run.label)}</th><td><code>{escape(_settings_text(run.settings))}</code></td>"
        f'<td><a href="{escape(run.folder)}/">{escape(run.folder)}/</a></td></tr>' for run in runs)
    asked = {run.scenario.name: run for run in reversed(runs)}
    files = "".join(f"<details><summary>{escape(name)}.toml, as run by {escape(run.spec)}</summary>"
                    f"<pre><code>{escape(run.scenario.to_toml())}</code></pre></details>"
                    for name, run in reversed(asked.items()))
    return f"""<section><h2>Settings</h2>
<p class="quiet">As they were used, damping included; every run's folder has the whole scenario.</p>
<div class="scroll"><table class="plain"><tbody>{rows}</tbody></table></div>
{files}</section>"""


def _settings_text(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value!r}" for name, value in settings.items()) or "none"


def _pairs(pairs: Mapping[str, str]) -> str:
    rows = "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in pairs.items())
    return f'<div class="scroll"><table class="plain"><tbody>{rows}</tbody></table></div>'


def _legend(labels: Any) -> str:
    chosen = drawing.colours(labels)
    chips = (f"<span>{_chip(colour)}{escape(label)}</span>" for label, colour in chosen.items())
    return f'<div class="legend">{"".join(chips)}</div>'


def _joints(recordings: Mapping[str, Recording]) -> str:
    count = next(iter(recordings.values()))["v"].shape[1]
    chips = (f"<span>{_chip(drawing.joint_colour(i))}joint {i + 1}</span>" for i in range(count))
    return f'<div class="legend">{"".join(chips)}</div>'


def _chip(colour: str) -> str:
    return f'<span class="chip" style="background:{colour}"></span>'


def _svg(fig: Figure, title: str) -> str:
    return drawing.svg(fig, title)


@cache
def _resource(name: str) -> str:
    return files("scenarios.report").joinpath(name).read_text(encoding="utf-8")
