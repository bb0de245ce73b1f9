"""The figures of the report: runs beside each other on equal axes, and laid over each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, Array
from scenarios.draw.figures.palette import Look
from scenarios.draw.figures.panels import Draw, Panel

if TYPE_CHECKING:
    from scenarios.loop.recording import Recording


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


def computing_time(recordings: Mapping[str, Recording], looks: Mapping[str, Look]
                   ) -> tuple[Figure, str]:
    """Return the times of a tick [us], a row for each run, and what the marks in it mean.

    The medians of its parts as a bar, or, where some runs take much longer than others, one dot on
    a logarithmic axis; with the whole tick's median and 99.9 %.
    """
    fig, (ax,) = drawing.figure(width=4.9, height=0.7 + 0.4 * len(recordings))
    wide = _wide(recordings)
    for row, (label, recording) in enumerate(recordings.items()):
        if wide:
            ax.plot(_micro(recording, "time_resolve", 50.0), row, "o", color=looks[label].colour)
        else:
            _bar(ax, row, recording, looks[label].colour)
        ax.plot(_micro(recording, "time_tick", 50.0), row, "|", color=INK, markersize=8)
    ax.set_xscale("log") if wide else ax.set_xlim(left=0.0)
    _slowest(ax, recordings, wide)
    ax.set_yticks(range(len(recordings)), list(recordings))
    ax.set_ylim(len(recordings) - 0.5, -0.5)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("µs a tick")
    bars = "kinematics, rows, resolve (light to full), medians"
    return fig, f"{'dot: resolve, median' if wide else bars}; whole tick | median, × 99.9 %"


def _bar(ax: Axes, row: int, recording: Recording, colour: str) -> None:
    left = 0.0
    for signal, alpha in (("time_kinematics", 0.35), ("time_rows", 0.6), ("time_resolve", 1.0)):
        width = _micro(recording, signal, 50.0)
        ax.barh(row, width, left=left, color=colour, alpha=alpha, height=0.6)
        left += width


def _slowest(ax: Axes, recordings: Mapping[str, Recording], wide: bool) -> None:
    """Mark what 99.9 % of the ticks keep to; far from all bars it is a number at the edge."""
    edge = ax.get_xlim()[1] * (100.0 if wide else 1.6)
    for row, recording in enumerate(recordings.values()):
        slow = _micro(recording, "time_tick", 99.9)
        if slow <= edge:
            ax.plot(slow, row, "x", color=INK, markersize=6)
        else:
            ax.annotate(f"× {slow:.0f} \N{RIGHTWARDS ARROW}", (1.0, row), ha="right", va="center",
                        xycoords=("axes fraction", "data"), fontsize=8, color=INK)
    if not wide:
        ax.set_xlim(0.0, edge)


def _micro(recording: Recording, signal: str, percent: float) -> float:
    return 1e6 * float(np.percentile(recording[signal], percent)) if signal in recording else 0.0


def _dashed(look: Look) -> Any:
    """Return a look's dashes as matplotlib takes them."""
    return (0, look.dash) if look.dash else "-"


def _wide(recordings: Mapping[str, Recording]) -> bool:
    medians = [_micro(recording, "time_tick", 50.0) for recording in recordings.values()]
    return max(medians) > 20 * min(medians)
