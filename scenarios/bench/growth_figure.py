"""Time of a solve over the number of tasks and over the number of joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator, ScalarFormatter

from scenarios.bench.candidates import NUMPY
from scenarios.bench.growth import LEVEL_LESS, ROWS, exponents
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK, Array

_PANELS = {"tasks": ("number of tasks $l$", "l"), "joints": ("number of joints $n$", "n")}
_NUMPY = "#8a8f98"   # as in the benchmark of resolvers
_APART = 0.058       # of two labels, as a share of the height of the axes
_UNMARKED = (7, 9)   # sizes without a label, which would overlap
_MARKS = "osD^v<P>X"


def time_over_size(rows: Sequence[dict[str, Any]]) -> Figure:
    """Return the figure: medians, with the 95th percentile as the upper edge of a band.

    Both axes are logarithmic, so that a straight line is a power; its exponent is beside the name.
    """
    labels = list(dict.fromkeys(row["resolver"] for row in rows))
    named = [label for label in labels if label != NUMPY]
    colours = {**drawing.colours([*named, *LEVEL_LESS]), NUMPY: _NUMPY}
    marks = {label: _MARKS[i % len(_MARKS)] for i, label in enumerate(labels)}
    with matplotlib.rc_context({**drawing.style(), "font.size": 9.0}):
        fig = Figure(figsize=(9.2, 3.9), layout="constrained")
        axes = fig.subplots(1, 2, sharey=True)
        for ax, (figure, (xlabel, _)) in zip(axes, _PANELS.items(), strict=True):
            some = [row for row in rows if row["figure"] == figure]
            for label in labels:
                draw_band(ax, figure, [row for row in some if row["resolver"] == label],
                          colours[label], marks[label])
            scale_axes(ax, sorted({row[figure] for row in some}))
            ax.set(xlabel=xlabel, title=_title(figure, some))
            ax.tick_params(labelleft=True)
        for ax, (figure, (_, letter)) in zip(axes, _PANELS.items(), strict=True):
            name_lines(ax, figure, letter, [row for row in rows if row["figure"] == figure],
                       colours)
        axes[0].set_ylabel("time of a solve [µs]: median, band to the 95th percentile",
                           fontsize=8.0)
    return fig


def draw_band(ax: Axes, figure: str, rows: Sequence[dict[str, Any]], colour: str,
              mark: str) -> None:
    """Draw one median over the sizes of a figure, and the band up to the 95th percentile."""
    size, median, p95 = (np.array([row[key] for row in rows], dtype=float)
                         for key in (figure, "median_us", "p95_us"))
    dashed = rows[0]["resolver"] == NUMPY
    ax.fill_between(size, median, p95, color=colour, alpha=0.15, linewidth=0)
    ax.plot(size, median, marker=mark, color=colour, markersize=3.6, linewidth=1.4,
            linestyle=(0, (4, 2)) if dashed else "-")


def scale_axes(ax: Axes, sizes: Sequence[int], unmarked: Sequence[int] = _UNMARKED) -> None:
    """Make both axes logarithmic, with a number at each size but the unmarked ones."""
    ax.set(xscale="log", yscale="log")
    ax.set_xticks([size for size in sizes if size not in unmarked])
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(ScalarFormatter())


def _title(figure: str, rows: Sequence[dict[str, Any]]) -> str:
    if figure == "tasks":
        return f"{rows[0]['joints']} joints, tasks of {ROWS} rows"
    return f"{rows[0]['tasks']} tasks of {ROWS} rows"


def name_lines(ax: Axes, figure: str, letter: str, rows: Sequence[dict[str, Any]],
               colours: dict[str, str]) -> None:
    """Write each name and exponent beside the end of its line without overlap."""
    powers = exponents(rows, figure)
    ends = {row["resolver"]: row for row in sorted(rows, key=lambda row: float(row[figure]))}
    order = sorted(ends, key=lambda label: float(ends[label]["median_us"]))
    low, high = np.log(ax.get_ylim())
    heights = [(np.log(ends[label]["median_us"]) - low) / (high - low) for label in order]
    for label, height in zip(order, _spread(heights), strict=True):
        row, power = ends[label], powers[label]
        text = label if np.isnan(power) else f"{label}  ${letter}^{{{power:.1f}}}$"
        ax.annotate(text, (row[figure], row["median_us"]), (1.05, height), color=INK,
                    textcoords="axes fraction", va="center", fontsize=8.5, annotation_clip=False,
                    arrowprops={"arrowstyle": "-", "color": colours[label], "linewidth": 0.9,
                                "relpos": (0.0, 0.5), "shrinkA": 1.0, "shrinkB": 3.0})


def _spread(heights: Sequence[float]) -> Array:
    """Return the nearest ascending heights that are at least _APART."""
    steps = np.arange(len(heights)) * _APART
    below = np.asarray(heights) - steps  # to be made ascending: pool what is not
    pools: list[list[float]] = []
    for height in below:
        pools.append([height])
        while len(pools) > 1 and np.mean(pools[-2]) > np.mean(pools[-1]):
            pools[-2:] = [pools[-2] + pools[-1]]
    return np.asarray(steps + np.concatenate([np.full(len(pool), np.mean(pool))
                                              for pool in pools]))
