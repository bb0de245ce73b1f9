"""A recording in a notebook: as a data frame, as curves, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.notebook import html_table
from scenarios.recording.columns import Recorded, columns, of_ticks, signal_units

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIBRARIES = ("pandas", "polars")
_USUAL = ("q", "v", "position_error", "minimal_distance")  # what `plot` draws unless told
_LABELLED = 10  # curves of a panel that a legend can name


def data_frame(recording: Recorded, library: str | None) -> Any:
    """Return a data frame; see `Recording.to_dataframe`."""
    if library is not None and library not in LIBRARIES:
        raise UnknownNameError("library", library, LIBRARIES)
    for name in LIBRARIES if library is None else (library,):
        try:
            package = import_module(name)
        except ImportError:
            continue
        table = list(columns(recording))
        frame = package.DataFrame({column.name: column.values for column in table})
        if hasattr(frame, "attrs"):  # pandas has a place for them
            frame.attrs["units"] = {column.name: column.unit for column in table if column.unit}
        return frame
    raise HierarchyError(f"to_dataframe needs {library or ' or '.join(LIBRARIES)}: pip install "
                         f"{library or LIBRARIES[0]}")


def plot(recording: Recorded, names: Sequence[str]) -> Figure:
    """Return a figure with one panel per signal; see `Recording.plot`."""
    from matplotlib.figure import Figure

    known = {name: signal for name, signal in of_ticks(recording).items()
             if signal.dtype.kind in "bif" and name != "t"}
    for name in names:
        if name not in known:
            raise UnknownNameError("signal", name, known)
    asked = list(names) or [name for name in _USUAL if name in known]
    figure = Figure(figsize=(8.0, 1.0 + 1.8 * len(asked)), layout="constrained")
    axes = figure.subplots(len(asked), 1, sharex=True, squeeze=False)[:, 0]
    for ax, name in zip(axes, asked, strict=True):
        _panel(ax, recording, name)
    axes[-1].set_xlabel("t [s]")
    return figure


def _panel(ax: Any, recording: Recorded, name: str) -> None:
    """Draw one signal over time, a curve for each of its numbers."""
    t, signal = recording.signals["t"], recording.signals[name]
    curves = signal.reshape(len(t), -1)
    units = list(dict.fromkeys(signal_units(recording).get(name, ("",))))
    lines = ax.plot(t, curves, linewidth=0.9)
    if 1 < len(lines) <= _LABELLED:
        labels = [f"{name}{''.join(f'[{k}]' for k in place)}"
                  for place in np.ndindex(signal.shape[1:])]
        ax.legend(lines, labels, fontsize="x-small", ncols=2, loc="upper right")
    ax.set_ylabel(f"{name} [{', '.join(units)}]" if any(units) else name)


def html(recording: Recorded) -> str:
    """Return a table of a run: what ran, how it ended, and its signals."""
    scenario, t = recording.scenario, recording.signals["t"]
    facts = [("scenario", scenario.title or scenario.name), ("robot", recording.facts.robot.name),
             ("resolver", recording.facts.resolver.label),
             ("end", recording.fault or f"after {len(t)} ticks"),
             ("ticks with trouble", len({event[0] for event in recording.events}))]
    shapes = [(name, " x ".join(map(str, signal.shape)), str(signal.dtype))
              for name, signal in recording.signals.items()]
    return (html_table(f"Recording of {scenario.name}", (), facts)
            + html_table("Signals", ("name", "shape", "type"), shapes))
