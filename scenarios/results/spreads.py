"""The figures of a sweep's page: shares with intervals, and the distribution of each metric."""

from __future__ import annotations

import numpy as np
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
    for i, criterion in enumerate(criteria):
        top = i * (len(labels) + 1)
        ax.text(0.0, top - 0.62, criterion.label, fontweight="bold", va="center", fontsize=9)
        for j, label in enumerate(labels):
            share = results.share(criterion, label)
            y, colour = top + j + 0.15, colours[label]
            ax.hlines(y, 0.0, 1.0, color=drawing.INK, alpha=0.1, lw=5.0)
            ax.hlines(y, *share.interval, color=colour, lw=5.0, alpha=0.4)
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

    Box: quartiles with the median; line: 5th to 95th percentile; dots: smallest and largest value,
    where they are near. How many lie beyond the axis stands at its end.
    """
    known = {label: metric.scale * values for label in results.labels
             if (values := results.of(metric.name, label)).size}
    fig, (ax,) = drawing.figure(width=3.9, height=0.5 + 0.3 * len(known))
    colours = drawing.colours(results.labels)
    low, high = _limits(list(known.values()))
    for y, (label, values) in enumerate(known.items()):
        p5, q1, median, q3, p95 = np.percentile(values, [5.0, 25.0, 50.0, 75.0, 95.0])
        ax.hlines(y, p5, p95, color=colours[label], lw=1.2)
        ax.barh(y, q3 - q1, left=q1, height=0.56, color=colours[label], alpha=0.4, lw=0)
        ax.vlines(median, y - 0.28, y + 0.28, color=colours[label], lw=2.4)
        seen = values[(values >= low) & (values <= high)]
        ax.plot([seen.min(), seen.max()], [y, y], ".", color=colours[label], ms=4.5)
        if beyond := values.size - seen.size:
            ax.text(1.0, y, f"{beyond} beyond, to {max(values, key=abs):.3g}", fontsize=7.5,
                    ha="right", va="bottom", transform=ax.get_yaxis_transform())
    ax.set_yticks(range(len(known)), list(known))
    ax.set_ylim(len(known) - 0.5, -0.5)
    ax.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.spines["left"].set_visible(False)
    ax.locator_params(axis="x", nbins=6)
    return fig


def _limits(rows: list[Array], reach: float = 2.0) -> tuple[float, float]:
    """Return the ends of the values near the middle 90 % of all rows.

    Those are at most `reach` times its width away.
    """
    values = np.concatenate(rows)
    low = min(float(np.percentile(row, 5.0)) for row in rows)
    high = max(float(np.percentile(row, 95.0)) for row in rows)
    far = reach * (high - low) or reach * max(abs(high), 1e-12)
    near = values[(values >= low - far) & (values <= high + far)]
    return float(near.min()), float(max(near.max(), near.min() + 1e-12))
