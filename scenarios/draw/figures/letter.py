"""The letter's figures 4 to 7, 9 and 10 and a few more, drawn from a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK
from scenarios.draw.figures.panels import PANEL, Panel
from scenarios.draw.figures.picture import picture
from scenarios.draw.figures.timeline import timeline

if TYPE_CHECKING:
    from scenarios.loop.recording import Recording


@dataclass(frozen=True)
class LetterFigure:
    """A figure of the letter: its panels, one below the other."""

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
    LetterFigure("task-errors", "Errors of the tasks", ("task-errors", "task-angles")),
)
EXPERIMENT = (
    LetterFigure("figure-9-velocities-and-accelerations", "Figure 9",
                 ("joint-velocities", "joint-accelerations")),
    LetterFigure("figure-10-errors-and-distances", "Figure 10",
                 ("position-error", "pointing-error", "ee-distance", "active-point",
                  "body-distance")),
)


def write_all(recording: Recording, folder: Path) -> None:
    """Write a run's figures to a folder: the letter's, its picture, its stack over time.

    The present style gives the formats, by default SVG and PNG; see `drawing.styled`.
    """
    with drawing.styled(drawing.present()):
        for name, fig in _all(recording):
            drawing.write(fig, str(folder / name))


def _all(recording: Recording) -> Iterator[tuple[str, Figure]]:
    for wanted in EXPERIMENT if recording.scenario.is_experiment else SIMULATION:
        panels = [p for p in map(PANEL.__getitem__, wanted.panels) if p.fits(recording)]
        if panels:
            yield wanted.name, stacked(recording, panels, wanted.title)
    if "ee_position" in recording and recording.ticks > 1:
        yield "picture", picture({label_of(recording): recording})
    if recording.ticks > 1:
        yield "stack", timeline(recording)
    if recording.depth is not None and np.isfinite(recording.depth.distance[-1]):
        from scenarios.draw.figures.depth import depth_figure

        yield "figure-8-depth-image", depth_figure(recording.depth)
    if "time_tick" in recording and recording.ticks > 1:
        yield "tick-times", tick_times(recording)


def stacked(recording: Recording, panels: Sequence[Panel], title: str) -> Figure:
    """Return panels of one run, one below the other, in the letter's proportions."""
    fig, axes = drawing.figure(len(panels), width=6.4, height=0.8 + 1.7 * len(panels))
    label = label_of(recording)
    colour = drawing.colours([label])[label]
    for ax, panel in zip(axes, panels, strict=True):
        panel.draw(ax, recording, colour)
        ax.set_title(f"{panel.title} [{panel.unit}]", loc="left")
    lines = axes[0].get_legend_handles_labels()
    if lines[0]:
        fig.legend(*lines, ncols=8 if drawing.present().titled else 4, fontsize="small",
                   frameon=False, loc="outside lower center", handlelength=1.8, columnspacing=1.0)
    axes[-1].set_xlabel("time [s]")
    if drawing.present().titled:
        fig.suptitle(f"{title}: {recording.scenario.name}, {label}", x=0.01, ha="left",
                     fontsize="medium", color=INK)
    return fig


def tick_times(recording: Recording) -> Figure:
    """Return a histogram of the tick times [us], with the period of the loop."""
    fig, (ax,) = drawing.figure(width=6.4, height=2.4)
    label = label_of(recording)
    times = 1e6 * recording["time_tick"]
    edges = np.geomspace(max(times.min(), 1.0), max(times.max(), 2.0) * 1.01, 80)
    ax.hist(times, edges.tolist(), color=drawing.colours([label])[label], log=True)
    ax.set_xscale("log")
    period = 1e6 * recording.scenario.control.period
    ax.axvline(period, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate("period", (period, 1.0), xycoords=("data", "axes fraction"), fontsize="small",
                va="top", ha="right", color=INK, rotation=90)
    ax.set_xlabel("whole tick [µs]")
    ax.set_ylabel("ticks")
    run = f"{recording.scenario.name}, {label}: " if drawing.present().titled else ""
    ax.set_title(f"{run}{np.mean(times <= period):.2%} of {recording.ticks} ticks within the "
                 "period", loc="left")
    return fig


def label_of(recording: Recording) -> str:
    """Return the label of a run's resolver, such as "tpm published"."""
    return recording.facts.resolver.label
