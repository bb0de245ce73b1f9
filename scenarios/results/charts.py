"""The report's sections with figures: stack over time, panels side by side, overlays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from hierarchy import plugins
from hierarchy.words import listed
from scenarios.draw.figures import drawing, panels
from scenarios.draw.figures.drawing import svg
from scenarios.draw.figures.palette import Look, task_colours
from scenarios.draw.figures.timeline import tasks, timeline
from scenarios.measure.motions import ALIKE, Motion, motions
from scenarios.results import curves
from scenarios.results.tables import events
from scenarios.templates import render

if TYPE_CHECKING:
    from scenarios.measure.runs import Run
    from scenarios.recording.recording import Recording


def same_motion(found: Sequence[Motion]) -> str:
    """Return which runs are drawn once because their motion is the same; "" if none."""
    said = [f"{listed(one.labels)} are the same motion "
            + (f"to {one.apart:.0e} rad" if one.apart else "to the last bit")
            for one in found if len(one.runs) > 1]
    return f"Drawn once: {'; '.join(said)} (within {ALIKE:.0e} rad)." if said else ""


def stack(name: str, runs: Sequence[Run], looks: Mapping[str, Look]) -> Markup:
    """Return the section with the stack over time, one figure for each motion and its events."""
    found = motions(runs, also=_events)
    beside = [one.recording for one in found]
    colours = task_colours(tasks(beside))
    bands = [(one, svg(timeline(one.recording, beside),
                       f"{name}, {one.label}: the stack over time"), _changes(one.recording))
             for one in found if colours]
    return render("results/stack.html", looks=looks, colours=colours, drawn=bands,
                  events=events(runs))


def _events(run: Run) -> object:
    recording = run.recording
    if recording is None:
        return None
    return recording.events, recording.fault, tuple(recording["status"].nonzero()[0]) \
        if "status" in recording else ()


def _changes(recording: Recording) -> str:
    count = recording.switches().size
    return f"{count} change{'' if count == 1 else 's'}"


def multiples(name: str, found: Sequence[Motion], looks: Mapping[str, Look]) -> Markup:
    """Return a card for each quantity, with one panel per motion on equal axes."""
    recordings = {one.label: one.recording for one in found}
    cards = []
    for panel in plugins.known("figures").values():
        small = curves.side_by_side(panel, recordings, looks)
        if any(panel.shows(recordings[label]) for label in small):
            cards.append((panel, _key(panel.name, recordings), [
                (one, svg(small[one.label], f"{name}, {one.label}: {panel.title}"))
                for one in found if one.label in small]))
    said = f"Over time [s], on equal axes. {same_motion(found)}".strip()
    return render("results/panels.html", cards=cards, beside=min(len(found), 5), looks=looks,
                  said=said) if cards else Markup()


def _key(panel: str, recordings: Mapping[str, Recording]) -> dict[str, str]:
    """Return the legend of a panel's colours, if they mean the same in all runs."""
    count = max(int(recording["v"].shape[1]) for recording in recordings.values())
    if panel == "joint-velocities" and count <= len(drawing.JOINTS):
        return {f"joint {j + 1}": drawing.joint_colour(j) for j in range(count)}
    if panel in ("task-errors", "task-angles"):
        first = next(iter(recordings.values()))
        return {section.title: drawing.joint_colour(i)
                for i, section in enumerate(first.scenario.tasks) if section.unit == "m"}
    return {}


def overlays(name: str, runs: Sequence[Run], found: Sequence[Motion],
             looks: Mapping[str, Look]) -> Markup:
    """Return overlaid curves: path error, joint difference from the first run, computing time."""
    recordings = {run.label: run.recording for run in runs
                  if run.recording is not None and run.recording.ticks > 1}
    figs = []
    moved = {one.label: one.recording for one in found}
    if len(moved) > 1 and all("position_error" in one for one in moved.values()):
        figs.append(("Distance from the path [mm]",
                     curves.overlay(panels.position_error, moved, looks)))
    if len({one.scenario.name for one in recordings.values()}) < len(recordings):
        figs.append((f"Joint difference from {next(iter(recordings))} [rad]",
                     curves.departure(recordings, looks)))
    timings = {run.label: run.timing or recordings[run.label] for run in runs
               if run.label in recordings}
    if all("time_tick" in one for one in timings.values()):
        figs.append(("Time per tick: dot: resolve, median; whole tick | median, × 99.9 %",
                     curves.computing_time(timings, looks)))
    return render("results/overlays.html", looks={label: looks[label] for label in recordings},
                  drawn=[(title, svg(fig, f"{name}: {title}")) for title, fig in figs]
                  ) if figs else Markup()
