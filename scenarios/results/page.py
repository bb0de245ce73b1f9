"""A comparison as one self-contained HTML page: summary, replay, metrics, figures, commands."""

import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import PurePath
from typing import Any

from markupsafe import Markup

from hierarchy.errors import HierarchyError
from hierarchy.words import in_words, listed
from scenarios.config import load, shipped
from scenarios.config.scenario import OWN
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import svg
from scenarios.draw.figures.palette import Look, looks
from scenarios.draw.figures.picture import picture
from scenarios.draw.replay import html
from scenarios.measure.motions import BOUND, Motion, motions, partings
from scenarios.measure.runs import Run
from scenarios.measure.verdict import Comparison, goal_table, lines, verdicts
from scenarios.results import sections
from scenarios.templates import render, resource


def run_command(run: Run, folder: str) -> str:
    """Return the command that repeats a run.

    It uses the scenario's name where that gives the same scenario, otherwise the file in the run's
    folder.
    """
    name = run.scenario.name
    if name in shipped() and load(name).with_resolver(run.spec) == run.scenario:
        return shlex.join(["hierarchy", "run", name, "--resolver", run.spec])
    return shlex.join(["hierarchy", "run", str(PurePath(folder, run.folder, "scenario.toml"))])


def commands(comparison: Comparison, runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Return the purpose and text of each command for the runs of one group."""
    folder = comparison.folder or ""
    kept = [run for run in runs if run.recording is not None]
    found = [(f"Repeat {run.label}", run_command(run, folder)) for run in runs]
    if kept:
        first = str(PurePath(folder, kept[0].folder))
        every = [str(PurePath(folder, one.runs[0].folder)) for one in motions(kept)] or [first]
        found += [("View a run in 3D in the browser", shlex.join(["hierarchy", "view", first])),
                  ("Write the replay as a single file, each motion once",
                   shlex.join(["hierarchy", "replay", *every])),
                  ("Draw a run's figures for a paper, as PDF",
                   shlex.join(["hierarchy", "figures", first, "--style", "paper"]))]
    return found


MOST = 4  # motions in one replay
_FASTEST, _SLOWEST = 30.0, 5.0  # [Hz] of the frames kept


def replay(name: str, found: Sequence[Motion], most_bytes: int) -> dict[str, str]:
    """Return the replay of up to MOST motions and what is said of it, or the problem.

    The frame rate is lowered if the replay would exceed `most_bytes`.
    """
    shown, left, rate = found[:MOST], found[MOST:], _FASTEST
    recordings = {one.label: one.recording for one in shown}
    happenings = {one.label: one.runs[0].happened for one in shown}
    made = partial(html, recordings, name, happenings, embedded=True)
    try:
        document = made(rate=rate)
        if len(document) > most_bytes:
            rate = max(_SLOWEST, float(int(rate * most_bytes / len(document))))
            document = made(rate=rate)
    except HierarchyError as error:
        return {"problem": str(error), "said": ""}
    said = [f"Shown: {listed(list(recordings))}, {rate:g} frames per second."]
    said += [f"{listed(one.labels[1:])} {'moves' if len(one.runs) == 2 else 'move'} like "
             f"{one.label}." for one in shown if len(one.runs) > 1]
    if left:
        said.append(f"Not shown: {listed([label for one in left for label in one.labels])}; the "
                    f"replay here shows at most {in_words(MOST)} motions.")
    return {"document": document, "said": " ".join(said), "problem": ""}


_REPLAY_BYTES, _REPLAYS_BYTES = 3_000_000, 8_000_000  # of one replay, and of all on a page


def comparison_page(comparison: Comparison, planned: int = 0) -> str:
    """Return the page; it refers to no other files except what is beside it.

    planned : number of runs; while there are fewer, the page says so and loads itself again.
    """
    groups, made = comparison.groups(), len(comparison.runs)
    with drawing.styled(drawing.SCREEN):
        articles = [_group(comparison, name, runs) for name, runs in groups.items()]
    ends = {name: lines(verdicts(runs))[0] for name, runs in groups.items()}
    return str(render("results/page.html", title=f"{', '.join(groups)}: a comparison",
                      style=resource("results/style.css"), script=resource("results/page.js"),
                      unfinished=f"{made} of {planned} runs have ended" * (made < planned),
                      about_rows=_about_rows(comparison), file="",
                      contents=ends if len(ends) > 1 else {},
                      count=in_words(len(groups)).capitalize(),
                      groups=articles, refused=comparison.refused, command=comparison.command,
                      versions=comparison.versions))


def _about_rows(comparison: Comparison) -> str:
    timed = max((run.timing.ticks for run in comparison.runs if run.timing), default=0)
    how = (f"the runs were made side by side, and then the first {timed} ticks of each repeated "
           "alone to take these times" if timed else "one run after the other in one process")
    return (f"Not comparable: computing times hold for this machine only ({how}); runs of "
            "different scenarios; runs that stopped early, which cover less time and are never "
            "marked as best.")


def _group(comparison: Comparison, name: str, runs: Sequence[Run]) -> Markup:
    """Return the article about the runs of one group."""
    found, look, judged = motions(runs), looks(run.label for run in runs), verdicts(runs)
    parted = partings(runs)
    room = min(_REPLAY_BYTES, _REPLAYS_BYTES // len(comparison.groups()))
    return render("results/group.html", name=name, looks=look, verdict=lines(judged),
                  goals=goal_table(judged), replay=found and replay(name, found, room),
                  panels=found and sections.multiples(name, found, look),
                  overlays=found and sections.overlays(name, runs, found, look),
                  **_about(name, runs), **_picture(name, found, look),
                  numbers=sections.numbers(runs), stack=sections.stack(name, runs),
                  partings=[str(one) for one in parted],
                  bound=f"{BOUND:.0e} {parted[0].unit}" if parted else "",
                  commands=commands(comparison, runs),
                  settings=[(run, ", ".join(f"{name} = {value!r}" for name, value in
                                            run.settings.items()) or "none") for run in runs],
                  scenarios={run.scenario.name: run for run in reversed(runs)})


def _about(name: str, runs: Sequence[Run]) -> dict[str, Any]:
    """Return the title, and each scenario's description by name ("" if there is only one)."""
    asked = {run.scenario.name: run.scenario for run in runs}
    if len(asked) > 1:
        by = "each resolved by its own resolver" if name == OWN else f"resolved by {name}"
        return {"title": f"{in_words(len(asked)).capitalize()} scenarios, {by}",
                "about": {run.scenario.name: run.title for run in runs}}
    by = "one resolver" if len(runs) == 1 else f"{in_words(len(runs))} resolvers"
    return {"title": f"{runs[0].scenario.title or name}: {by}",
            "about": {"": runs[0].scenario.description}}


def _picture(name: str, found: Sequence[Motion], look: Mapping[str, Look]) -> dict[str, Any]:
    """Return the picture of the paths with its caption; both empty without a motion."""
    moved = {one.label: one.recording for one in found}
    if not moved:
        return {"picture": "", "caption_of_picture": ""}
    first = next(iter(moved.values()))
    caption = f"The robot is shown for {next(iter(moved))}."
    if "desired_position" in first:
        caption += " Dashed: the desired path."
    if first.scenario.avoidance is not None:
        caption += (" Red: obstacles, the distances of the avoidance around them, and control "
                    "points; the robot is solid at its closest approach to an obstacle.")
    fig = picture(moved, {label: look[label].colour for label in moved})
    return {"picture": svg(fig, f"{name}: the paths taken"), "caption_of_picture": caption}
