"""The figures of the benchmarks: time against error, profiles, shares, bars, times over sizes."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator, ScalarFormatter

from benchmark.report import Row
from hierarchy.problem import Array
from scenarios.draw.figures import drawing
from scenarios.draw.figures.palette import Look, looks

_LEAST, _MOST = 1e-17, 1e-2  # errors beyond are drawn at the edge
_SHADES = LinearSegmentedColormap.from_list("share", ["#b42318", "#f0c66b", "#e9f4ee", "#7cc4a0"])
_NARROWEST = 5.0             # [inch], for a page that scales figures to its width
STRICT = 1e-9                # [m per tick], also of `hierarchy bench strictness`
_MARKS = "osD^v<P>X"
_KINDS = "hqp", "cascade"  # with panels of their own
_HUES = matplotlib.colormaps["tab20"]
_DASHES = defaultdict(lambda: "-", {"defaults": ":", "tight": "--", "as hqp": "-.", "slack": ":"})


@contextmanager
def _figure(width: float, height: float, style: Any = ()) -> Iterator[Figure]:
    with matplotlib.rc_context({**drawing.present().settings, **dict(style)}):
        yield Figure(figsize=(max(width, _NARROWEST), height), layout="constrained")


def time_against_error(rows: Sequence[Row]) -> Figure:
    """Return median time over the largest miss, one panel for each family; low and left is better.

    rows : summaries of entrants in families. Hollow marks are warm starts, faint ones left some
    unsolved, a cross was wrong.
    """
    rows = [row for row in rows if row["answered"]]
    names = list(dict.fromkeys(row["family"] for row in rows))
    style = looks(dict.fromkeys(row["entrant"].removesuffix(" warm") for row in rows))
    colours = [look.colour for look in style.values()]
    marks = {label: _MARKS[colours[:i].count(look.colour) % len(_MARKS)]
             for i, (label, look) in enumerate(style.items())}
    columns = min(4, max(1, len(names)))
    lines = max(1, -(-len(names) // columns))
    width = max(2.6 * columns + 0.4, _NARROWEST)
    beside = int(width // 1.8)
    legend = -(-len(style) // beside)
    with _figure(width, 2.35 * lines + 0.7 + 0.17 * legend, {"font.size": 8.5}) as fig:
        axes = list(fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
        for ax, name in zip(axes, names, strict=False):
            for row in rows:
                if row["family"] == name:
                    label = row["entrant"].removesuffix(" warm")
                    _dot(ax, row, style[label], marks[label])
            drawing.make_logarithmic(ax, "y")
            ax.set(xscale="log", title=name, xlim=(_LEAST / 4.0, _MOST * 4.0))
            ax.set_xticks([1e-16, 1e-12, 1e-8, 1e-4])
        for ax in axes[len(names):]:
            ax.set_axis_off()
        fig.supxlabel("largest miss of an answer called solved", fontsize=9.0)
        for ax in axes[:len(names):columns]:
            ax.set_ylabel("median time of a solve [µs]")
        fig.legend(handles=[Line2D([], [], color=look.colour, marker=marks[label], linestyle="",
                                   markersize=5.0, label=label) for label, look in style.items()],
                   loc="outside upper center", ncols=beside, fontsize=8.0)
    return fig


def _dot(ax: Axes, row: Row, look: Look, mark: str) -> None:
    x = float(np.clip(np.nan_to_num(row["relative"], nan=_MOST), _LEAST, _MOST))
    y = row["median_us"]
    ax.plot(x, y, mark, color=look.colour, markersize=5.0, clip_on=False,
            alpha=0.4 if row["right"] < 1.0 else 1.0,
            markerfacecolor="none" if row["entrant"].endswith(" warm") else look.colour)
    if row["wrong"]:
        ax.plot(x, y, "x", color=drawing.ALERT, markersize=4.0, markeredgewidth=0.8, clip_on=False)


def curves(at: Array, found: Mapping[str, Array], words: str) -> Figure:
    """Return shares of problems solved over a logarithmic axis; words : its label.

    One panel for each kind of entrants, with a colour for each and dashes for its settings. Where a
    panel is of one kind, which has one colour elsewhere, they have others.
    """
    style = looks(found)
    kinds: dict[str, list[str]] = {}
    for label in found:
        first = label.partition(" ")[0]
        kinds.setdefault(first if first in _KINDS else "others", []).append(label)
    longest = max(map(len, kinds.values()))
    with _figure(3.4 * len(kinds), 3.2 + 0.17 * longest, {"font.size": 8.5}) as fig:
        for ax, (kind, labels) in zip(fig.subplots(1, len(kinds), squeeze=False, sharey=True)[0],
                                      kinds.items(), strict=True):
            names = list(dict.fromkeys(label.partition(", ")[0] for label in labels))
            for label in labels:
                name, _, setting = label.partition(", ")
                colour, line = (_HUES(names.index(name) % _HUES.N), _DASHES[setting]
                                ) if kind in _KINDS else (style[label].colour, style[label].line)
                ax.plot(at, 100.0 * found[label], label=label, linewidth=1.2, color=colour,
                        linestyle=line)
            drawing.make_logarithmic(ax, "x")
            ax.set(title=kind if len(kinds) > 1 else "", xlim=(at[0], at[-1]), ylim=(0.0, 102.0))
            ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize=7.0)
        fig.supxlabel(fill(words, 45 * len(kinds)), fontsize=9.0)
        fig.supylabel("problems solved [%]", fontsize=9.0)
    return fig


def heat(cells: Sequence[Row]) -> Figure:
    """Return the share of right answers of each entrant in each family, of what it can be asked."""
    names, labels = (list(dict.fromkeys(row[key] for row in cells))
                     for key in ("family", "entrant"))
    shares = np.full((len(labels), len(names)), np.nan)
    for row in cells:
        shares[labels.index(row["entrant"]), names.index(row["family"])] = row["right"]
    with _figure(0.36 * len(names) + 2.0, 0.24 * len(labels) + 1.6,
                 {"axes.grid": False, "font.size": 8.0}) as fig:
        ax = fig.subplots()
        ax.imshow(np.ma.masked_invalid(shares), cmap=_SHADES, vmin=0.0, vmax=1.0, aspect="auto")
        for i, j in np.argwhere(~np.isnan(shares)):
            text = "100" if shares[i, j] == 1.0 else f"{min(99.0, 100.0 * shares[i, j]):.0f}"
            ax.text(j, i, text, ha="center", va="center", fontsize=6.5, color="#0b0c0d", gid="dark")
        ax.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(len(labels)), labels)
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
    return fig


def bars(rows: Sequence[Row]) -> Figure:
    """Return a bar for each median tick, logarithmic, with a line to the 95th percentile.

    The dark part is the solve alone, where it can be called alone.
    """
    timed = [row for row in rows if not np.isnan(row["median_us"])]
    style = looks(row["entrant"] for row in timed)
    with _figure(7.6, 0.27 * len(timed) + 1.1, {"font.size": 8.5}) as fig:
        ax = fig.subplots()
        for i, row in enumerate(timed):
            colour = style[row["entrant"]].colour
            ax.barh(i, row["median_us"], 0.66, color=colour, alpha=0.5)
            ax.barh(i, np.nan_to_num(row["solve_us"]), 0.66, color=colour)
            ax.plot([row["median_us"], row["p95_us"]], [i, i], color=drawing.INK, linewidth=0.8)
            ax.annotate(_bought(row), (row["p95_us"], i), (4.0, 0.0), textcoords="offset points",
                        va="center", fontsize=8.0)
        ax.set(xscale="log", xlabel="time of one tick, one core [µs]")
        ax.set_xlim(1.0, 12.0 * max((row["p95_us"] for row in timed), default=10.0))
        ax.set_yticks(range(len(timed)), [row["entrant"] for row in timed])
        ax.invert_yaxis()
        ax.grid(visible=False, axis="y")
        ax.margins(y=0.01)
        fig.legend(handles=[Patch(color=drawing.INK, alpha=0.35, label="whole tick"),
                            Patch(color=drawing.INK, alpha=0.8, label="its solve alone")],
                   loc="outside upper center", ncols=2, fontsize=8.0)
    return fig


def _bought(row: Row) -> str:
    """Return what the time has bought: strictness, or how far the posture moves the hand."""
    if np.isnan(row["moved_m"]):
        return "no answer at the limits"
    lost = f", no answer in {row['step_failed']} ticks" if row["step_failed"] else ""
    return ("strict" if row["moved_m"] <= STRICT
            else f"posture moves it by {row['moved_m']:.0e} m a tick") + lost


def over_sizes(rows: Sequence[Row], panels: Mapping[str, tuple[str, str, str]]) -> Figure:
    """Return medians over sizes, with the 95th percentile as the upper edge of a band.

    Both axes are logarithmic, so that a straight line is a power; its exponent is beside the name.
    panels : for each `figure` of the rows its label, the letter of its size, and its title.
    """
    labels = list(dict.fromkeys(row["entrant"] for row in rows))
    style = looks(labels)
    lines = (len(panels) + 1) // 2
    with _figure(9.2, 4.6 * lines, {"font.size": 9.0}) as fig:
        axes = fig.subplots(lines, 2, squeeze=False).ravel()
        for ax in axes[len(panels):]:
            ax.set_axis_off()
        for ax, (figure, (xlabel, letter, title)) in zip(axes, panels.items(), strict=False):
            some = [row for row in rows if row["figure"] == figure]
            powers = exponents(some, figure)
            for label, mark in zip(labels, _MARKS * len(labels), strict=False):
                size, median, p95 = (np.array([row[key] for row in some if row["entrant"] == label])
                                     for key in (figure, "median_us", "p95_us"))
                power = powers.get(label, np.nan)
                ax.fill_between(size, median, p95, color=style[label].colour, alpha=0.15,
                                linewidth=0)
                ax.plot(size, median, marker=mark, color=style[label].colour, markersize=3.6,
                        linewidth=1.4, label=label if np.isnan(power) else
                        f"{label}  ${letter}^{{{power:.1f}}}$")
            ax.set(xscale="log", yscale="log", xlabel=xlabel, title=title)
            ax.set_xticks(sorted({row[figure] for row in some}))
            ax.xaxis.set_minor_locator(NullLocator())
            ax.xaxis.set_major_formatter(ScalarFormatter())
            ax.tick_params(axis="x", labelsize=7.0)
            ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=7.0)
        for ax in axes[::2]:
            ax.set_ylabel("time [µs]: median, band to the 95th percentile", fontsize=8.0)
    return fig


def exponents(rows: Sequence[Row], figure: str) -> dict[str, float]:
    """Return the slope of log time over log size in the upper half of sizes, at least 3."""
    found: dict[str, float] = {}
    for label in dict.fromkeys(row["entrant"] for row in rows):
        points = sorted((row[figure], row["median_us"]) for row in rows if row["entrant"] == label)
        upper = np.log(points[min(len(points) // 2, max(len(points) - 3, 0)):])
        found[label] = (float(np.polyfit(upper[:, 0], upper[:, 1], 1)[0]) if len(upper) > 1
                        else float("nan"))
    return found
