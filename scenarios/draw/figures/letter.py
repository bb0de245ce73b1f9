"""The figures of runs after the letter's figures 4 to 10, and a few more.

A figure has the letter's number only where every part of it is drawn from the run that the letter
shows there, as shipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hierarchy.errors import HierarchyError
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK
from scenarios.draw.figures.panels import PANEL, Panel
from scenarios.draw.figures.picture import picture
from scenarios.draw.figures.timeline import timeline

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

_STRIP, _NARROW_STRIP, _MOST_STRIPS = 1.7, 1.2, 3  # heights [in], and up to how many are high


@dataclass(frozen=True)
class Part:
    """Part (a), (b), ... of a figure: its panels, and the scenarios from which the letter has it.

    None of them where the letter has no such figure.
    """

    panels: tuple[str, ...]
    of: tuple[str, ...] = ()


@dataclass(frozen=True)
class LetterFigure:
    """A figure of a run, and of the letter if it has a number there."""

    name: str
    parts: tuple[Part, ...]
    number: int | None = None

    @property
    def panels(self) -> tuple[str, ...]:
        """The panels of one run, each once."""
        return tuple(dict.fromkeys(name for part in self.parts for name in part.panels))


_ELLIPSE, _HUMAN = ("ellipse", "ellipse-published"), ("human",)
_BODY = ("active-point", "body-distance")
SIMULATION = (
    LetterFigure("joint-velocities", (Part(("joint-velocities",), ("ellipse-velocity",)),
                                      Part(("joint-velocities",), _ELLIPSE)), 4),
    LetterFigure("distances", (Part(("ee-distance",), _ELLIPSE), Part(_BODY, _ELLIPSE)), 5),
    LetterFigure("velocities-and-distance", (Part(("joint-velocities",), ("ellipse-3d",)),
                                             Part(_BODY, ("ellipse-3d",))), 6),
    LetterFigure("pointing-error", (Part(("pointing-error",), ("ellipse-35deg",)),
                                    Part(("pointing-error",), ("ellipse-35deg-equality",))), 7),
    LetterFigure("position-error", (Part(("position-error",)),)),
    LetterFigure("task-errors", (Part(("task-errors",)), Part(("task-angles",)))),
)
EXPERIMENT = (
    LetterFigure("velocities-and-accelerations", (Part(("joint-velocities",), _HUMAN),
                                                  Part(("joint-accelerations",), _HUMAN)), 9),
    LetterFigure("errors-and-distances", (
        Part(("position-components",), _HUMAN), Part(("pointing-error",), _HUMAN),
        Part(("ee-distance",), _HUMAN), Part(_BODY, _HUMAN)), 10),
)
_SINGLE = ("velocities-and-distance",)  # of two runs, its panels are in other figures


def write_all(recording: Recording, folder: Path) -> None:
    """Write a run's figures to a folder: the letter's, its picture, its stack over time.

    The present style gives the formats, by default SVG and PNG; see `drawing.styled`.
    """
    with drawing.styled(drawing.present()):
        for name, fig in _all(recording):
            drawing.write(fig, str(folder / name))


def write_together(recordings: Sequence[Recording], folder: Path) -> None:
    """Write figures of several runs to a folder, their parts (a), (b), ... one below the other.

    These are the letter's figures whose runs are given, and for two runs each quantity of both.
    Raises HierarchyError if there is no figure.
    """
    with drawing.styled(drawing.present()):
        drawn = dict(_together(recordings))
        if not drawn:
            raise HierarchyError("more than two runs make only the letter's figures 4 to 7, 9 and "
                                 "10, and its runs are not among these")
        for name, fig in drawn.items():
            drawing.write(fig, str(folder / name))


def _all(recording: Recording) -> Iterator[tuple[str, Figure]]:
    for wanted in EXPERIMENT if recording.scenario.is_experiment else SIMULATION:
        panels = _fitting(wanted.panels, recording)
        if panels:
            stem, title = _named(wanted, recording)
            whole = all(is_letters(recording, part.of) for part in wanted.parts)
            yield stem, stacked([(recording, _fitting(part.panels, recording))
                                 for part in wanted.parts] if whole else [(recording, panels)],
                                title, lettered=whole)
    if "ee_position" in recording and recording.ticks > 1:
        yield "picture", picture({label_of(recording): recording})
    if recording.ticks > 1:
        yield "stack", timeline(recording)
    if recording.depth is not None and np.isfinite(recording.depth.distance[-1]):
        from scenarios.draw.figures.depth import depth_figure

        number = "figure-8-" if is_letters(recording, _HUMAN) else ""
        yield f"{number}depth-image", depth_figure(recording.depth)
    if "time_tick" in recording and recording.ticks > 1:
        yield "tick-times", tick_times(recording)


def _together(recordings: Sequence[Recording]) -> Iterator[tuple[str, Figure]]:
    """Yield the letter's figures whose runs are there, then those of two runs side by side."""
    shown: set[str] = set()
    for wanted in (*SIMULATION, *EXPERIMENT):
        runs = [next((run for run in recordings if is_letters(run, part.of)), None)
                for part in wanted.parts]
        parts = [(run, _fitting(part.panels, run))
                 for part, run in zip(wanted.parts, runs, strict=True) if run is not None]
        if len(parts) == len(wanted.parts):
            yield f"figure-{wanted.number}-{wanted.name}", stacked(
                parts, f"Figure {wanted.number}", lettered=True)
            shown |= {wanted.name} if len({id(run) for run in runs}) > 1 else set()
    if len(recordings) != 2:
        return
    experiment = all(run.scenario.is_experiment for run in recordings)
    for wanted in EXPERIMENT if experiment else SIMULATION:
        both = [(run, _fitting(wanted.panels, run)) for run in recordings]
        if wanted.name not in (*shown, *_SINGLE) and all(panels for _, panels in both):
            yield wanted.name, stacked(both, wanted.name.replace("-", " ").capitalize(),
                                       lettered=True)


