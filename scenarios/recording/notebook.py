"""Signals as a data frame and as curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, UnknownNameError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LIBRARIES = ("pandas", "polars")
_LABELLED = 10  # curves of a panel that a legend can name


class Column(NamedTuple):
    """One number or text per tick: name such as `q[0]`, unit or "", values (T,)."""

    name: str
    unit: str
    values: NDArray[Any]


def data_frame(columns: Sequence[Column], library: str | None) -> Any:
    """Return a data frame; see `Recording.to_dataframe`."""
    if library is not None and library not in _LIBRARIES:
        raise UnknownNameError("library", library, _LIBRARIES)
    for name in _LIBRARIES if library is None else (library,):
        try:
            package = import_module(name)
        except ImportError:
            continue
        frame = package.DataFrame({column.name: column.values for column in columns})
        if hasattr(frame, "attrs"):  # pandas has a place for them
            frame.attrs["units"] = {column.name: column.unit for column in columns if column.unit}
        return frame
    raise HierarchyError(f"to_dataframe needs {library or ' or '.join(_LIBRARIES)}: pip install "
                         f"{library or _LIBRARIES[0]}")


def curves(t: NDArray[Any], signals: Mapping[str, NDArray[Any]],
           units: Mapping[str, Sequence[str]]) -> Figure:
    """Return a figure with one panel per signal, a curve for each of its numbers."""
    from matplotlib.figure import Figure

    class Shown(Figure):
        def _repr_png_(self) -> bytes:  # a notebook asks for it; without pyplot it shows no figure
            png = BytesIO()
            self.savefig(png, format="png")
            return png.getvalue()

    figure = Shown(figsize=(8.0, 1.0 + 1.8 * len(signals)), layout="constrained")
    axes = figure.subplots(len(signals), 1, sharex=True, squeeze=False)[:, 0]
    for ax, (name, signal) in zip(axes, signals.items(), strict=True):
        lines = ax.plot(t, signal.reshape(len(t), -1), linewidth=0.9)
        if 1 < len(lines) <= _LABELLED:
            labels = [f"{name}{''.join(f'[{k}]' for k in place)}"
                      for place in np.ndindex(signal.shape[1:])]
            ax.legend(lines, labels, fontsize="x-small", ncols=2, loc="upper right")
        shown = ", ".join(dict.fromkeys(units.get(name, ())))
        ax.set_ylabel(f"{name} [{shown}]" if shown else name)
    axes[-1].set_xlabel("t [s]")
    return figure
