"""The figures of the report: runs side by side on equal axes, and overlaid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, Array
from scenarios.draw.figures.palette import Look
from scenarios.draw.figures.panels import Draw, Panel

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording


def side_by_side(panel: Panel, recordings: Mapping[str, Recording], looks: Mapping[str, Look]
                 ) -> dict[str, Figure]:
    """Return one small figure of `panel` per run, by label, all with the same limits.

    Values far beyond those of the other runs are cut, and the panel states their range.
    """
    drawn = {}
    for label, recording in recordings.items():
        if panel.fits(recording):
            fig, (ax,) = drawing.figure()
            panel.draw(ax, recording, looks[label].colour)
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
            ax.text(0.98, 0.96, f"cut: {low:.2g} to {high:.2g}", color=ALERT, fontsize=8,
                    ha="right", va="top", transform=ax.transAxes)


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
