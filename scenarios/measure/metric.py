"""What a metric is: a number about a run with a unit, a plain name and a direction."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hierarchy import plugins
from hierarchy.errors import number
from hierarchy.problem import Array
from hierarchy.records import PLAIN, check_fields
from scenarios.recording.recording import Recording

# Display units by SI unit: how many of them make one, what it is called, decimals.
_SHOWN = {"m": (1e3, "mm", 3), "s": (1.0, "s", 3), "deg": (1.0, "°", 3), "share": (100.0, "%", 2),
          "rad": (1.0, "rad", 3), "rad/s": (1.0, "rad/s", 3), "rad/s^2": (1.0, "rad/s²", 2),
          "rad/s^3": (1.0, "rad/s³", 0),
          "N": (1.0, "N", 1), "N m": (1.0, "N m", 2), "N s": (1.0, "N s", 3),
          "N m s": (1.0, "N m s", 3),
          "rows": (1.0, "", 3), "": (1.0, "", 0)}  # "rows": in the units of a level's rows

_COMPUTING = 1e6, "µs", 2  # display unit of a time of the group "Computing"
NOTHING = 1e-9  # SI units: what differs by less differs by rounding


@dataclass(frozen=True)
class Metric:
    """One number about one run.

    `value` is in the SI `unit` ("" for a count, "share" of 1, "deg"), and None when the run has
    no such thing. `lower_is_better` is None where neither direction is. A `detail` is left out of
    tables that must be short. Raises HierarchyError for a value that is not finite.
    """

    name: str
    label: str
    value: float | None
    unit: str
    lower_is_better: bool | None = True
    group: str = ""
    note: str = ""
    detail: bool = False

    def __post_init__(self) -> None:
        check_fields(self, f"metric {self.name!r}", PLAIN | {float: number})

    @property
    def _display(self) -> tuple[float, str, int]:
        times = self.group == "Computing" and self.unit == "s"
        return _COMPUTING if times else _display(self.unit)

    @property
    def shown_unit(self) -> str:
        """The unit in which tables show the value."""
        return self._display[1]

    @property
    def scale(self) -> float:
        """How many of `shown_unit` make one SI unit."""
        return self._display[0]

    def shown(self) -> str:
        """Return the value for a table: in `shown_unit`, without the unit.

        A small value has a digit more; one from 1000 on has none behind the point.
        """
        if self.value is None:
            return "–"
        scale, _, decimals = self._display
        value = self.value * scale
        if not decimals and 0.01 <= abs(value) < 10.0:  # the median of counts
            return f"{value:.2g}"
        if value != 0.0 and (abs(value) < 0.5 * 10.0**-decimals or abs(value) >= 1e5):
            return f"{value:.1e}"
        if value != 0.0 and abs(value) < 10.0 ** (1 - decimals):
            return f"{value:.{decimals + 1}f}"
        return f"{value:.{0 if abs(value) >= 1e3 else decimals}f}"


class Criteria(NamedTuple):
    """What metrics are judged by, see `measure`."""

    settle: float
    cone_tolerance_deg: float


Measure = Callable[["Recording", Criteria], Iterator[Metric]]


def register(name: str) -> Callable[[Measure], Measure]:
    """Return a decorator that makes a function yield metrics of every run."""
    return plugins.register("metrics", name, shipped=True)


def shown(value: float, unit: str) -> str:
    """Return a value in an SI unit as it stands in a sentence: three digits, display unit."""
    scale, name, _ = _display(unit)
    number = f"{value * scale:.3g}" if abs(value * scale) < 999.5 else f"{value * scale:.0f}"
    return number + (name if name == "°" else f" {name}" if name else "")


def _display(unit: str) -> tuple[float, str, int]:
    return _SHOWN.get(unit, (1.0, unit.replace("^2", "²"), 3))


def passed(off: Array, tolerance: float = 0.0) -> Array:
    """Return the excess (T, ...), at least 0, of a run that is `off` beyond a limit, not rounding.

    A run that begins beyond it and comes back has not passed it, unless it goes further.
    """
    came_back = (off <= tolerance).any(axis=0)
    excess = np.where(came_back, off - np.fmin.accumulate(off), off)
    return np.where(excess < NOTHING, 0.0, excess)


def largest(values: Array) -> float | None:
    """Return the largest magnitude; None if there is none, or it is not finite."""
    return finite(np.abs(values).max()) if values.size else None


def least(values: Array) -> float | None:
    """Return the smallest of the values that are not NaN; None if there is none."""
    known = values[~np.isnan(values)]
    return finite(known.min()) if known.size else None


def known(values: Array) -> Array:
    """Return the finite ones of values."""
    return values[np.isfinite(values)]


def finite(value: Any) -> float | None:
    """Return a number, None if it is not finite."""
    return float(value) if np.isfinite(value) else None
