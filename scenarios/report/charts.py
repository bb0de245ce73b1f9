"""The drawn sections of the report: the stack over time, small multiples, overlays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

from scenarios.draw.figures import drawing, panels
from scenarios.draw.figures.palette import Look, task_colours
from scenarios.draw.figures.timeline import tasks, timeline
from scenarios.measure.motions import ALIKE, Motion, motions
from scenarios.measure.verdict import listed
from scenarios.report import figures
from scenarios.report.parts import chip, joints, legend, picture, section, squares

if TYPE_CHECKING:
    from scenarios.loop.recording import Recording
    from scenarios.measure.runs import Run


def same_motion(found: Sequence[Motion]) -> str:
    """Say which runs are drawn once because they are the same motion; empty if none are."""
    said = [f"{listed(one.labels)} are the same motion "
            + (f"to {one.apart:.0e} rad" if one.apart else "to the last bit")
            for one in found if len(one.runs) > 1]
    return f"Drawn once: {'; '.join(said)} (runs within {ALIKE:.0e} rad are)." if said else ""


def stacks(name: str, runs: Sequence[Run], looks: Mapping[str, Look]) -> str:
    """Return bands for the tasks in the stack, a figure for each motion with its own events."""
    found = motions(runs, also=_events)
    beside = [one.recording for one in found]
    named = task_colours(tasks(beside))
    if not named:
        return ""
    body = "".join(picture(f"{_caption(one, looks)}: {_changes(one.recording)}",
                           timeline(one.recording, beside),
                           f"{name}, {one.label}: the stack over time") for one in found)
    return f'{squares(named)}<div class="wide">{body}</div>'


def _events(run: Run) -> object:
    recording = run.recording
    if recording is None:
        return None
    return recording.events, recording.fault, tuple(recording["status"].nonzero()[0]) \
        if "status" in recording else ()


def _changes(recording: Recording) -> str:
    count = recording.switches().size
    return f"{count} change{'' if count == 1 else 's'}"


def multiples(name: str, found: Sequence[Motion], looks: Mapping[str, Look]) -> str:
    """Return a card for each quantity, with a small panel for each motion on equal axes."""
    recordings = {one.label: one.recording for one in found}
    captions = {one.label: _caption(one, looks) for one in found}
    cards = []
    for panel in (*panels.PANELS, *panels.TASK_PANELS):
        drawn = figures.side_by_side(panel, recordings, looks)
        body = "".join(picture(captions[label], fig, f"{name}, {label}: {panel.title}")
                       for label, fig in drawn.items())
        if drawn:
            key = _key(panel.name, recordings)
            cards.append(f'<div class="card"><h3>{escape(panel.title)} <small class="quiet">'
                         f"[{escape(panel.unit)}]</small></h3>"
                         f'<p class="quiet">{escape(panel.explains)}</p>{key}'
                         f'<div class="panels">{body}</div></div>')
    said = f"Over time [s], on equal axes. {same_motion(found)}".strip()
    return section("Side by side", f'<div class="cards" style="--beside:{min(len(found), 5)}">'
                   f"{''.join(cards)}</div>", said) if cards else ""


def _key(panel: str, recordings: Mapping[str, Recording]) -> str:
    """Return what the colours of a panel's lines mean, if they mean the same in all runs."""
    count = max(int(recording["v"].shape[1]) for recording in recordings.values())
    if panel == "joint-velocities" and count <= len(drawing.JOINTS):
        return joints(count)
    if panel in ("task-errors", "task-angles"):
        first = next(iter(recordings.values()))
        return squares({section.title: drawing.joint_colour(i)
                        for i, section in enumerate(first.scenario.tasks)
                        if section.kind != "posture"})
    return ""


def overlays(name: str, runs: Sequence[Run], found: Sequence[Motion],
             looks: Mapping[str, Look]) -> str:
    """Return what is best seen over each other: path error, departures, computing time."""
    recordings = {run.label: run.recording for run in runs
                  if run.recording is not None and run.recording.ticks > 1}
    drawn = []
    moved = {one.label: one.recording for one in found}
    if len(moved) > 1 and all("position_error" in one for one in moved.values()):
        drawn.append(("Distance from the path [mm]",
                      figures.overlay(panels.position_error, moved, looks)))
    if len({one.scenario.name for one in recordings.values()}) < len(recordings):
        drawn.append((f"How far the joints depart from those of {next(iter(recordings))} [rad]",
                      figures.departure(recordings, looks)))
    if all("time_tick" in one for one in recordings.values()):
        timed, marks = figures.computing_time(recordings, looks)
        drawn.append((f"Time per tick: {marks}", timed))
    body = "".join(picture(f"<b>{escape(title)}</b>", fig, f"{name}: {title}")
                   for title, fig in drawn)
    return section("Laid over each other",
                   f'{legend({label: looks[label] for label in recordings})}'
                   f'<div class="wide">{body}</div>') if drawn else ""


def _caption(motion: Motion, looks: Mapping[str, Look]) -> str:
    alike = len(motion.runs) - 1
    others = (f' <small class="quiet" title="{escape(listed(motion.labels))}">and {alike} more '
              "alike</small>") if alike else ""
    return f"{chip(looks[motion.label])}{escape(motion.label)}{others}"
