"""A finished run: its signals, see scenarios.recording.signals, and the facts to read them by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import UnknownNameError
from scenarios.recording import notebook
from scenarios.recording.depth_view import DepthView
from scenarios.recording.facts import Facts
from scenarios.recording.signals import check

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from scenarios.config import Scenario


class Event(NamedTuple):
    """The kind of trouble in a tick and the action taken; see `scenarios.loop.policy`."""

    tick: int
    kind: str
    action: str




@dataclass(frozen=True, repr=False)
class Recording:
    """One run, tick by tick; `scenarios.recording.signals` lists the signals.

    A signal that does not apply to the scenario is absent; a name that no signal has is an error.
    `events` are the ticks with trouble, `facts` describe robot and resolver, `depth` is an image of
    the camera, if there is one.
    """

    signals: dict[str, NDArray[Any]]
    orders: tuple[str, ...]
    scenario: Scenario
    facts: Facts
    fault: str | None = None
    events: tuple[Event, ...] = ()
    depth: DepthView | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self:
            raise UnknownNameError("signal", name, self.signals)
        return self.signals[name]

    def get(self, name: str, default: NDArray[Any]) -> NDArray[Any]:
        """Return a signal, or `default` where the run does not have it."""
        return self.signals[name] if name in self else default

    def __repr__(self) -> str:
        end = f", fault={self.fault!r}" if self.fault else ""
        return (f"Recording({self.scenario.name!r}, {self.facts.resolver.label!r}, "
                f"{self.ticks} ticks, {len(self.signals)} signals{end})")

    def _repr_html_(self) -> str:
        return notebook.html(self)

    def plot(self, *names: str) -> Figure:
        """Return a matplotlib figure of signals over time, one panel each; by default the usual.

        `savefig` writes it to a file. Raises UnknownNameError for a signal that the run lacks.
        """
        return notebook.plot(self, names)

    def to_dataframe(self, library: str | None = None) -> Any:
        """Return all signals as a data frame, one row per tick and one column per number.

        `library` is "pandas", which has the units in `attrs`, or "polars"; None takes the first
        that is installed. Raises HierarchyError, saying what to install, where none is.
        """
        return notebook.data_frame(self, library)

    def __contains__(self, name: str) -> bool:
        if name not in self.signals:
            check(name)
        return name in self.signals

    @property
    def ticks(self) -> int:
        """Number of ticks."""
        return len(self.signals["t"])

    @property
    def order_names(self) -> tuple[tuple[str, ...], ...]:
        """The tasks of each of the orders, most important first."""
        return tuple(tuple(name for name in order.split(" > ") if name) for order in self.orders)

    @property
    def task_names(self) -> tuple[str, ...]:
        """The tasks that were in the stack in any tick (N,)."""
        return tuple(dict.fromkeys(name for order in self.order_names for name in order))

    @property
    def in_stack(self) -> NDArray[np.bool_]:
        """Whether each of `task_names` is in each tick's stack (T, N)."""
        orders, names = self.order_names, self.task_names
        table = np.array([[name in order for name in names] for order in orders], dtype=bool)
        return np.asarray(table.reshape(len(orders), len(names))[self.signals["order"]])

    def switches(self) -> NDArray[np.int64]:
        """Ticks k at which the order of the stack differs from that of tick k - 1."""
        return np.flatnonzero(np.diff(self.signals["order"])) + 1

    def troubles(self) -> dict[tuple[str, str], list[int]]:
        """Ticks of each kind of trouble and action, ordered by first occurrence."""
        found: dict[tuple[str, str], list[int]] = {}
        for tick, kind, action in self.events:
            found.setdefault((kind, action), []).append(tick)
        return found
