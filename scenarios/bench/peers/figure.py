"""Bars of the times, with the quality of the solutions beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from scenarios.bench.candidates import DAQP
from scenarios.bench.figure import OWN
from scenarios.draw.figures import drawing

_PEERS = {"pink": "#ee99aa", "mink": "#994455", "placo": "#6699cc", "tsid": "#997700"}
_STRICT = 1e-9  # [m per tick], as in `hierarchy bench strictness`


def bars(rows: Sequence[dict[str, Any]]) -> Figure:
    """Return the figure: a bar a median, from left, logarithmic; a line to the 95th percentile.

    The dark part is the solve alone, where it can be called alone.
    """
    timed = [row for row in rows if row["median_us"] is not None]
    colour = _colours([row["entrant"] for row in timed])
    with matplotlib.rc_context({**drawing.style(), "font.size": 8.5}):
        fig = Figure(figsize=(7.6, 0.27 * len(timed) + 1.1), layout="constrained")
        ax = fig.subplots()
        for i, row in enumerate(timed):
            _draw(ax, i, row, colour[row["entrant"]])
        ax.set(xscale="log", xlabel="time of one tick, one core [µs]")
        ax.set_xlim(1.0, 12.0 * max((row["p95_us"] for row in timed), default=10.0))
        ax.set_yticks(range(len(timed)), [row["entrant"] for row in timed])
        ax.invert_yaxis()
        ax.grid(visible=False, axis="y")
        ax.margins(y=0.01)
        fig.legend(handles=_legend(), loc="outside upper center", ncols=3, fontsize=8.0)
    return fig


def _draw(ax: Axes, i: int, row: dict[str, Any], colour: str) -> None:
    ax.barh(i, row["median_us"], 0.66, color=colour, alpha=0.5)
    if row["solve_us"] is not None:
        ax.barh(i, row["solve_us"], 0.66, color=colour)
    ax.plot([row["median_us"], row["p95_us"]], [i, i], color=drawing.INK, linewidth=0.8)
    ax.annotate(_bought(row), (row["p95_us"], i), (4.0, 0.0), textcoords="offset points",
                va="center", fontsize=8.0)


def _bought(row: dict[str, Any]) -> str:
    if row["moved_m"] is None:
        return "no answer at the limits"
    lost = f", no answer in {row['step_failed']} ticks" if row["step_failed"] else ""
    if row["moved_m"] <= _STRICT:
        return "strict" + lost
    return f"posture moves it by {row['moved_m']:.0e} m a tick" + lost


def _colours(labels: Sequence[str]) -> dict[str, str]:
    own = [label for label in labels if label != DAQP and label.split()[0] not in _PEERS]
    return {**drawing.colours(own), DAQP: OWN[DAQP],
            **{label: _PEERS[label.split()[0]] for label in labels
               if label.split()[0] in _PEERS}}


def _legend() -> list[Any]:
    return [Patch(color=drawing.INK, alpha=0.35, label="whole tick"),
            Patch(color=drawing.INK, alpha=0.8, label="its solve alone"),
            Line2D([], [], color=drawing.INK, linewidth=0.8, label="to the 95th percentile")]
