"""The curves of runs, one plot per quantity, with a time cursor or rolling."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.draw.figures.drawing import ALERT, JOINTS
from scenarios.scene import Series

_POINTS = 500   # per curve
_HEIGHT = 118   # [px]
_MARGIN = 0.06  # above and below, relative to the range of a plot
_NOW = "#7a838d"  # of the cursor, on light and dark pages
_DASHED = [4, 4]
_NO_DOTS = {"show": False}
_FONT = "10px sans-serif"

Curves = Mapping[str, tuple[Array, Sequence[Series]]]  # by run: times (F,) [s] and series


@dataclass(frozen=True)
class _Plot:
    title: str
    times: Array
    curves: list[tuple[str, str, Array]]  # name, colour, values on the times
    marks: list[tuple[str, str, Array]]

    @property
    def data(self) -> list[Array]:
        return [self.times, *(values for *_, values in (*self.curves, *self.marks))]

    @property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest value, with a margin."""
        values = np.concatenate(self.data[1:])
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
        margin = _MARGIN * (high - low) or 1.0
        return low - margin, high + margin

    def with_cursor(self, t: float) -> tuple[Array, ...]:
        """Return the data with three more points at t [s], and a curve that is the cursor."""
        low, high = self.range
        t = float(np.clip(t, self.times[0], self.times[-1]))
        k = int(np.searchsorted(self.times, t))
        cursor = np.full(len(self.times) + 3, low - (high - low))
        cursor[k + 1] = high
        times, *curves = self.data
        return (np.insert(times, k, [t] * 3),
                *(np.insert(values, k, [np.interp(t, times, values)] * 3) for values in curves),
                cursor)


class Plots:
    """One plot per quantity, one below the other, shared by all runs."""

    def __init__(self, gui: Any, curves: Curves, colours: Mapping[str, str],
                 rolling: bool = False) -> None:
        self._colours, self._rolling = colours, rolling
        self._plots = {plot.title: plot for plot in _plots(curves, colours)}
        self._handles = {plot.title: self._add(gui, plot) for plot in self._plots.values()}

    def show(self, t: float) -> None:
        """Move the cursor of all plots to time t [s]."""
        for title, handle in self._handles.items():
            handle.data = self._plots[title].with_cursor(t)

    def roll(self, curves: Curves) -> None:
        """Replace the curves by others of the same quantities."""
        for plot in _plots(curves, self._colours):
            self._handles[plot.title].data = tuple(plot.data)

    def _add(self, gui: Any, plot: _Plot) -> Any:
        series: list[Any] = [{"label": "t [s]"}]
        series += [{"label": name, "stroke": colour, "width": 1.5, "points": _NO_DOTS}
                   for name, colour, _ in plot.curves]
        series += [{"label": name, "stroke": colour, "width": 1, "dash": _DASHED,
                    "points": _NO_DOTS} for name, colour, _ in plot.marks]
        scales: dict[str, Any] = {"x": {"time": False}}
        if not self._rolling:
            series.append({"label": "now", "stroke": _NOW, "width": 1.5, "points": _NO_DOTS})
            scales = {"x": {"time": False, "range": (plot.times[0], plot.times[-1])},
                      "y": {"range": plot.range}}
        data = tuple(plot.data) if self._rolling else plot.with_cursor(plot.times[0])
        return gui.add_uplot(
            data, tuple(series), title=plot.title, height=_HEIGHT, scales=scales,
            axes=({"size": 26, "font": _FONT}, {"size": 46, "font": _FONT}),
            legend={"show": False}, cursor={"sync": {"key": "time"}}, padding=(0, 12, 0, 0))


def _plots(curves: Curves, colours: Mapping[str, str]) -> Iterator[_Plot]:
    times = _common([t for t, _ in curves.values()])
    for name in dict.fromkeys(one.name for _, found in curves.values() for one in found):
        same = {label: (t, one) for label, (t, found) in curves.items() for one in found
                if one.name == name}
        first = next(iter(same.values()))[1]
        yield _Plot(f"{name} [{first.unit}]", times,
                    [curve for label, (t, one) in same.items()
                     for curve in _drawn(label, colours, times, t, one)],
                    [(symbol, ALERT, np.full(len(times), at)) for symbol, at in first.marks])


def _drawn(label: str, colours: Mapping[str, str], times: Array, t: Array,
           one: Series) -> list[tuple[str, str, Array]]:
    """Return a run's curves in a plot: each joint of a single run, the largest of several runs."""
    finite = np.where(np.isfinite(one.value), one.value, np.nan)
    values = np.column_stack([np.interp(times, t, column, right=np.nan) for column in finite.T])
    if len(one.labels) == 1:
        return [(label, colours[label], values[:, 0])]
    if len(colours) > 1:
        return [(f"{label}, largest", colours[label], np.abs(values).max(axis=1))]
    return [(name, JOINTS[j % len(JOINTS)], values[:, j]) for j, name in enumerate(one.labels)]


def _common(times: Sequence[Array]) -> Array:
    """Return times [s] for all runs, from the earliest start to the latest end."""
    first, last = min(t[0] for t in times), max(t[-1] for t in times)
    return np.linspace(first, max(last, first + 1e-6), _POINTS)
