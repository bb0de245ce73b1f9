"""The stack over time: the place of each task in it, and events."""

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hierarchy.words import counted
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK
from scenarios.draw.figures.palette import task_colours
from scenarios.recording.recording import Recording

_ON_BAND = "#101214"   # text on a band, in any theme: bands are light
_LETTER = 0.016        # width of a character, relative to the time axis, in a band's name
_LEAST = 0.004         # least width of a mark, relative to the time axis
_MOST_STRETCHES = 600  # of bands in a row; shorter ones may be skipped
_GRAVE = ("stop", "brake", "contact")

Mask = NDArray[np.bool_]


def timeline(recording: Recording, beside: Sequence[Recording] = ()) -> Figure:
    """Return bands that show the place of each task in the stack, and a row for each kind of event.

    Place 1 is the first priority. Below are the ticks with contact, and with each kind of trouble
    and action; a fault is a line at the end of the run. `beside` are the runs shown together with
    this one, including itself: the figure then has their rows, colours and time axis, and no legend
    or title of its own.
    """
    alone, beside = not beside, beside or (recording,)
    places = max(len(stack) for one in beside for stack in ((), *one.order_names))
    rows = list(dict.fromkeys(name for one in beside for name in happened(one)))
    colours, end = task_colours(tasks(beside)), max(float(one["t"][-1]) for one in beside)
    fig, (ax,) = drawing.figure(width=4.9, height=0.3 + 0.24 * (places + len(rows)) + 0.8 * alone)
    for place in range(places):
        for task, colour in colours.items():
            _band(ax, recording, place, task, colour, end)
    t, start = recording["t"], float(recording["t"][0])
    for name, mask in happened(recording).items():
        spans = [(t[a], max(t[b - 1] - t[a], _LEAST * (end - start)))
                 for a, b in drawing.spans(mask)]
        ax.broken_barh(spans, (places + rows.index(name) - 0.3, 0.6), linewidth=0,
                       color=ALERT if name.endswith(_GRAVE) else INK)
    ax.set_yticks(range(places + len(rows)), [*(str(k + 1) for k in range(places)), *rows])
    ax.set_ylim(places + len(rows) - 0.5, -0.5)
    ax.set_xlim(start, end if end > start else start + 1.0)
    ax.tick_params(axis="y", length=0)
    ax.grid(False, axis="y")
    ax.set_axisbelow(True)
    ax.spines["left"].set_visible(False)
    if recording.fault:
        _ended(ax, float(t[-1]), end)
    if alone:
        fig.legend(handles=[Patch(color=colour, label=task) for task, colour in colours.items()],
                   loc="outside lower center", ncols=4, fontsize="small", handlelength=1.0)
        ax.set_title(f"Place in the stack, {counted(recording.switches().size, 'change')}",
                     loc="left")
        ax.set_xlabel("time [s]")
    return fig


def tasks(recordings: Iterable[Recording]) -> list[str]:
    """Return all tasks in the stack of any of the runs."""
    return list(dict.fromkeys(task for recording in recordings for task in recording.task_names))


def happened(recording: Recording) -> dict[str, Mask]:
    """Return the events other than changes of the stack: name, and a mask of their ticks (T,)."""
    rows: dict[str, Mask] = {}
    if "contacts" in recording and (touched := recording["contacts"] > 0).any():
        rows["contact"] = touched
    for (kind, action), ticks in recording.troubles().items():
        rows[f"{kind.replace('_', ' ')}: {action}"] = np.isin(np.arange(recording.ticks), ticks)
    return rows


def _band(ax: Axes, recording: Recording, place: int, task: str, colour: str, end: float) -> None:
    t, stacks = recording["t"], recording.order_names
    held = np.array([len(stack) > place and stack[place] == task for stack in stacks])
    every = max(1, len(t) // _MOST_STRETCHES) if recording.switches().size > _MOST_STRETCHES else 1
    sampled = np.append(t[::every], t[-1])
    spans = [(sampled[a], sampled[b]) for a, b in drawing.spans(held[recording["order"][::every]])]
    ax.broken_barh([(a, b - a) for a, b in spans], (place - 0.42, 0.84), color=colour, linewidth=0)
    longest = max(spans, key=lambda span: span[1] - span[0], default=None)
    if longest is not None and longest[1] - longest[0] > _LETTER * len(task) * (end - t[0]):
        ax.text(sum(longest) / 2, place, task, color=_ON_BAND, fontsize="small", ha="center",
                va="center_baseline")


def _ended(ax: Axes, t: float, end: float) -> None:
    """Mark where a fault ended the run."""
    ax.axvline(t, color=ALERT, linewidth=1.4)
    inside = t > 0.5 * end
    ax.annotate("fault", (t, 1.0), (-2 if inside else 2, 1), xycoords=("data", "axes fraction"),
                textcoords="offset points", ha="right" if inside else "left", va="bottom",
                color=ALERT, fontsize="small", annotation_clip=False)
