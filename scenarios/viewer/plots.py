"""The curves of runs under one time cursor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.drawing import ALERT, INK, JOINTS
from scenarios.scene import Series

_POINTS = 500   # of each curve
_HEIGHT = 118   # [px]
_MARGIN = 0.06  # of the range of a plot, above and below
_GREY = "#9aa3ad"
_DASHED = [4, 4]

Curve = tuple[str, str, Array]  # name, colour, values on the common times


class Plots:
    """One plot for each quantity, one under the other; those of several runs share them.

    curves : of each run by its label, the times (F,) [s] and the series; colours by label.
    """

    def __init__(self, gui: Any, curves: Mapping[str, tuple[Array, Sequence[Series]]],
                 colours: Mapping[str, str]) -> None:
        self._gui, self._colours = gui, colours
        self._handles: dict[str, Any] = {}
        self._data: dict[str, list[Array]] = {}
        self._ranges: dict[str, tuple[float, float]] = {}
        self._draw(curves)

    def _draw(self, curves: Mapping[str, tuple[Array, Sequence[Series]]]) -> None:
        times = _common([t for t, _ in curves.values()])
        for name in dict.fromkeys(one.name for _, found in curves.values() for one in found):
            drawn = [curve for label, (t, found) in curves.items() for one in found
                     if one.name == name for curve in self._curves(label, times, t, one)]
            first = next(one for _, found in curves.values() for one in found if one.name == name)
            marks = [(symbol, ALERT, np.full(len(times), at)) for symbol, at in first.marks]
            self._add(f"{name} [{first.unit}]", times, drawn, marks)

    def _curves(self, label: str, times: Array, t: Array, one: Series) -> list[Curve]:
        """A run's curves in a plot: every joint of a single run, the largest of several runs'."""
        values = np.column_stack([np.interp(times, t, column, right=np.nan)
                                  for column in one.value.T])
        if len(one.labels) == 1:
            return [(label, self._colours[label], values[:, 0])]
        if len(self._colours) > 1:
            return [(f"{label}, largest", self._colours[label], np.abs(values).max(axis=1))]
        return [(name, JOINTS[j % len(JOINTS)], values[:, j]) for j, name in enumerate(one.labels)]

    def _add(self, title: str, times: Array, curves: list[Curve], marks: list[Curve]) -> None:
        low, high = _range([values for *_, values in (*curves, *marks)])
        series: list[Any] = [{"label": "t [s]"}]
        for name, colour, _ in curves:
            series.append({"label": name, "stroke": colour, "width": 1.5, "points": _NONE})
        for name, colour, _ in marks:
            series.append({"label": name, "stroke": colour, "width": 1, "dash": _DASHED,
                           "points": _NONE})
        series.append({"label": "now", "stroke": INK, "width": 1.5, "points": _NONE})
        self._data[title] = [times, *(values for *_, values in (*curves, *marks))]
        self._ranges[title] = low, high
        self._handles[title] = self._gui.add_uplot(
            tuple(self._with_cursor(title, times[0])), tuple(series), title=title, height=_HEIGHT,
            scales={"x": {"time": False, "range": (times[0], times[-1])},
                    "y": {"range": (low, high)}},
            axes=({"size": 26, "font": _FONT}, {"size": 46, "font": _FONT}),
            legend={"show": False}, cursor={"sync": {"key": "time"}}, padding=(0, 12, 0, 0))

    def show(self, t: float) -> None:
        """Move the cursor of all plots to time t [s]."""
        for title, handle in self._handles.items():
            handle.data = tuple(self._with_cursor(title, t))

    def _with_cursor(self, title: str, t: float) -> list[Array]:
        """The plot's data with three points more at t, where the last curve goes up and down."""
        times, *curves = self._data[title]
        low, high = self._ranges[title]
        t = float(np.clip(t, times[0], times[-1]))
        k = int(np.searchsorted(times, t))
        cursor = np.full(len(times) + 3, low - (high - low))
        cursor[k + 1] = high
        return [np.insert(times, k, [t] * 3),
                *(np.insert(values, k, [np.interp(t, times, values)] * 3) for values in curves),
                cursor]


_NONE = {"show": False}
_FONT = "10px sans-serif"


def _common(times: Sequence[Array]) -> Array:
    """Times [s] for all runs, from the first begin to the last end."""
    first, last = min(t[0] for t in times), max(t[-1] for t in times)
    return np.linspace(first, max(last, first + 1e-6), _POINTS)


def _range(curves: Sequence[Array]) -> tuple[float, float]:
    finite = np.concatenate([values[np.isfinite(values)] for values in curves] or [np.empty(0)])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = _MARGIN * (high - low) or 1.0
    return low - margin, high + margin
