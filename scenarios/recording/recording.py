"""A finished run: its signals, see scenarios.recording.signals, and the facts to read them by."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError, check_name, is_one_of
from hierarchy.notebook import html_table
from hierarchy.problem import Array
from hierarchy.words import gathered
from scenarios.config import Scenario
from scenarios.recording.facts import Facts
from scenarios.recording.signals import known

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class DepthView(NamedTuple):
    """One depth image with the distances that follow from it; P points, the end effector last.

    t [s]; image (h, w) [m], 0 where there is no reading; camera (16,), see `Pinhole.packed`;
    points (P, 3) [m]; distance (P,) [m] of each to what it is nearest to, infinite where that is
    nothing; pixel (P,) of the image, counted row by row, in which that is, or -1; active, the
    point of D_minimal, or -1.
    """

    t: float
    image: NDArray[np.float32]
    camera: Array
    points: Array
    distance: Array
    pixel: NDArray[np.int64]
    active: int


_LIBRARIES = ("pandas", "polars")
_LABELLED = 10  # curves of a panel that a legend can name
_USUAL = ("q", "v", "position_error", "minimal_distance")  # what `plot` draws unless told


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

    def __contains__(self, name: str) -> bool:
        if is_one_of(name, self.signals):
            return True
        if not isinstance(name, str) or known(name) is None:
            raise UnknownNameError("signal", name, plugins.known("signals"))
        return False

    def get(self, name: str, default: NDArray[Any]) -> NDArray[Any]:
        """Return a signal, or `default` where the run does not have it."""
        return self.signals[name] if name in self else default

    def __repr__(self) -> str:
        end = f", fault={self.fault!r}" if self.fault else ""
        return (f"Recording({self.scenario.name!r}, {self.facts.resolver.label!r}, "
                f"{self.ticks} ticks, {len(self.signals)} signals{end})")

    def _repr_html_(self) -> str:
        """Return what ran, how it ended, and its signals."""
        facts = [("scenario", self.scenario.title or self.scenario.name),
                 ("robot", self.facts.robot.name), ("resolver", self.facts.resolver.label),
                 ("end", self.fault or f"after {self.ticks} ticks"),
                 ("ticks with trouble", len({event.tick for event in self.events}))]
        shapes = [(name, " x ".join(map(str, signal.shape)), str(signal.dtype))
                  for name, signal in self.signals.items()]
        return (html_table(f"Recording of {self.scenario.name}", (), facts)
                + html_table("Signals", ("name", "shape", "type"), shapes))

    def plot(self, *names: str) -> Figure:
        """Return a matplotlib figure of signals over time, one panel each; by default the usual.

        `savefig` writes it to a file. Raises UnknownNameError for a signal that the run lacks.
        """
        drawn = {name: signal for name, signal in self.of_ticks().items()
                 if signal.dtype.kind in "bif" and name != "t"}
        for name in names:
            check_name("signal", name, drawn)
        asked = names or [name for name in _USUAL if name in drawn]
        figure = _shown_figure(figsize=(8.0, 1.0 + 1.8 * len(asked)), layout="constrained")
        axes = figure.subplots(len(asked), 1, sharex=True, squeeze=False)[:, 0]
        units = self.units()
        for ax, name in zip(axes, asked, strict=True):
            lines = {f"{name}{index}": ax.plot(self["t"], values, linewidth=0.9)[0]
                     for index, values in _entries(drawn[name])}
            if 1 < len(lines) <= _LABELLED:
                ax.legend(lines.values(), lines, fontsize="x-small", ncols=2, loc="upper right")
            shown = ", ".join(dict.fromkeys(units.get(name, ())))
            ax.set_ylabel(f"{name} [{shown}]" if shown else name)
        axes[-1].set_xlabel("t [s]")
        return figure

    def to_dataframe(self, library: str | None = None) -> Any:
        """Return all signals as a data frame, one row per tick and one column per number.

        `library` is "pandas", which has the units in `attrs`, or "polars"; None takes the first
        that is installed. Raises HierarchyError, saying what to install, where none is.
        """
        if library is not None:
            check_name("library", library, _LIBRARIES)
        columns = self.columns()
        for name in _LIBRARIES if library is None else (library,):
            try:
                package = import_module(name)
            except ImportError:
                continue
            frame = package.DataFrame({one: values for one, (_, values) in columns.items()})
            if hasattr(frame, "attrs"):  # pandas has a place for them
                frame.attrs["units"] = {one: unit for one, (unit, _) in columns.items() if unit}
            return frame
        raise HierarchyError(f"to_dataframe needs {library or ' or '.join(_LIBRARIES)}: pip "
                             f"install {library or _LIBRARIES[0]}")

    def columns(self) -> dict[str, tuple[str, NDArray[Any]]]:
        """Return unit, or "", and values (T,) of every number per tick, by names such as `q[0]`.

        The stack and the events follow as text.
        """
        units, found = self.units(), dict[str, tuple[str, NDArray[Any]]]()
        for name, signal in self.of_ticks().items():
            unit_of = units.get(name, ("",))
            each = len(unit_of) == int(np.prod(signal.shape[1:]))
            for i, (index, values) in enumerate(_entries(signal)):
                found[name + index] = unit_of[i if each else 0], values
        events = [""] * self.ticks
        for tick, kind, action in self.events:
            events[tick] += f"{'; ' if events[tick] else ''}{kind}: {action}"
        return {**found, "stack": ("", self.stacks()),
                "events": ("", np.array(events, dtype=np.str_))}

    def of_ticks(self) -> dict[str, NDArray[Any]]:
        """Return the signals that have one entry per tick, not one value for the whole run."""
        return {name: signal for name, signal in self.signals.items()
                if not ((of := known(name)) and of.constant)}

    def units(self) -> dict[str, tuple[str, ...]]:
        """Return the units of the entries of each signal with units; a single one holds for all."""
        robot, level = self.facts.robot, self.scenario.control.level
        velocities = tuple(f"{unit}/s" for unit in robot.velocity_units)
        accelerations = tuple(f"{unit}/s^2" for unit in robot.velocity_units)
        per_joint = {
            "joint": robot.position_units, "joint/s": velocities, "joint/s^2": accelerations,
            "command": {"velocity": velocities, "acceleration": accelerations,
                        "torque": robot.effort_units[robot.actuated:]}[level]}
        return {name: per_joint.get(of.unit, (of.unit,)) for name in self.signals
                if (of := known(name)) and of.unit}

    @property
    def ticks(self) -> int:
        """Number of ticks."""
        return len(self.signals["t"])

    @property
    def seconds(self) -> float:
        """How long the run lasted [s], to the end of its last tick."""
        return self.ticks * self.scenario.control.period

    @property
    def beside_computing(self) -> str:
        """What the times of whole ticks have beside the controller's, in words."""
        return "" if self.scenario.plant.follows else "with the step of the simulated robot"

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

    def stacks(self) -> NDArray[Any]:
        """Return the tasks of each tick's stack (T,) as text, most important first."""
        names: NDArray[Any] = np.array(self.orders or ("",), dtype=np.str_)
        return np.asarray(names[self.signals["order"]])

    def true(self, name: str) -> Array:
        """Return a signal as it was, where that is known apart from what was measured."""
        return self.signals.get(f"true_{name}", self[name])

    def path_error(self) -> Array:
        """Return the path of [position] minus where the end effector truly was (T, 3) [m]."""
        return np.asarray(self["desired_position"] - self.true("ee_position"))

    def off_path(self) -> Array:
        """Return the norm of `path_error` (T,) [m]."""
        return np.asarray(np.linalg.norm(self.path_error(), axis=1))

    def switches(self) -> NDArray[np.int64]:
        """Ticks k at which the order of the stack differs from that of tick k - 1."""
        return np.flatnonzero(np.diff(self.signals["order"])) + 1

    def troubles(self) -> dict[tuple[str, str], list[int]]:
        """Ticks of each kind of trouble and action, ordered by first occurrence."""
        return gathered(((kind, action), tick) for tick, kind, action in self.events)


def was_interrupted(fault: str | None) -> bool:
    """Whether Ctrl-C or a signal ended a run, by its fault."""
    return str(fault).startswith("interrupted")


def _entries(signal: NDArray[Any]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield each number of a signal (T, ...) over time, with its indices as text."""
    for place in np.ndindex(signal.shape[1:]):
        yield "".join(f"[{k}]" for k in place), signal[(slice(None), *place)]


def _shown_figure(**settings: Any) -> Figure:
    """Return a figure that a notebook shows; without pyplot it would not."""
    from matplotlib.figure import Figure

    class Shown(Figure):
        def _repr_png_(self) -> bytes:
            png = BytesIO()
            self.savefig(png, format="png")
            return png.getvalue()

    return Shown(**settings)
