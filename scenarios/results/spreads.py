"""The figures of a sweep's page: shares with intervals, and the distribution of each metric."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from scenarios.draw.figures import drawing
from scenarios.measure.metrics import Metric
from scenarios.results.columns import Results

Array = NDArray[np.float64]


def shares(results: Results) -> Figure:
    """Draw the share of runs that meet each criterion under each resolver, with its interval."""
    criteria, labels = results.criteria(), results.labels
    rows = len(criteria) * (len(labels) + 1)
    fig, (ax,) = drawing.figure(width=5.4, height=0.5 + 0.2 * rows)
    colours = drawing.colours(labels)
    with matplotlib.rc_context(drawing.style()):
        for i, criterion in enumerate(criteria):
            top = i * (len(labels) + 1)
            ax.text(0.0, top - 0.62, criterion.label, fontweight="bold", va="center", fontsize=9)
            for j, label in enumerate(labels):
                share = results.share(criterion, label)
                low, high = share.interval
                y, colour = top + j + 0.15, colours[label]
                ax.plot([0.0, 1.0], [y, y], color=drawing.INK, alpha=0.1, lw=5.0,
                        solid_capstyle="butt")
                ax.plot([low, high], [y, y], color=colour, lw=5.0, alpha=0.4,
                        solid_capstyle="butt")
                ax.plot([share.met / share.of], [y], "o", color=colour, ms=6.0)
                ax.text(1.04, y, f"{share}", va="center", fontsize=8)
                ax.text(-0.03, y, label, va="center", ha="right", fontsize=8)
    ax.set_ylim(rows - 1.2, -1.1)
    ax.set_xlim(-0.02, 1.02)
    ax.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0 %", "25 %", "50 %", "75 %", "100 %"])
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.grid(False)
    return fig


def spread(results: Results, metric: Metric) -> Figure:
    """Draw the distribution of a metric over the samples, one row per resolver.

    Box: quartiles with the median; line: 5th to 95th percentile; dots: smallest and largest value.
    Outliers beyond the axis are counted, and an arrow gives the extreme value.
    """
    known = {label: metric.scale * results.of(metric.name, label) for label in results.labels}
    known = {label: values for label, values in known.items() if values.size}
    fig, (ax,) = drawing.figure(width=3.9, height=0.5 + 0.3 * len(known))
    colours = drawing.colours(results.labels)
    low, high = _limits(list(known.values()))
    with matplotlib.rc_context(drawing.style()):
        for y, (label, values) in enumerate(known.items()):
            _box(ax, y, values, colours[label])
            seen = values[(values >= low) & (values <= high)]
            ax.plot([seen.min(), seen.max()], [y, y], ".", color=colours[label], ms=4.5)
            _beyond(ax, y, values[values < low], low, colours[label])
            _beyond(ax, y, values[values > high], high, colours[label])
    ax.set_yticks(range(len(known)), list(known))
    ax.set_ylim(len(known) - 0.5, -0.5)
    margin = 0.03 * (high - low)
    ax.set_xlim(low - margin, high + margin)
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.spines["left"].set_visible(False)
    ax.locator_params(axis="x", nbins=6)
    return fig


def _box(ax: Axes, y: float, values: Array, colour: str) -> None:
    p5, q1, median, q3, p95 = np.percentile(values, [5.0, 25.0, 50.0, 75.0, 95.0])
    ax.plot([p5, p95], [y, y], color=colour, lw=1.2)
    ax.barh(y, q3 - q1, left=q1, height=0.56, color=colour, alpha=0.4, lw=0)
    ax.plot([median, median], [y - 0.28, y + 0.28], color=colour, lw=2.4)


def _beyond(ax: Axes, y: float, values: Array, edge: float, colour: str) -> None:
    """Write at an edge how many values lie beyond it, and the extreme one."""
    if not values.size:
        return
    right = values[0] > edge
    farthest = values.max() if right else values.min()
    text = f"{values.size}, to {farthest:.3g} \N{RIGHTWARDS ARROW}" if right else (
        f"\N{LEFTWARDS ARROW} {values.size}, to {farthest:.3g}")
    ax.text(edge, y - 0.3, text, ha="right" if right else "left", va="center", fontsize=7.5,
            color=colour)


def _limits(rows: list[Array], reach: float = 2.0) -> tuple[float, float]:
    """Return limits that contain the middle 90 % of all rows and the values near them.

    Values up to `reach` times the width of that range away are near.
    """
    ends = [np.percentile(values, [5.0, 95.0]) for values in rows]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    far = reach * (high - low) or reach * max(abs(high), 1e-12)
    values = np.concatenate(rows)
    near = values[(values >= low - far) & (values <= high + far)]
    return (float(near.min()), float(near.max())) if near.min() < near.max() else (
        float(low - far), float(high + far))
