"""Time against accuracy of every candidate, one panel per family."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from scenarios.bench.candidates import DAQP, NUMPY
from scenarios.draw.figures import drawing

_LEAST, _MOST = 1e-16, 1e-4  # limits of residuals; values beyond are drawn at the edge
_MARKS = "osD^v<P"  # variants of a resolver share its colour
OWN = {NUMPY: "#8a8f98", DAQP: "#0b0c0d"}


def time_against_accuracy(rows: Sequence[dict[str, Any]]) -> Figure:
    """Return the figure: median time over the largest certified residual, both logarithmic.

    Low and left is better. Filled marks are cold starts, empty ones warm starts. A faint mark: some
    problems were reported as not solved. A cross: an answer reported as solved is not certified, or
    differs from the stored one.
    """
    names = list(dict.fromkeys(row["family"] for row in rows))
    labels = list(dict.fromkeys(row["resolver"] for row in rows))
    style = _styles(labels)
    columns = min(4, len(names))
    lines = -(-len(names) // columns)
    with matplotlib.rc_context({**drawing.style(), "font.size": 8.5}):
        fig = Figure(figsize=(2.6 * columns + 0.4, 2.35 * lines + 1.1), layout="constrained")
        axes = list(fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
        for ax, name in zip(axes, names, strict=False):
            for row in rows:
                if row["family"] == name:
                    _draw(ax, row, style)
            ax.set(xscale="log", yscale="log", title=name, xlim=(_LEAST / 4.0, _MOST * 4.0))
            ax.set_xticks([1e-16, 1e-12, 1e-8, 1e-4])
        for ax in axes[len(names):]:
            ax.set_axis_off()
        fig.supxlabel("largest residual that the certificate finds (right edge: 1e-4 and more)",
                      fontsize=9.0)
        fig.supylabel("median time of a solve [µs]", fontsize=9.0)
        fig.legend(handles=_legend(style), loc="outside upper center", ncols=min(6, len(style)),
                   frameon=False, fontsize=8.5, handletextpad=0.2, columnspacing=1.2)
    return fig


def _draw(ax: Axes, row: dict[str, Any], style: dict[str, tuple[str, str]]) -> None:
    label, warm = _plain(row["resolver"])
    colour, mark = style[label]
    residual = row["largest_residual"]
    x = _MOST if residual is None else min(max(residual, _LEAST), _MOST)
    answered = 1.0 - row["unsolved"] / row["problems"]
    ax.plot(x, row["median_us"], mark, color=colour, markersize=5.5, clip_on=False, zorder=3,
            alpha=0.4 if row["unsolved"] else 1.0, markerfacecolor="none" if warm else colour)
    if row["wrong"] or row["certified"] < answered - 1e-9:
        ax.plot(x, row["median_us"], "x", color=drawing.ALERT, markersize=4.0, clip_on=False,
                markeredgewidth=0.8, zorder=4)


def _plain(label: str) -> tuple[str, bool]:
    """Return the label without " warm", and whether it was there."""
    return label.removesuffix(" warm"), label.endswith(" warm")


def _styles(labels: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return colour and mark of each candidate, warm or not."""
    plain = list(dict.fromkeys(_plain(label)[0] for label in labels))
    colours = {**drawing.colours(label for label in plain if label not in OWN), **OWN}
    found: dict[str, tuple[str, str]] = {}
    for label in plain:
        variants = sum(colour == colours[label] for colour, _ in found.values())
        found[label] = colours[label], _MARKS[variants % len(_MARKS)]
    return found


def _legend(style: dict[str, tuple[str, str]]) -> list[Line2D]:
    marks = [Line2D([], [], color=colour, marker=mark, linestyle="", markersize=5.5, label=label)
             for label, (colour, mark) in style.items()]
    empty = Line2D([], [], color=drawing.INK, marker="o", linestyle="", markersize=5.5,
                   markerfacecolor="none", label="warm start")
    wrong = Line2D([], [], color=drawing.ALERT, marker="x", linestyle="", markersize=4.0,
                   label="a wrong answer")
    faint = Line2D([], [], color=drawing.INK, marker="o", linestyle="", markersize=5.5, alpha=0.4,
                   label="some not solved")
    return [*marks, empty, faint, wrong]