def _fitting(names: Sequence[str], recording: Recording) -> list[Panel]:
    return [panel for panel in map(PANEL.__getitem__, names) if panel.fits(recording)]


def _named(wanted: LetterFigure, recording: Recording) -> tuple[str, str]:
    """Return the file name and the title of a figure of one run, with the letter's number if any.

    A run that is one of several parts has the letter of its part: "figure-4b-joint-velocities".
    """
    own = [i for i, part in enumerate(wanted.parts) if is_letters(recording, part.of)]
    if not own:
        return wanted.name, wanted.name.replace("-", " ").capitalize()
    part = "" if len(own) == len(wanted.parts) else "abcd"[own[0]]
    return (f"figure-{wanted.number}{part}-{wanted.name}",
            f"Figure {wanted.number}" + (f" ({part})" if part else ""))


def is_letters(recording: Recording, names: Sequence[str]) -> bool:
    """Whether this is a whole run of one of the scenarios of these names, as shipped."""
    from scenarios.config import load

    name = recording.scenario.name
    return name in names and recording.fault is None and recording.scenario == load(name)


def stacked(parts: Sequence[tuple[Recording, Sequence[Panel]]], title: str,
            lettered: bool = False) -> Figure:
    """Return panels of one or more runs, one below the other, in the letter's proportions.

    With `lettered`, the first panel of each part has its letter, (a), (b), ..
    """
    rows = [(i, run, panel) for i, (run, panels) in enumerate(parts) for panel in panels]
    strip = _STRIP if len(rows) <= _MOST_STRIPS else _NARROW_STRIP
    fig, axes = drawing.figure(len(rows), width=6.4, height=0.8 + strip * len(rows))
    runs = {id(run): _run_of(run) for run, _ in parts}
    before = -1
    for ax, (i, run, panel) in zip(axes, rows, strict=True):
        label = label_of(run)
        panel.draw(ax, run, drawing.colours([label])[label])
        letter = f"({'abcdefgh'[i]}) " if lettered and i != before else ""
        which = f", {_run_of(run)}" if drawing.present().titled and letter and len(runs) > 1 else ""
        ax.set_title(f"{letter}{panel.heading}{which}", loc="left")
        before = i
    _explain(fig, axes)
    axes[-1].set_xlabel("time [s]")
    if drawing.present().titled:
        said = f"{title}: {next(iter(runs.values()))}" if len(runs) == 1 else title
        fig.suptitle(said, x=0.01, ha="left", fontsize="medium", color=INK)
    return fig


def _explain(fig: Figure, axes: Sequence[Axes]) -> None:
    """Add one legend of all lines that have a name, on whichever axes they are."""
    lines = {label: line for ax in axes
             for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    if lines:
        fig.legend(list(lines.values()), list(lines), fontsize="small", frameon=False,
                   ncols=7 if drawing.present().titled else 4, handlelength=1.8,
                   columnspacing=1.0, loc="outside lower center")


def tick_times(recording: Recording) -> Figure:
    """Return a histogram of the tick times [us], with the period of the loop."""
    fig, (ax,) = drawing.figure(width=6.4, height=2.4)
    label = label_of(recording)
    times = 1e6 * recording["time_tick"]
    edges = np.geomspace(max(times.min(), 1.0), max(times.max(), 2.0) * 1.01, 80)
    ax.hist(times, edges.tolist(), color=drawing.colours([label])[label])
    drawing.make_logarithmic(ax, "x")
    drawing.make_logarithmic(ax, "y")
    period = 1e6 * recording.scenario.control.period
    ax.axvline(period, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate("period", (period, 1.0), xycoords=("data", "axes fraction"), fontsize="small",
                va="top", ha="right", color=INK, rotation=90)
    ax.set_xlabel("whole tick [µs]")
    ax.set_ylabel("ticks")
    run = f"{_run_of(recording)}: " if drawing.present().titled else ""
    ax.set_title(f"{run}{np.mean(times <= period):.2%} of {recording.ticks} ticks within the "
                 "period", loc="left")
    return fig


def label_of(recording: Recording) -> str:
    """Return the label of a run's resolver, such as "tpm-published"."""
    return recording.facts.resolver.label


def _run_of(recording: Recording) -> str:
    return f"{recording.scenario.name}, {label_of(recording)}"
