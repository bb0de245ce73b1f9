"""Time over tasks, rows, joints, and pairs of control points and obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from scaling_timed import PARTS

from scenarios.bench.candidates import NUMPY
from scenarios.bench.growth import LEVEL_LESS
from scenarios.bench.growth_figure import draw_band, name_lines, scale_axes
from scenarios.draw.figures import drawing

_PANELS = {"tasks": ("number of tasks $l$", "l"), "rows": ("number of rows $m$", "m"),
           "joints": ("number of joints $n$", "n"),
           "pairs": ("pairs $p$ of a point and an obstacle", "p")}
_UNMARKED = {"tasks": (4,), "rows": (), "joints": (7, 15, 45, 150, 200),
             "pairs": (136, 528, 2080, 8320)}
_NUMPY = "#8a8f98"  # as in the other benchmarks
_PARTS = dict(zip(PARTS, ("#bcbd22", "#009e73", "#d55e00", drawing.INK), strict=True))
_MARKS = "osD^v<P>X"


def time_over_sizes(rows: Sequence[dict[str, Any]]) -> Figure:
    """Return the figure: medians, with the 95th percentile as the upper edge of a band.

    Both axes are logarithmic, so that a straight line is a power; its exponent is beside the name.
    Panels without rows are left out.
    """
    panels = [figure for figure in _PANELS if any(row["figure"] == figure for row in rows)]
    labels = list(dict.fromkeys(row["resolver"] for row in rows))
    resolvers = [label for label in labels if label not in (NUMPY, *PARTS)]
    colours = {**drawing.colours([*resolvers, *LEVEL_LESS]), NUMPY: _NUMPY, **_PARTS}
    marks = {label: _MARKS[i % len(_MARKS)] for i, label in enumerate(labels)}
    with matplotlib.rc_context({**drawing.style(), "font.size": 9.0}):
        fig = Figure(figsize=(9.2, 3.7 * ((len(panels) + 1) // 2)), layout="constrained")
        axes = fig.subplots((len(panels) + 1) // 2, 2, squeeze=False).ravel()
        for ax in axes[len(panels):]:
            ax.set_axis_off()
        for ax, figure in zip(axes, panels, strict=False):
            some = [row for row in rows if row["figure"] == figure]
            for label in dict.fromkeys(row["resolver"] for row in some):
                draw_band(ax, figure, [row for row in some if row["resolver"] == label],
                          colours[label], marks[label])
            scale_axes(ax, sorted({row[figure] for row in some}), _UNMARKED[figure])
            ax.set(xlabel=_PANELS[figure][0], title=fixed(figure, some))
            name_lines(ax, figure, _PANELS[figure][1], some, colours)
        for ax in axes[::2]:
            ax.set_ylabel("time [µs]: median, band to the 95th percentile", fontsize=8.0)
    return fig


def fixed(figure: str, rows: Sequence[dict[str, Any]]) -> str:
    """Return what does not vary in a figure, as words."""
    row = rows[0]
    each = row["rows"] // row["tasks"]
    return {"tasks": f"{row['joints']} joints, tasks of {each} rows",
            "rows": f"{row['joints']} joints, {row['tasks']} tasks",
            "joints": f"{row['tasks']} tasks of {each} rows",
            "pairs": f"a tick, {row['joints']} joints, hcod"}[figure]
