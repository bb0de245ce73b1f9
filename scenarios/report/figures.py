"""The figures of the report: runs beside each other on equal axes, and laid over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from scenarios import drawing
from scenarios.drawing import ALERT, INK, Array
from scenarios.palette import Look
from scenarios.panels import Draw, Panel

if TYPE_CHECKING:
    from scenarios.recording import Recording


def side_by_side(panel: Panel, recordings: Mapping[str, Recording], looks: Mapping[str, Look]
                 ) -> dict[str, Figure]:
    """Return one small figure of `panel` a run, by label, with the same limits for all.

    A run whose values are far beyond the others' is cut, and its panel says where it goes.
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
            ax.text(0.98, 0.96, f"cut: reaches {low:.2g} to {high:.2g}", color=ALERT, fontsize=8,
                    ha="right", va="top", transform=ax.transAxes)


def overlay(draw: Draw, recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return one figure with a curve a run, in its label's colour and dashes."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    for label, recording in recordings.items():
        before = len(ax.lines)
        draw(ax, recording, looks[label].colour)
        for line in ax.lines[before:]:
            line.set_linestyle(_dashed(looks[label]))
    ax.set_xlabel("time [s]")
    return fig


def departure(recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return how far each run's joints depart from the first run's [rad], logarithmic."""
    fig, (ax,) = drawing.figure(width=4.9, height=2.7)
    first, *others = recordings
    reference = recordings[first]
    for label in others:
        ticks = min(reference.ticks, recordings[label].ticks)
        apart = np.abs(recordings[label]["q"][:ticks] - reference["q"][:ticks]).max(axis=1)
        drawing.curve(ax, reference["t"][:ticks], np.maximum(apart, 1e-16),
                      color=looks[label].colour, linestyle=_dashed(looks[label]))
    ax.set_yscale("log")
    ax.set_xlabel("time [s]")
    return fig


def computing_time(recordings: Mapping[str, Recording], looks: Mapping[str, Look]) -> Figure:
    """Return the median time of a tick's parts [us], with the whole tick's median and 99.9 %."""
    fig, (ax,) = drawing.figure(width=4.9, height=0.7 + 0.4 * len(recordings))
    parts = (("time_kinematics", 0.35), ("time_rows", 0.6), ("time_resolve", 1.0))
    for row, (label, recording) in enumerate(recordings.items()):
        left = 0.0
        for signal, alpha in parts:
            width = 1e6 * float(np.median(recording[signal])) if signal in recording else 0.0
            ax.barh(row, width, left=left, color=looks[label].colour, alpha=alpha,
                    height=0.6)
            left += width
        if "time_tick" in recording:
            for percent, mark in ((50.0, "|"), (99.9, "x")):
                ax.plot(1e6 * np.percentile(recording["time_tick"], percent), row, mark,
                        color=INK, markersize=7)
    ax.set_yticks(range(len(recordings)), list(recordings))
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)
    ax.set_xscale("log") if _wide(recordings) else ax.set_xlim(left=0.0)
    ax.set_xlabel("µs a tick")
    return fig


def _dashed(look: Look) -> Any:
    """Return a look's dashes as matplotlib takes them."""
    return (0, look.dash) if look.dash else "-"


def _wide(recordings: Mapping[str, Recording]) -> bool:
    times = [np.percentile(r["time_tick"], [50.0, 99.9]) for r in recordings.values()
             if "time_tick" in r]
    return bool(times) and bool(np.max(times) > 20 * np.min(times))
