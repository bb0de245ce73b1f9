"""A finished run: its signals, see scenarios.loop.signals, and the facts to read them by."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from hierarchy.archives import read_arrays
from hierarchy.errors import HierarchyError, UnknownNameError, file_path
from scenarios.files import write_json
from scenarios.loop import notebook
from scenarios.loop.depth_view import DepthView
from scenarios.loop.facts import Facts
from scenarios.loop.signals import check

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from scenarios.config import Scenario


class Event(NamedTuple):
    """The kind of trouble in a tick and the action taken; see `scenarios.loop.policy`."""

    tick: int
    kind: str
    action: str


_EVENT = np.dtype([("tick", np.int64), ("kind", "U24"), ("action", "U8")])


@dataclass(frozen=True, repr=False)
class Recording:
    """One run, tick by tick; `scenarios.loop.signals` lists the signals.

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
        """Return all signals as a data frame, one row per tick, columns as `hierarchy export` has.

        `library` is "pandas" or "polars"; None takes the first that is installed. Raises
        HierarchyError, saying what to install, where none is.
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

    def switches(self) -> NDArray[np.int64]:
        """Ticks k at which the order of the stack differs from that of tick k - 1."""
        return np.flatnonzero(np.diff(self.signals["order"])) + 1

    def troubles(self) -> dict[tuple[str, str], list[int]]:
        """Ticks of each kind of trouble and action, ordered by first occurrence."""
        found: dict[tuple[str, str], list[int]] = {}
        for tick, kind, action in self.events:
            found.setdefault((kind, action), []).append(tick)
        return found


def write(recording: Recording, folder: Path) -> None:
    """Write a run to an existing folder.

    The files are `run.npz` (the signals by name, `orders`, `fault` and `events`), `timings.npz`
    (the signals time_*), `facts.json`, `depth.npz` if there is a camera image, `scenario.toml` as
    run, and `versions.json`. Only times are measured: the same scenario and versions give the same
    bytes of `run.npz`.
    """
    times = {name: signal for name, signal in recording.signals.items() if name.startswith("time_")}
    rest = {name: signal for name, signal in recording.signals.items() if name not in times}
    np.savez_compressed(folder / "run.npz", allow_pickle=False, **rest,
                        orders=np.array(recording.orders, dtype=np.str_),
                        fault=np.array(recording.fault or ""),
                        events=np.array(list(recording.events), dtype=_EVENT))
    np.savez_compressed(folder / "timings.npz", allow_pickle=False, **times)
    if recording.depth is not None:
        np.savez_compressed(folder / "depth.npz", allow_pickle=False, **recording.depth.arrays())
    write_json(folder / "facts.json", dataclasses.asdict(recording.facts))
    write_json(folder / "versions.json", versions())
    (folder / "scenario.toml").write_text(recording.scenario.to_toml(), encoding="utf-8")


def load_run(folder: str | Path) -> Recording:
    """Read the Recording that `write` wrote; nothing outside the folder is needed.

    Raises
    ------
    HierarchyError : a file of the run is missing or damaged, named, or the run was written by an
        earlier version.
    """
    from scenarios.config import load

    path = file_path("load_run", folder)
    if not path.is_dir():
        raise HierarchyError(f"run folder {path} does not exist")
    if not (path / "run.npz").exists():
        inside = sorted(file.parent for file in path.glob("*/*/run.npz"))
        hint = f"; it holds runs, such as {inside[0]}" if inside else ""
        raise HierarchyError(f"{path} is not a run folder: it has no run.npz{hint}")
    scenario = load(str(path / "scenario.toml"))
    signals = _arrays(path / "run.npz")
    if not (path / "facts.json").exists():
        raise HierarchyError(f"{path} was written by an earlier version; run the scenario again")
    for name in ("orders", "fault", "events"):
        if name not in signals:
            raise HierarchyError(f"{path / 'run.npz'} cannot be read: it has no {name!r}")
    orders, fault, events = (signals.pop(name) for name in ("orders", "fault", "events"))
    signals |= _arrays(path / "timings.npz")
    return Recording(signals, tuple(map(str, orders)), scenario, _facts(path / "facts.json"),
                     str(fault) or None, tuple(Event(*event) for event in events.tolist()),
                     _depth(path / "depth.npz"))


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    try:
        return read_arrays(path)
    except HierarchyError as error:
        raise HierarchyError(f"{path} cannot be read: {error}") from error


def _facts(path: Path) -> Facts:
    try:
        return TypeAdapter(Facts).validate_python(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, RecursionError) as error:
        raise HierarchyError(f"{path} cannot be read: {error}") from error


def _depth(path: Path) -> DepthView | None:
    if not path.exists():
        return None
    try:
        return DepthView.of_arrays(_arrays(path))
    except KeyError as error:
        raise HierarchyError(f"{path} cannot be read: it has no {error}") from error


def versions() -> dict[str, str]:
    """Return the versions and the processor of this installation."""
    packages = ("task-hierarchy", "numpy", "numba", "pin", "qpsolvers", "proxsuite", "osqp",
                "mujoco")
    return {"python": platform.python_version(), **{name: _version(name) for name in packages},
            "system": f"{platform.system()} {platform.machine()}",
            "processor": f"{_processor()}, {os.cpu_count()} cores"}


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line[:10] == "model name")
    except (OSError, StopIteration):
        return platform.processor() or "unknown processor"
