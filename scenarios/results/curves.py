"""The figures of both pages: runs side by side and overlaid, shares and spreads of samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hierarchy.problem import Array
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK
from scenarios.draw.figures.palette import Look
from scenarios.draw.figures.panels import Draw, Panel
from scenarios.measure.metrics import Metric
from scenarios.recording.recording import Recording
from scenarios.results.columns import Results


def side_by_side(panel: Panel, recordings: Mapping[str, Recording], looks: Mapping[str, Look]
                 ) -> dict[str, Figure]:
    """Return one small figure of `panel` per run, by label, all with the same limits.

    Values far beyond those of the other runs are cut, and the panel states their range.
    """
    drawn, axes = {}, []
    for label, recording in recordings.items():
        if panel.fits(recording):
            drawn[label], (ax,) = drawing.figure()
            panel.draw(ax, recording, looks[label].colour)
            axes.append(ax)
    ranges = [ax.get_ylim() for ax in axes]
    end = max((float(recordings[label]["t"][-1]) for label in drawn), default=0.0)
    for ax, (low, high) in zip(axes, ranges, strict=True):
        limits = drawing.shared_limits(ranges) if ax.get_yscale() != "log" else (
            min(least for least, _ in ranges), max(most for _, most in ranges))
        ax.set_ylim(limits)
        ax.set_xlim(0.0, end)
        ax.xaxis.set_major_locator(MaxNLocator(4))
        if high - low > 1.1 * (limits[1] - limits[0]):
            ax.text(0.98, 0.96, f"cut: {low:.2g} to {high:.2g}", color=ALERT, fontsize=8,
                    ha="right", va="top", transform=ax.transAxes)
    return drawn


def overlay(draw: Draw, recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return one figure with a curve per run, in the colour and dashes of its label."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    for label, recording in recordings.items():
        before = len(ax.lines)
        draw(ax, recording, looks[label].colour)
        for line in ax.lines[before:]:
            line.set_linestyle(_dashed(looks[label]))
    ax.set_xlabel("time [s]")
    return fig


def departure(recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return the largest joint difference from the first run over time [rad], logarithmic."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    first, *others = recordings
    reference = recordings[first]
    for label in others:
        ticks = min(reference.ticks, recordings[label].ticks)
        apart = np.abs(recordings[label]["q"][:ticks] - reference["q"][:ticks]).max(axis=1)
        drawing.curve(ax, reference["t"][:ticks], np.maximum(apart, 1e-16),
                      color=looks[label].colour, linestyle=_dashed(looks[label]))
    drawing.make_logarithmic(ax, "y")
    ax.set_xlabel("time [s]")
    return fig


def computing_time(recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return the computing times of a tick [us] on a logarithmic axis, one row per run.

    A dot for the median of resolving, then median (|) and 99.9th percentile (x) of whole ticks.
    """
    fig, (ax,) = drawing.figure(width=4.9, height=0.7 + 0.4 * len(recordings))
    for row, (label, recording) in enumerate(recordings.items()):
        for signal, percent, marker, colour in (("time_resolve", 50.0, "o", looks[label].colour),
                                                ("time_tick", 50.0, "|", INK),
                                                ("time_tick", 99.9, "x", INK)):
            if signal in recording:
                ax.plot(1e6 * np.percentile(recording[signal], percent), row, marker, color=colour)
    drawing.make_logarithmic(ax, "x")
    ax.set_yticks(range(len(recordings)), list(recordings))
    ax.set_ylim(len(recordings) - 0.5, -0.5)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("µs per tick")
    return fig


def _dashed(look: Look) -> Any:
    """Return the dashes of a look in matplotlib's form."""
    return (0, look.dash) if look.dash else "-"




def shares(results: Results) -> Figure:
    """Draw the share of runs that meet each criterion under each resolver, with its interval."""
    criteria, labels = results.shares(), results.labels
    rows = len(criteria) * (len(labels) + 1)
    fig, (ax,) = drawing.figure(width=5.4, height=0.5 + 0.2 * rows)
    colours = drawing.colours(labels)
    for i, (criterion, by) in enumerate(criteria.items()):
        top = i * (len(labels) + 1)
        ax.text(0.0, top - 0.62, criterion, fontweight="bold", va="center", fontsize=9)
        for j, (label, share) in enumerate(by.items()):
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
    columns = {label: results.column(metric.name, label) for label in results.labels}
    known = {label: metric.scale * values[np.isfinite(values)]
             for label, values in columns.items() if np.isfinite(values).any()}
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
