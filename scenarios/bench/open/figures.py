"""The figures of a half: performance profiles, time against miss, families against entrants."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from scenarios.bench.open.judge import RIGHT, SOLVED, WRONG
from scenarios.bench.open.printing import CHOSEN
from scenarios.bench.open.results import Half
from scenarios.bench.open.summary import profile
from scenarios.draw.figures import drawing
from scenarios.draw.figures.palette import Look, looks

_LARGEST = 1e4       # ratio of times at the right edge
_ENTRY = 0.155       # [in] height of an entrant in the legend
_LEAST, _MOST = 1e-17, 1e-2  # misses beyond are drawn at the edge
_SHADES = LinearSegmentedColormap.from_list("share", ["#b42318", "#f0c66b", "#e9f4ee", "#7cc4a0"])


def drawn_as(half: Half) -> dict[str, Look]:
    """Return the look of each entrant, the same in every figure."""
    return looks(half.entrants)


def profiles(half: Half, legend: bool = False) -> Figure:
    """Return the performance profile: share solved against time over that of the fastest."""
    ratios = np.geomspace(1.0, _LARGEST, 200)
    found, style = profile(half.rows, ratios), drawn_as(half)
    with matplotlib.rc_context(drawing.style()):
        height = max(4.2, _ENTRY * len(half.entrants) + 0.3) if legend else 4.2
        fig = Figure(figsize=(6.2, height), layout="constrained")
        ax = fig.subplots()
        for label in half.entrants:
            ax.plot(ratios, 100.0 * found[label], color=style[label].colour,
                    linestyle=_line(style[label]), label=label, linewidth=1.2)
        drawing.make_logarithmic(ax, "x")
        ax.set(xlabel="median time of a problem, over that of the fastest entrant",
               ylabel="problems solved [%]", xlim=(1.0, _LARGEST), ylim=(0.0, 102.0))
        if legend:
            fig.legend(loc="outside right upper", fontsize=7.0)
    return fig


def time_against_miss(half: Half, legend: bool = False) -> Figure:
    """Return median time against the largest relative miss of those called solved, by family."""
    names = [name for name in CHOSEN if name in half.families] or half.families[:4]
    style, columns = drawn_as(half), min(3, len(names))
    lines = -(-len(names) // columns)
    with matplotlib.rc_context({**drawing.style(), "font.size": 8.5}):
        fig = Figure(figsize=(2.9 * columns + 0.4, 2.5 * lines + 0.4), layout="constrained")
        axes = list(fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
        for ax, name in zip(axes, names, strict=False):
            for label in half.entrants:
                one = half.cells.get((label, name))
                if one is not None and one.counts[SOLVED] + one.counts[WRONG]:
                    miss = float(np.clip(one.relative, _LEAST, _MOST))
                    ax.plot(miss, one.cold.median, "o", color=style[label].colour, markersize=5.0,
                            clip_on=False, alpha=0.4 if one.right < 1.0 else 1.0)
                    if one.counts[WRONG]:
                        ax.plot(miss, one.cold.median, "x", color=drawing.ALERT, markersize=4.0,
                                markeredgewidth=0.8, clip_on=False)
            ax.axvline(RIGHT, color=drawing.INK, linewidth=0.6, alpha=0.4)
            ax.set(xscale="log", yscale="log", title=name, xlim=(_LEAST, _MOST))
            ax.set_xticks([1e-16, 1e-12, 1e-8, 1e-4])
        for ax in axes[len(names):]:
            ax.set_axis_off()
        fig.supxlabel("largest miss of an answer called solved, relative", fontsize=9.0)
        fig.supylabel("median time [µs]", fontsize=9.0)
        if legend:
            fig.legend(handles=[Line2D([], [], color=look.colour, marker="o", linestyle="",
                                       markersize=5.0, label=label)
                                for label, look in style.items()],
                       loc="outside right upper", fontsize=7.0)
    return fig


def heat(half: Half) -> Figure:
    """Return the share of right answers of each entrant in each family."""
    names, labels = half.families, half.entrants
    shares = np.array([[_share(half, label, name) for name in names] for label in labels])
    with matplotlib.rc_context({**drawing.style(), "axes.grid": False, "font.size": 8.0}):
        fig = Figure(figsize=(0.36 * len(names) + 2.0, 0.24 * len(labels) + 1.6),
                     layout="constrained")
        ax = fig.subplots()
        ax.imshow(np.ma.masked_invalid(shares), cmap=_SHADES, vmin=0.0, vmax=1.0, aspect="auto")
        for i, j in np.ndindex(*shares.shape):
            if not np.isnan(shares[i, j]):
                ax.text(j, i, _percent(float(shares[i, j])), ha="center", va="center", fontsize=6.5,
                        color="#0b0c0d", gid="dark")
        ax.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(len(labels)), labels)
        ax.tick_params(length=0)
        for side in ax.spines.values():
            side.set_visible(False)
    return fig


def _share(half: Half, label: str, family: str) -> float:
    one = half.cells.get((label, family))
    return np.nan if one is None else one.right


def _percent(share: float) -> str:
    return "100" if share == 1.0 else f"{min(99.0, 100.0 * share):.0f}"


def _line(look: Look) -> tuple[int, tuple[float, ...]] | str:
    return (0, look.dash) if look.dash else "-"
