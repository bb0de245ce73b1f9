"""The figures of runs after the letter's figures 4 to 10, and a few more.

A figure has the letter's number only where every part of it is drawn from the run that the letter
shows there, as shipped.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from hierarchy.errors import check_name, refuse
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole
from scenarios.config import load
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK
from scenarios.draw.figures.panels import PANEL, Panel
from scenarios.draw.figures.picture import picture
from scenarios.draw.figures.timeline import timeline
from scenarios.files import added_to, claim, named, whole
from scenarios.measure.run_folder import load_run
from scenarios.recording.recording import DepthView, Recording

Names = tuple[str, ...]
_STRIP, _NARROW_STRIP, _MOST_STRIPS = 1.7, 1.2, 3  # heights [in], and up to how many are high

# Of a depth image:
_POINTS, _NEAREST, _END = "#2fb344", "#2f6bff", "#17c3d6"
_SHADES = ListedColormap(np.repeat(np.linspace(1.0, 0.2, 256)[:, None], 3, axis=1)
                         ).with_extremes(bad="#000000")
_CONTRAST = 1.1  # everything farther than the points by this factor is equally dark
_AROUND = 0.35   # [m] shown around the points


class LetterFigure(NamedTuple):
    """A figure of a run, and of the letter if it has a number there.

    parts : (a), (b), ...: the panels of each, and the scenarios from which the letter has it.
    """

    name: str
    parts: tuple[tuple[Names, Names], ...]
    number: int | None = None


_ELLIPSE, _HUMAN = ("ellipse", "ellipse-published"), ("human",)
_VELOCITIES, _ACCELERATIONS = ("joint-velocities",), ("joint-accelerations",)
_BODY, _TIP, _CONE = ("active-point", "body-distance"), ("ee-distance",), ("pointing-error",)
_TASKS = LetterFigure("task-errors", ((("task-errors", "task-angles"), ()),))
SIMULATION = (
    LetterFigure("joint-velocities", (
        (_VELOCITIES, ("ellipse-velocity",)), (_VELOCITIES, _ELLIPSE)), 4),
    LetterFigure("distances", ((_TIP, _ELLIPSE), (_BODY, _ELLIPSE)), 5),
    LetterFigure("velocities-and-distance", (
        (_VELOCITIES, ("ellipse-3d",)), (_BODY, ("ellipse-3d",))), 6),
    LetterFigure("pointing-error", (
        (_CONE, ("ellipse-35deg",)), (_CONE, ("ellipse-35deg-equality",))), 7),
    LetterFigure("position-error", ((("position-error",), ()),)),
    _TASKS,
)
EXPERIMENT = (
    LetterFigure("velocities-and-accelerations", (
        (_VELOCITIES, _HUMAN), (_ACCELERATIONS, _HUMAN)), 9),
    LetterFigure("errors-and-distances", (
        (("position-components",), _HUMAN), (_CONE, _HUMAN), (_TIP, _HUMAN), (_BODY, _HUMAN)), 10),
    _TASKS,
)
_SHORT = 10  # letters of a label, of which seven fit in a line
_SINGLE = ("velocities-and-distance",)  # of two runs, its panels are in other figures


def redraw(runs: Sequence[str | Path], style: str = "screen",
           out: str | Path | None = None) -> list[Path]:
    """Draw the figures of run folders in a style, and return the files.

    Those of one run replace the figures in its folder, or go to `out`, which must be new or empty.
    Several runs need `out`.

    Raises
    ------
    HierarchyError : one of `runs` is not a run folder or is damaged, `style` is not in
        drawing.STYLES, `out` is missing or cannot be written, or there is nothing to draw.
    """
    check_name("style", style, drawing.STYLES)
    refuse(len(runs) > 1 and out is None,
           f"figures of {len(runs)} runs belong to no run's folder: give --out")
    claimed = None if out is None else claim(out)
    recordings = [load_run(run) for run in runs]
    writing = added_to(Path(runs[0])) if claimed is None else whole(claimed)
    with drawing.styled(drawing.STYLES[style]), named(claimed or runs[0]), writing as partial:
        write_all(recordings, partial)
        names = sorted(file.name for file in partial.iterdir())
        refuse(not names, f"{runs[0]}: a run of fewer than two ticks has no figure")
    return [(claimed or Path(runs[0])) / name for name in names]


def write_all(recordings: Sequence[Recording], folder: Path) -> None:
    """Write the figures of one run or several to a folder, in the present style.

    Those of one run are the letter's, its picture and its stack over time; those of several are the
    letter's as far as their runs are there, their parts (a), (b), ... one below the other, and of
    two runs also each quantity of both. Raises HierarchyError if several runs make no figure.
    """
    with drawing.styled(drawing.present()):
        drawn = dict(figures(recordings))
        refuse(not drawn and len(recordings) > 1, "more than two runs make only the letter's "
               "figures 4 to 7, 9 and 10, and its runs are not among these")
        for name, fig in drawn.items():
            drawing.write(fig, str(folder / name))


def figures(recordings: Sequence[Recording]) -> Iterator[tuple[str, Figure]]:
    """Yield the letter's figures whose runs are there, then the others of one run or of two."""
    alone, shown = len(recordings) == 1, set[str]()
    # Section IV-B of the letter has physics and sensed distances.
    usual = SIMULATION if any((run.scenario.plant.kind, run.scenario.sensor.kind) == (
        "kinematic", "exact") for run in recordings) else EXPERIMENT
    for wanted in usual if alone else (*SIMULATION, *EXPERIMENT):
        runs = [next((run for run in recordings if is_letters(run, of)), None)
                for _, of in wanted.parts]
        parts = [(run, _fitting(panels, run))
                 for (panels, _), run in zip(wanted.parts, runs, strict=True) if run is not None]
        if len(parts) == len(runs):
            yield f"figure-{wanted.number}-{wanted.name}", stacked(
                parts, f"Figure {wanted.number}", lettered=True)
            shown |= {wanted.name} if alone or len({id(run) for run in runs}) > 1 else set()
    for wanted in usual if len(recordings) < 3 else ():
        names = list(dict.fromkeys(name for panels, _ in wanted.parts for name in panels))
        beside = [(run, _fitting(names, run)) for run in recordings]
        if (wanted.name not in shown and (alone or wanted.name not in _SINGLE)
                and all(panels for _, panels in beside)):
            stem, title = _named(wanted, recordings)
            yield stem, stacked(beside, title, lettered=not alone)
    if alone:
        yield from _others(recordings[0])


