"""A finished run: arrays by name, time first, in SI units, and the facts to read them by.

Row k of `q` and `v` is the state before the command of tick k, so row 0 is the start; `a` is
the acceleration that this command means. T ticks, n joints, K control points, N tasks.

t (T,) [s] · q, v, a (T, n) [rad, rad/s, rad/s^2], q and v as the controller knew them
command as sent: a velocity or an acceleration (T, n), or the torques of the actuated joints
(T, n - 6 with a floating base) [N m], depending on `scenario.control.level`
planned_acceleration (T, n), planned_force (T, P, 3) [N] on each of P contact points, in world
axes: the answer at level "torque", NaN where there was none
com (T, 3) [m] the true centre of mass; floor_force (T, C, 3) [N] on each contact, slip (T, C)
[m] along the floor since it touched down, pressure_margin (T, C) [m] of the centre of pressure
from the nearest edge of the sole, NaN without load; support_margin (T,) [m] of com inside the
support polygon, the hull of the loaded contacts, from above; push (T, 3) [N]: of the last step of
the simulation in tick k, from a plant with torque motors
true_q, true_v (T, n) the true state where measurement or physics make it differ from q and v;
true_ee_position (T, 3) [m] from true_q
contacts (T,) largest number of contacts between arm and obstacles at once in the period of
tick k; contact_depth (T,) [m], contact_force (T,) [N]; from a plant with physics
ee_position, desired_position, position_error (T, 3) [m], error = desired - actual
pointing_error (T,) cos(alpha_d) - cos(alpha), positive outside the cone
pointing_active (T,) bool, whether the pointing task was in the stack
task_error_NAME (T, m) of each task of `[[tasks]]`, as the task defines it, with "_" for a space
in its name; task_position_NAME (T, 3) [m] of the point or centre of mass that it moves
control_point_distance (T, K) [m] to the nearest obstacle; minimal_distance (T,) [m], eq. (31)
active_control_point (T,) number 1..K of the point whose avoidance is in the stack, or -1
ee_distance (T,) [m]; repulsion_active (T,) bool, whether eq. (30) was in force
true_control_point_distance, true_minimal_distance, true_ee_distance: the same of the true arm
and obstacles, where a camera or measured joints make them differ
order (T,) index into `orders`; status (T,) value of solvers.Status; iterations (T,)
transition (T,) weight of the present stack's answer in the command, where stacks are blended
certified (T,) bool, whether x is the undamped answer, in a certified run
moved_by_lower (T,) [m], see `scenarios.loop.audit.Strictness`
active_set (T,) number of the set of inequality rows that act, counted from 0 as they first
occur, -1 where unknown; present if the resolver reports it
level_fate (T, N) value of `scenarios.loop.fate.Fate` of each of the `task_names` under the
command that was sent; level_violation (T, N) Euclidean norm of the violation of its rows, in
their unit, NaN where the task is absent or its fate unknown; saturated (T, n) -1 or 1 where a
joint is at the lower or upper side of its limits' box of commands, else 0
time_kinematics, time_rows, time_resolve, time_tick (T,) [s] of computation; time_resolve
includes the rows of former stacks where stacks are blended, time_tick the plant's step
joint_lower, joint_upper, velocity_limit (n,) of the robot, infinite where it has none, and at
level "torque" torque_limit of the actuated joints [N m]
obstacle_offset (T, H, 3) [m] by which obstacles were dragged off their places, changed (T,)
bool, whether obstacles or settings differ from the scenario, in a live run
"""

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
    """One run, tick by tick; the module's text lists the signals.

    A signal that does not apply to the scenario is absent. `events` are the ticks with trouble,
    `facts` describe robot and resolver, `depth` is an image of the camera, if there is one.
    """

    signals: dict[str, NDArray[Any]]
    orders: tuple[str, ...]
    scenario: Scenario
    facts: Facts
    fault: str | None = None
    events: tuple[Event, ...] = ()
    depth: DepthView | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self.signals:
            raise UnknownNameError("signal", name, self.signals)
        return self.signals[name]

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
