"""The sections of the page: numbers with the best marked, events, settings, figures."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hierarchy import plugins
from hierarchy.errors import expect
from hierarchy.words import counted, listed
from scenarios.draw.figures import drawing, panels
from scenarios.draw.figures.drawing import ALERT, INK, svg
from scenarios.draw.figures.palette import Look, task_colours
from scenarios.draw.figures.panels import Draw, Panel
from scenarios.draw.figures.timeline import tasks, timeline
from scenarios.measure.motions import ALIKE, Motion, apart, motions
from scenarios.measure.runs import Run, caveats, table
from scenarios.measure.safety import units_of
from scenarios.recording.blame import blamed
from scenarios.recording.facts import resolver_facts
from scenarios.recording.recording import Recording

# The most important metrics; the others are folded away.
_FIRST = ("position_error_median_settled", "position_error_max_settled", "cone_violation_max",
          "moved_by_lower_max", "body_distance_min", "body_below_share", "ee_distance_min",
          "ee_below_share", "contact_ticks", "slip_max", "friction_margin_min",
          "support_margin_min", "torque_limit_share", "torque_step_max", "torque_step_ticks",
          "joint_limit_excess", "speed_max", "velocity_step_max", "velocity_step_ticks",
          "command_step_max", "acceleration_max", "acceleration_step_max",
          "acceleration_step_ticks", "stack_changes", "active_set_changes", "ticks_not_solved",
          "ticks_brake", "ticks_stop", "late_share", "time_resolve_median", "time_resolve_p999",
          "time_tick_median")
_USUAL = 4.0  # median widths of the ranges of values: wider ones would flatten all the others


def numbers(runs: Sequence[Run]) -> dict[str, Any]:
    """Return the metrics with the best of each row marked, the minor ones as the rest."""
    rows = table(runs)
    first = [row for row in rows if row.name in _FIRST or (
        row.name.startswith("task_") and row.name.endswith("_rms"))]
    marked = caveats({run.label: resolver_facts(run.scenario) for run in runs})
    heads = {run.label: [(kind, text) for kind, text in (
        ("alert", _stopped(run)), ("quiet", ", ".join(marked[run.label]))) if text] for run in runs}
    return {"heads": heads, "first": first, "rest": [row for row in rows if row not in first],
            "said": _marks(runs)}


def _marks(runs: Sequence[Run]) -> str:
    """Return what the marks mean and what to know about the numbers."""
    if all(run.fault for run in runs):
        return "No run was completed, so none is marked as best."
    detour = any(run.recording and "repulsion_active" in run.recording
                 and run.recording["repulsion_active"].any() for run in runs)
    one = len({run.scenario.name for run in runs}) == 1
    marks = ("The best value of each row is coloured and has a dot; values within 1 % count as "
             "equal, and rows in which all are equal are unmarked." if one else
             "The scenarios differ, so none is marked as best.")
    stopped = (" Runs that stopped early are grey and not compared."
               if any(run.fault for run in runs) else "")
    return marks + stopped + (
        " The position error includes the detour of the end effector around obstacles on its path."
        if detour else "")


def _stopped(run: Run) -> str:
    if run.fault is None:
        return ""
    ran = run.recording
    return f"stopped at {ran.seconds:.2f} s" if ran and ran.ticks else "did not start"


def events(runs: Sequence[Run]) -> list[tuple[str, tuple[str, str, str, str]]]:
    """Return what happened in every run: problems, contacts, large changes, faults.

    That is the problem, the action taken or the reason, the number of ticks and the first time.
    Only the first row of a run has its label.
    """
    found = []
    for run in runs:
        rows = [(what, why, str(ticks), f"{t:.3f} s") for what, why, ticks, t in run.happened]
        if run.fault:
            t = run.recording["t"] if run.recording else np.zeros(0)
            rows.append((f"fault: {run.fault}", "run stopped", "–",
                         f"{t[-1]:.3f} s" if len(t) else "the start"))
        found += [(run.label if i == 0 else "", row) for i, row in enumerate(rows)]
    return found


def stack(name: str, runs: Sequence[Run]) -> dict[str, Any]:
    """Return the stack over time, one figure for each motion, and the events."""
    found = motions(runs, also=lambda one: (one.events, one.fault, tuple(
        one["status"].nonzero()[0])))
    beside = [one.recording for one in found]
    colours = task_colours(tasks(beside))
    bands = [(one, svg(timeline(one.recording, beside),
                       f"{name}, {one.label}: the stack over time"),
              counted(int(one.recording.switches().size), "change"))
             for one in found if colours]
    return {"colours": colours, "drawn": bands, "events": events(runs)}


def multiples(name: str, found: Sequence[Motion], looks: Mapping[str, Look]) -> dict[str, Any]:
    """Return a card for each quantity, with one panel per motion on equal axes.

    A figure that fails is left out with a warning: it may be a user's code.
    """
    recordings = {one.label: one.recording for one in found}
    cards = []
    for key, panel in plugins.known("figures").items():
        try:
            expect("what is registered", panel, Panel, "register a Panel")
            small = side_by_side(panel, recordings, looks)
            if any(panel.shows(recordings[label]) for label in small):
                cards.append((panel, _key(small.values()), [
                    (one, svg(small[one.label], f"{name}, {one.label}: {panel.title}"))
                    for one in found if one.label in small]))
        except (Exception, SystemExit) as error:
            warnings.warn(f"figure {key!r} is left out: {blamed(error)}", stacklevel=1)
    same = [f"{listed(one.labels)} are the same motion "
            + (f"to {one.apart:.0e} {units_of(one.recording)}" if one.apart else "to the last bit")
            for one in found if len(one.runs) > 1]
    said = "Over time [s], on equal axes." + (
        f" Drawn once: {'; '.join(same)} (within {ALIKE:.0e} "
        f"{units_of(found[0].recording)})." if same else "")
    return {"cards": cards, "beside": min(len(found), 5), "said": said}


def _key(figures: Iterable[Figure]) -> dict[str, str]:
    """Return the legend of a panel's joints or tasks, if colours mean the same in all runs."""
    keys = [{str(line.get_label()): str(line.get_color()) for line in fig.axes[0].lines
             if not str(line.get_label()).startswith("_child")}  # matplotlib's, of those without
            for fig in figures]
    colours = list(keys[0].values())
    clear = set(colours) <= set(drawing.JOINTS) and len(set(colours)) == len(colours)
    return keys[0] if clear and all(one == keys[0] for one in keys) else {}