def _others(recording: Recording) -> Iterator[tuple[str, Figure]]:
    """Yield the picture of a run, its stack over time, its depth image and its times of ticks."""
    if recording.ticks > 1:
        yield "picture", picture({recording.facts.resolver.label: recording})
        yield "stack", timeline(recording)
        yield "tick-times", tick_times(recording)
    if recording.depth is not None and np.isfinite(recording.depth.distance[-1]):
        number = "figure-8-" if is_letters(recording, _HUMAN) else ""
        yield f"{number}depth-image", depth_figure(recording.depth)


def _fitting(names: Sequence[str], recording: Recording) -> list[Panel]:
    return [panel for panel in map(PANEL.__getitem__, names)
            if panel.fits(recording) and panel.shows(recording)]


def _named(wanted: LetterFigure, recordings: Sequence[Recording]) -> tuple[str, str]:
    """Return file name and title of a figure that is not the letter's, or one part of it.

    A run that is one of several parts has the letter of its part: "figure-4b-joint-velocities".
    """
    own = [letter for letter, (_, of) in zip("abcd", wanted.parts, strict=False)
           if len(recordings) == 1 and is_letters(recordings[0], of)]
    if not own:
        return wanted.name, wanted.name.replace("-", " ").capitalize()
    return (f"figure-{wanted.number}{own[0]}-{wanted.name}", f"Figure {wanted.number} ({own[0]})")


def is_letters(recording: Recording, names: Names) -> bool:
    """Whether this is a whole run of one of the scenarios of these names, as shipped."""
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
        label = run.facts.resolver.label
        panel.draw(ax, run, drawing.colours([label])[label])
        letter = f"({'abcdefgh'[i]}) " if lettered and i != before else ""
        which = f", {_run_of(run)}" if drawing.present().titled and letter and len(runs) > 1 else ""
        ax.set_title(f"{letter}{panel.heading}{which}", loc="left")
        before = i
    joints = {name for run, _ in parts for name in run.facts.robot.speed_names}  # also of "_a"
    lines = {label: line for ax in axes for line, label in (
        *zip(*ax.get_legend_handles_labels(), strict=True),
        *((line, str(line.get_label())) for line in ax.lines if line.get_label() in joints))}
    if lines:
        wide = drawing.present().titled and max(map(len, lines)) <= _SHORT
        legend = fig.legend(list(lines.values()), list(lines), fontsize="small", frameon=False,
                            ncols=7 if wide else 4, handlelength=1.8,
                            columnspacing=1.0, loc="outside lower center")
        for text in legend.get_texts():
            text.set_parse_math(False)  # $ in the name of a joint begins no equation
    axes[-1].set_xlabel("time [s]")
    if drawing.present().titled:
        said = f"{title}: {next(iter(runs.values()))}" if len(runs) == 1 else title
        fig.suptitle(said, x=0.01, ha="left", fontsize="medium", color=INK)
    return fig


