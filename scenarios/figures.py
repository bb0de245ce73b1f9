"""The letter's figures 4 to 7, 9 and 10 and a few more, each drawn from a recording alone."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from scenarios import drawing
from scenarios.drawing import ALERT, INK, JOINTS, Array
from scenarios.picture import picture

if TYPE_CHECKING:
    from scenarios.recording import Recording

Draw = Callable[[Axes, "Recording", str], None]


@dataclass(frozen=True)
class Panel:
    """One quantity of a run over time: what it is, the signal it needs, how it is drawn."""

    name: str
    title: str
    unit: str
    signal: str
    draw: Draw
    explains: str = ""

    def fits(self, recording: Recording) -> bool:
        """Whether the recording has what this panel draws."""
        return self.signal in recording and recording.ticks > 1


def joint_velocities(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 4: every joint's velocity [rad/s], and the limits where they come into view."""
    for joint, velocity in enumerate(recording["v"].T):
        drawing.curve(ax, recording["t"], velocity, color=joint_colour(joint),
                      linewidth=0.8, label=f"joint {joint + 1}")


def joint_accelerations(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 9 (b): every joint's acceleration [rad/s^2]."""
    for joint, acceleration in enumerate(recording["a"].T):
        drawing.curve(ax, recording["t"], acceleration, color=joint_colour(joint), linewidth=0.6)


def joint_colour(joint: int) -> str:
    """Return the colour of a joint, numbered from 0."""
    return JOINTS[joint % len(JOINTS)]


def ee_distance(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (a): D_min of the end effector [m], with eps_ee; red while repelled."""
    t, distance = recording["t"], recording["ee_distance"]
    drawing.curve(ax, t, distance, color=colour)
    if "repulsion_active" in recording:
        _in_red(ax, t, distance, recording["repulsion_active"])
    avoidance = recording.scenario.avoidance
    for symbol, threshold in avoidance.tip_thresholds.items() if avoidance else ():
        _threshold(ax, t, threshold, symbol)


def active_point(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (b), above: the number of the control point whose avoidance is in the stack."""
    t, active = recording["t"], recording["active_control_point"]
    changes = np.concatenate(([0], np.flatnonzero(np.diff(active)) + 1, [len(active)]))
    for first, last in itertools.pairwise(changes):
        if active[first] > 0:
            ax.plot([t[first], t[min(last, len(t) - 1)]], [active[first]] * 2, color=colour,
                    linewidth=3.0, solid_capstyle="butt")
    points = recording["control_point_distance"].shape[1] \
        if "control_point_distance" in recording else max(int(active.max()), 1)
    ax.set_ylim(0.3, points + 0.7)
    ax.set_yticks(range(1, points + 1, 1 + points // 10))


def body_distance(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (b), below: D_minimal of the body [m], with eps_1 and eps_2."""
    t = recording["t"]
    drawing.curve(ax, t, recording["minimal_distance"], color=colour)
    avoidance = recording.scenario.avoidance
    for symbol, distance in avoidance.thresholds.items() if avoidance else ():
        _threshold(ax, t, distance, symbol)
    ax.set_ylim(bottom=0.0)


def pointing_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 7: cos(alpha_d) - cos(alpha), in red while the task is in the stack."""
    t, error = recording["t"], recording["pointing_error"]
    drawing.curve(ax, t, error, color=colour)
    if "pointing_active" in recording:
        _in_red(ax, t, error, recording["pointing_active"])
    ax.axhline(0.0, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))


def position_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw the distance of the end effector from its path [mm], on a logarithmic scale."""
    error = 1e3 * np.linalg.norm(recording["position_error"], axis=1)
    drawing.curve(ax, recording["t"], np.maximum(error, 1e-6), color=colour)
    ax.set_yscale("log")


PANELS = (
    Panel("joint-velocities", "Joint velocities", "rad/s", "v", joint_velocities,
          "Figure 4: continuous at acceleration level, with jumps at velocity level."),
    Panel("joint-accelerations", "Joint accelerations", "rad/s²", "a", joint_accelerations,
          "Figure 9 (b): jumps at every change of the stack, within the limits."),
    Panel("position-error", "Distance from the path", "mm, logarithmic", "position_error",
          position_error, "The start lies off the path on purpose."),
    Panel("body-distance", "Body to the nearest obstacle", "m", "minimal_distance", body_distance,
          "Figure 5 (b): below ε₂ a lowest-priority task pushes away, below ε₁ the first."),
    Panel("active-point", "Control point being pushed away", "number", "active_control_point",
          active_point, "Figure 5 (b): the control point nearest to an obstacle, while within ε₂."),
    Panel("ee-distance", "End effector to the nearest obstacle", "m", "ee_distance", ee_distance,
          "Figure 5 (a): below ε_ee, in red, the position task is pushed off its path."),
    Panel("pointing-error", "Pointing error", "cos α_d − cos α", "pointing_error", pointing_error,
          "Figure 7: above zero the axis is outside the cone; red while the task is in the stack."),
)
_PANEL = {panel.name: panel for panel in PANELS}


@dataclass(frozen=True)
class LetterFigure:
    """A figure of the letter: its panels, one under the other."""

    name: str
    title: str
    panels: tuple[str, ...]


SIMULATION = (
    LetterFigure("figure-4-joint-velocities", "Figure 4", ("joint-velocities",)),
    LetterFigure("figure-5-distances", "Figure 5", ("ee-distance", "active-point",
                                                    "body-distance")),
    LetterFigure("figure-6-velocities-and-distance", "Figure 6", ("joint-velocities",
                                                                  "active-point",
                                                                  "body-distance")),
    LetterFigure("figure-7-pointing-error", "Figure 7", ("pointing-error",)),
    LetterFigure("position-error", "Position error", ("position-error",)),
)
EXPERIMENT = (
    LetterFigure("figure-9-velocities-and-accelerations", "Figure 9",
                 ("joint-velocities", "joint-accelerations")),
    LetterFigure("figure-10-errors-and-distances", "Figure 10",
                 ("position-error", "pointing-error", "ee-distance", "active-point",
                  "body-distance")),
)


def write_all(recording: Recording, folder: Path) -> None:
    """Write the letter's figures and the picture of a run into a folder, as SVG and PNG."""
    for wanted in EXPERIMENT if recording.scenario.is_experiment else SIMULATION:
        panels = [p for p in map(_PANEL.__getitem__, wanted.panels) if p.fits(recording)]
        if panels:
            drawing.write(stacked(recording, panels, wanted.title), str(folder / wanted.name))
    if "ee_position" in recording and recording.ticks > 1:
        drawing.write(picture({label_of(recording): recording}), str(folder / "picture"))
    seen = recording.scenario.is_experiment and recording.scenario.sensor.kind == "camera"
    if seen and np.isfinite(recording["ee_distance"]).any():
        from scenarios.depth_figure import depth_figure

        nearest = float(recording["t"][int(np.argmin(recording["ee_distance"]))])
        drawing.write(depth_figure(recording, nearest), str(folder / "figure-8-depth-image"))
    if "time_tick" in recording and recording.ticks > 1:
        drawing.write(tick_times(recording), str(folder / "tick-times"))


def stacked(recording: Recording, panels: Sequence[Panel], title: str) -> Figure:
    """Return panels of one run, one under the other, in the letter's proportions."""
    fig, axes = drawing.figure(len(panels), width=6.4, height=0.8 + 1.7 * len(panels))
    label = label_of(recording)
    colour = drawing.colours([label])[label]
    for ax, panel in zip(axes, panels, strict=True):
        panel.draw(ax, recording, colour)
        ax.set_title(f"{panel.title} [{panel.unit}]", loc="left", fontsize=9, color=INK)
    if "joint-velocities" in [panel.name for panel in panels]:
        fig.legend(*axes[0].get_legend_handles_labels(), ncols=8, fontsize=7, frameon=False,
                   loc="outside lower center", handlelength=1.0, columnspacing=1.0)
    axes[-1].set_xlabel("time [s]")
    fig.suptitle(f"{title}: {recording.scenario.name}, {label}", x=0.01, ha="left", fontsize=9,
                 color=INK)
    return fig


def side_by_side(panel: Panel, recordings: Mapping[str, Recording]) -> dict[str, Figure]:
    """Return one small figure of `panel` a run, by label, with the same limits for all.

    A run whose values are far beyond the others' is cut, and its panel says where it goes.
    """
    chosen = drawing.colours(recordings)
    drawn = {}
    for label, recording in recordings.items():
        if panel.fits(recording):
            fig, (ax,) = drawing.figure()
            panel.draw(ax, recording, chosen[label])
            drawn[label] = fig
    if drawn:
        _share_limits(list(drawn.values()), [recordings[label]["t"] for label in drawn])
    return drawn


def _share_limits(figures: Sequence[Figure], times: Sequence[Array]) -> None:
    axes = [fig.axes[0] for fig in figures]
    logarithmic = axes[0].get_yscale() == "log"
    ranges = [ax.get_ylim() for ax in axes]
    if logarithmic:
        limits = min(low for low, _ in ranges), max(high for _, high in ranges)
    else:
        limits = drawing.shared_limits(ranges)
    end = max(float(t[-1]) for t in times)
    for ax, (low, high) in zip(axes, ranges, strict=True):
        ax.set_ylim(limits)
        ax.set_xlim(0.0, end)
        ax.xaxis.set_major_locator(MaxNLocator(4))
        if high - low > 1.1 * (limits[1] - limits[0]):
            ax.text(0.98, 0.96, f"cut: reaches {low:.2g} to {high:.2g}", color=ALERT, fontsize=8,
                    ha="right", va="top", transform=ax.transAxes)


def overlay(draw: Draw, recordings: Mapping[str, Recording]) -> Figure:
    """Return one figure with a curve a run, in each resolver's colour."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    for label, colour in drawing.colours(recordings).items():
        draw(ax, recordings[label], colour)
    ax.set_xlabel("time [s]")
    return fig


def departure(recordings: Mapping[str, Recording]) -> Figure:
    """Return how far each run's joints depart from the first run's [rad], logarithmic."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    first, *others = recordings
    reference = recordings[first]
    for label, colour in drawing.colours(recordings).items():
        if label in others:
            ticks = min(reference.ticks, recordings[label].ticks)
            apart = np.abs(recordings[label]["q"][:ticks] - reference["q"][:ticks]).max(axis=1)
            drawing.curve(ax, reference["t"][:ticks], np.maximum(apart, 1e-16), color=colour)
    ax.set_yscale("log")
    ax.set_xlabel("time [s]")
    return fig


def computing_time(recordings: Mapping[str, Recording]) -> Figure:
    """Return the median time of a tick's parts [us], with the whole tick's median and 99.9 %."""
    fig, (ax,) = drawing.figure(width=4.9, height=0.7 + 0.4 * len(recordings))
    parts = (("time_kinematics", 0.35), ("time_rows", 0.6), ("time_resolve", 1.0))
    chosen = drawing.colours(recordings)
    for row, (label, recording) in enumerate(recordings.items()):
        left = 0.0
        for signal, alpha in parts:
            width = 1e6 * float(np.median(recording[signal])) if signal in recording else 0.0
            ax.barh(row, width, left=left, color=chosen[label], alpha=alpha, height=0.6)
            left += width
        if "time_tick" in recording:
            for percent, mark in ((50.0, "|"), (99.9, "x")):
                ax.plot(1e6 * np.percentile(recording["time_tick"], percent), row, mark,
                        color=INK, markersize=7)
    ax.set_yticks(range(len(recordings)), list(recordings))
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    ax.set_xscale("log") if _wide(recordings) else ax.set_xlim(left=0.0)
    ax.set_xlabel("µs a tick")
    return fig


def tick_times(recording: Recording) -> Figure:
    """Return a histogram of the time of whole ticks [us], with the period of the loop."""
    fig, (ax,) = drawing.figure(width=6.4, height=2.4)
    label = label_of(recording)
    times = 1e6 * recording["time_tick"]
    edges = np.geomspace(max(times.min(), 1.0), max(times.max(), 2.0) * 1.01, 80)
    ax.hist(times, edges.tolist(), color=drawing.colours([label])[label], log=True)
    ax.set_xscale("log")
    period = 1e6 * recording.scenario.control.period
    ax.axvline(period, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate("period", (period, 1.0), xycoords=("data", "axes fraction"), fontsize=8, va="top",
                ha="right", color=INK, rotation=90)
    ax.set_xlabel("whole tick [µs]")
    ax.set_ylabel("ticks")
    ax.set_title(f"{recording.scenario.name}, {label}: {np.mean(times <= period):.2%} of "
                 f"{recording.ticks} ticks within the period", loc="left", fontsize=9, color=INK)
    return fig


def label_of(recording: Recording) -> str:
    """Return the label of the resolver that made a run, as "tpm published"."""
    return str(recording.scenario.make_resolver().label)


def _in_red(ax: Axes, t: Array, y: Array, mask: Array) -> None:
    if mask.any():
        drawing.curve(ax, t, np.where(mask, y, np.nan), color=ALERT, linewidth=1.7)


def _threshold(ax: Axes, t: Array, value: float, name: str) -> None:
    ax.axhline(value, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate(name, (1.0, value), xycoords=("axes fraction", "data"), fontsize=8, va="bottom",
                ha="right", color=INK)


def _wide(recordings: Mapping[str, Recording]) -> bool:
    medians = [float(np.median(r["time_tick"])) for r in recordings.values() if "time_tick" in r]
    return bool(medians) and max(medians) > 20 * min(medians)
