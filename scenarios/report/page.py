"""A comparison as one self-contained HTML page: verdict, replay, numbers, figures, commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING

from scenarios.draw.figures import drawing
from scenarios.draw.figures.palette import Look, looks
from scenarios.draw.figures.picture import picture
from scenarios.files import slug
from scenarios.measure.motions import Motion, motions
from scenarios.measure.verdict import in_words, verdict
from scenarios.report import charts, tables
from scenarios.report.commands import commands
from scenarios.report.embedded import replay
from scenarios.report.parts import legend, plain_table, section, unbroken

if TYPE_CHECKING:
    from scenarios.measure.comparison import Comparison
    from scenarios.measure.runs import Run

_REPLAY_BYTES, _REPLAYS_BYTES = 3_000_000, 8_000_000  # of one replay, and of all on a page


def page(comparison: Comparison) -> str:
    """Return the page; it refers to nothing outside itself but the run folders beside it."""
    groups = comparison.groups()
    with drawing.styled(drawing.SCREEN):
        sections = [_group(comparison, name, runs) for name, runs in groups.items()]
    return Template(_resource("page.html")).substitute(
        title=escape(f"{', '.join(groups)}: a comparison"), style=_resource("style.css"),
        script=_resource("page.js"), contents=_contents(groups), sections="\n".join(sections),
        refused="".join(f'<p class="quiet">{escape(said)}.</p>' for said in comparison.refused),
        command=_command("All of this page", comparison.command),
        versions=plain_table((escape(a), escape(b)) for a, b in comparison.versions.items()))


def _contents(groups: Mapping[str, Sequence[Run]]) -> str:
    """Return the verdict of each group with a link to it, where there are several."""
    if len(groups) < 2:
        return ""
    items = "".join(f'<li><a href="#{slug(name)}">{escape(name)}</a>: '
                    f"{unbroken(verdict(runs))}</li>" for name, runs in groups.items())
    return (f'<nav><h1>{in_words(len(groups)).capitalize()} scenarios compared</h1>'
            f"<ul>{items}</ul></nav>")


def _group(comparison: Comparison, name: str, runs: Sequence[Run]) -> str:
    found, look = motions(runs), looks(run.label for run in runs)
    parts = [_lead(name, runs, found, look)]
    room = min(_REPLAY_BYTES, _REPLAYS_BYTES // len(comparison.groups()))
    parts += [replay(name, found, room)] if found else []
    parts += [tables.numbers(runs, look), _over_time(name, runs, look)]
    if found:
        parts += [charts.multiples(name, found, look), charts.overlays(name, runs, found, look)]
    parts += [tables.parted(runs), _how(comparison, runs), tables.settings(runs)]
    body = "\n".join(part for part in parts if part)
    return f'<article id="{slug(name)}">{body}</article>'


def _lead(name: str, runs: Sequence[Run], found: Sequence[Motion], look: Mapping[str, Look]
          ) -> str:
    asked = {run.scenario.name: run.scenario for run in runs}
    if len(asked) > 1:
        title = f"{in_words(len(asked)).capitalize()} scenarios, resolved by {name}"
        about = "".join(f'<p class="quiet"><b>{escape(key)}</b>: {escape(one.title)}</p>'
                        for key, one in asked.items())
    else:
        ways = "one way" if len(runs) == 1 else f"{in_words(len(runs))} ways"
        title = f"{runs[0].scenario.title or name}, resolved in {ways}"
        about = f'<p class="quiet">{escape(runs[0].scenario.description)}</p>'
    return f"""<header class="lead"><div>
<p class="quiet">hierarchy compare · <b>{escape(name)}</b></p>
<h1>{escape(title)}</h1>
<p class="verdict">{unbroken(verdict(runs))}</p>
{legend(look)}
{about}</div>
{_picture(name, found, look)}</header>"""


def _picture(name: str, found: Sequence[Motion], look: Mapping[str, Look]) -> str:
    drawn = {one.label: one.recording for one in found if "ee_position" in one.recording}
    if not drawn:
        return ""
    colours = {label: look[label].colour for label in drawn}
    first = next(iter(drawn.values()))
    caption = f"Drawn is the robot of {next(iter(drawn))}."
    if "desired_position" in first:
        caption += " Dashed: the path asked for."
    if first.scenario.avoidance is not None:
        caption += (" Red: obstacles with ε₁ and ε₂ around them, and control points; in full where "
                    "it is nearest to an obstacle.")
    return (f'<figure>{drawing.svg(picture(drawn, colours), f"{name}: the paths taken")}'
            f'<figcaption class="quiet">{escape(caption)}</figcaption></figure>')


def _over_time(name: str, runs: Sequence[Run], look: Mapping[str, Look]) -> str:
    drawn = charts.stacks(name, runs, look)
    return section("The stack over time", drawn + tables.events(runs, look),
                   "Time [s] to the right; place 1 is the first priority. Below, ticks with "
                   "trouble and what was done in them, contact, the fault that ended a run.")


def _how(comparison: Comparison, runs: Sequence[Run]) -> str:
    made = "".join(_command(what, text) for what, text in commands(comparison, runs))
    return section("How to get this", made, "One run at a time; all at once by the command at the "
                   "end of the page. Folders are named as from where that was called.")


def _command(what: str, text: str) -> str:
    return (f'<div class="command"><span class="quiet">{escape(what)}</span>'
            f"<pre><code>{escape(text)}</code></pre>"
            '<button type="button" hidden>copy</button></div>')


@cache
def _resource(name: str) -> str:
    return files("scenarios.report").joinpath(name).read_text(encoding="utf-8")