def tick_times(recording: Recording) -> Figure:
    """Return a histogram of the tick times [us], with the period of the loop."""
    fig, (ax,) = drawing.figure(width=6.4, height=2.4)
    label = recording.facts.resolver.label
    times = 1e6 * recording["time_tick"]
    edges = np.geomspace(max(times.min(), 1.0), max(times.max(), 2.0) * 1.01, 80)
    ax.hist(times, edges.tolist(), color=drawing.colours([label])[label])
    drawing.make_logarithmic(ax, "x")
    drawing.make_logarithmic(ax, "y")
    period = 1e6 * recording.scenario.control.period
    ax.axvline(period, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate("period", (period, 1.0), xycoords=("data", "axes fraction"), fontsize="small",
                va="top", ha="right", color=INK, rotation=90)
    ax.set_xlabel(f"{', '.join(filter(None, ('whole tick', recording.beside_computing)))} [µs]")
    ax.set_ylabel("ticks")
    run = f"{_run_of(recording)}: " if drawing.present().titled else ""
    ax.set_title(f"{run}{100.0 * np.mean(times <= period):.2f} % of {recording.ticks} ticks within "
                 "the period", loc="left")
    return fig


def _run_of(recording: Recording) -> str:
    return f"{recording.scenario.name}, {recording.facts.resolver.label}"


def depth_figure(view: DepthView) -> Figure:
    """Return figure 8: an image of the camera, points as circles, lines to the nearest pixels.

    The line of D_minimal is blue, that of the end effector cyan, the others are thin. Near is
    bright, black is no reading. Only the surroundings of the points are shown.
    """
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    (height, width), (fx, fy, cx, cy) = view.image.shape, view.camera[:4].tolist()
    pinhole = Pinhole(width, height, fx, fy, cx, cy, view.camera[4:7],
                      view.camera[7:].reshape(3, 3))
    pixels = pinhole.project(view.points)
    reading = np.asarray(view.image, dtype=float)
    read = reading[reading > 0.0]
    near = float(np.quantile(read, 0.001)) if read.size else 0.0
    ax.imshow(np.where(reading > 0.0, reading, np.nan), cmap=_SHADES, vmin=near,
              vmax=max(_CONTRAST * float(pixels[:, 2].max()), near + 0.1), interpolation="nearest")
    ends = [divmod(int(at), pinhole.width)[::-1] if at >= 0 else None for at in view.pixel]
    tip = len(pixels) - 1
    for k, end in enumerate(ends):
        if end is not None and k not in (view.active, tip):
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=_POINTS, linewidth=0.6, alpha=0.8)
    for k, colour, width, what in ((tip, _END, 3.2, "end effector"),
                                   (view.active, _NEAREST, 1.6, r"$D_{minimal}$")):
        end = ends[k] if k >= 0 else None
        if end is not None:
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=colour, linewidth=width,
                    solid_capstyle="round", label=f"{what} {view.distance[k]:.2f} m")
    ax.plot(*pixels[:tip, :2].T, "o", markerfacecolor="none", markeredgecolor=_POINTS,
            markersize=6, markeredgewidth=1.5)
    ax.plot(*pixels[tip, :2], "o", markerfacecolor="none", markeredgecolor=_END, markersize=8,
            markeredgewidth=1.8)
    _show_around(ax, np.vstack([pixels[:, :2], *(end for end in ends if end is not None)]),
          pinhole.fx * _AROUND / max(float(np.median(pixels[:, 2])), _AROUND), view.image.shape)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1,
                  borderpad=0.0, handlelength=1.4, frameon=False, fontsize=9.0)
    ax.set_title(f"t = {view.t:.2f} s", pad=4.0, loc="left", fontsize=9.0)
    return fig


def _show_around(ax: Axes, pixels: Array, around: float, shape: tuple[int, ...]) -> None:
    """Show the pixels (K, 2) and their surroundings, in the proportions of the image."""
    height, width = shape
    low, high = pixels.min(axis=0) - around, pixels.max(axis=0) + around
    share = min(max((high[0] - low[0]) / width, (high[1] - low[1]) / height), 1.0)
    u = np.clip((low[0] + high[0] - share * width) / 2, 0.0, width * (1.0 - share)) - 0.5
    v = np.clip((low[1] + high[1] - share * height) / 2, 0.0, height * (1.0 - share)) - 0.5
    ax.set_xlim(u, u + share * width)
    ax.set_ylim(v + share * height, v)
    ax.set_axis_off()