def overlays(name: str, runs: Sequence[Run], found: Sequence[Motion],
             looks: Mapping[str, Look]) -> dict[str, Any]:
    """Return overlaid curves: path error, joint difference from the first run, computing time."""
    recordings = {run.label: run.recording for run in runs
                  if run.recording is not None and run.recording.ticks > 1}
    figs = {}
    moved = {one.label: one.recording for one in found}
    if len(moved) > 1 and all("position_error" in one for one in moved.values()):
        figs["Distance from the path [mm]"] = _overlay(panels.position_error, moved, looks)
    if len({one.scenario.name for one in recordings.values()}) < len(recordings):
        (first, one), *others = recordings.items()
        figs[f"Joint difference from {first} [{units_of(one)}]"] = _overlay(
            partial(_departure, first=one), dict(others), looks)
    timings = {run.label: run.timing or recordings[run.label] for run in runs
               if run.label in recordings}
    figs["Time per tick: ● resolve, median; | whole tick, median; × whole tick, 99.9 %"] = (
        _computing_time(timings, looks))
    return {"looks": {label: looks[label] for label in recordings},
            "drawn": [(title, svg(fig, f"{name}: {title}")) for title, fig in figs.items()]}


def side_by_side(panel: Panel, recordings: Mapping[str, Recording], looks: Mapping[str, Look]
                 ) -> dict[str, Figure]:
    """Return one small figure of `panel` per run, by label, all with the same limits.

    Values far beyond those of the other runs are cut, and the panel states their range.
    """
    drawn = {}
    for label, recording in recordings.items():
        if panel.fits(recording):
            drawn[label], (ax,) = drawing.figure()
            panel.draw(ax, recording, looks[label].colour)
    axes = [fig.axes[0] for fig in drawn.values()]
    ranges = [ax.get_ylim() for ax in axes]
    widths = np.diff(ranges)[:, 0] if ranges else np.zeros(0)
    end = max((float(recordings[label]["t"][-1]) for label in drawn), default=0.0)
    for ax, (low, high) in zip(axes, ranges, strict=True):
        linear = ax.get_yscale() != "log"
        kept = np.array(ranges)[widths <= _USUAL * np.median(widths)] if linear else ranges
        least, most = np.min(kept), np.max(kept)
        margin = linear * (0.04 * (most - least) or 1.0)
        ax.set_ylim(least - margin, most + margin)
        ax.set_xlim(0.0, end)
        ax.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        if high - low > 1.1 * (most - least + 2 * margin):
            ax.text(0.98, 0.96, f"cut: {low:.2g} to {high:.2g}", color=ALERT, fontsize=8,
                    ha="right", va="top", transform=ax.transAxes)
    return drawn


def _overlay(draw: Draw, recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return one figure with a curve per run, in the colour and dashes of its label."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    for label, recording in recordings.items():
        before = len(ax.lines)
        draw(ax, recording, looks[label].colour)
        for line in ax.lines[before:]:
            line.set_linestyle(looks[label].line)
    ax.set_xlabel("time [s]")
    return fig


def _departure(ax: Axes, recording: Recording, colour: str, first: Recording) -> None:
    """Draw the largest joint difference from the first run over time, logarithmic."""
    away = apart(recording["q"], first["q"])
    drawing.curve(ax, recording["t"][:len(away)], np.maximum(away, 1e-16), color=colour)
    drawing.make_logarithmic(ax, "y")


def _computing_time(recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return the computing times of a tick [us] on a logarithmic axis, one row per run.

    A dot for the median of resolving, then median (|) and 99.9th percentile (x) of whole ticks.
    """
    fig, (ax,) = drawing.figure(width=4.9, height=0.7 + 0.4 * len(recordings))
    for row, (label, recording) in enumerate(recordings.items()):
        for signal, percent, marker, colour in (("time_resolve", 50.0, "o", looks[label].colour),
                                                ("time_tick", 50.0, "|", INK),
                                                ("time_tick", 99.9, "x", INK)):
            ax.plot(1e6 * np.percentile(recording[signal], percent), row, marker, color=colour)
    drawing.make_logarithmic(ax, "x")
    ax.set_yticks(range(len(recordings)), list(recordings))
    ax.set_ylim(len(recordings) - 0.5, -0.5)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("µs per tick")
    return fig
