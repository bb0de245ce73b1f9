"""A finished run: arrays by name, time first, SI units, with the scenario that made it."""

from __future__ import annotations

import os
import platform
import zipfile
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from scenarios.files import write_json

if TYPE_CHECKING:
    from scenarios.config import Scenario


class Event(NamedTuple):
    """What kind of trouble a tick had, as in `scenarios.loop.policy`, and what was done."""

    tick: int
    kind: str
    action: str


_EVENT = np.dtype([("tick", np.int64), ("kind", "U24"), ("action", "U8")])


@dataclass(frozen=True)
class Recording:
    """What one run did, tick by tick.

    Row k of `q` and `v` is the state before the command of tick k, `a` is the acceleration that
    this command meant, so row 0 is the start. T ticks, n joints, K control points.

    Signals
    -------
    t (T,) [s] · q, v, a (T, n) [rad, rad/s, rad/s^2], q and v as the controller knew them
    command (T, n) that was sent: a velocity or an acceleration, after `scenario.control.level`
    true_q, true_v (T, n) the true state where measuring or physics keep it apart from q and v;
    true_ee_position (T, 3) [m] after true_q
    contacts (T,) points of arm and obstacles that touched at once in the period of tick k;
    contact_depth (T,) [m], contact_force (T,) [N], of a plant with physics
    ee_position, desired_position, position_error (T, 3) [m], error = desired - actual
    pointing_error (T,) cos(alpha_d) - cos(alpha), positive outside the cone
    pointing_active (T,) bool, whether the pointing task was in the stack
    task_error_NAME (T, m) of each task of `[[tasks]]`, a space of its name being "_", as the task
    defines it; task_position_NAME (T, 3) [m] of the point or centre of mass that it moves
    control_point_distance (T, K) [m] to the nearest obstacle; minimal_distance (T,) [m], eq. (31)
    active_control_point (T,) number 1..K of the point whose avoidance was in the stack, or -1
    ee_distance (T,) [m]; repulsion_active (T,) bool, whether eq. (30) was in force
    order (T,) index into `orders`; status (T,) value of solvers.Status; iterations (T,)
    transition (T,) weight of the present stack's answer in the command, where stacks are blended
    certified (T,) bool, whether x is the undamped answer, in a run that was certified
    time_kinematics, time_rows, time_resolve, time_tick (T,) [s] of computing; where stacks are
    blended, time_resolve has the rows of the former ones too; time_tick has the plant's step too
    joint_lower, joint_upper, velocity_limit (n,) of the robot, infinite where it has none
    obstacle_offset (T, H, 3) [m] by which obstacles had been dragged off their places, changed (T,)
    bool, whether that or a setting was other than the scenario says, in a live run

    A signal that the scenario has no use for is absent. `events` are the ticks with trouble.
    """

    signals: dict[str, NDArray[Any]]
    orders: tuple[str, ...]
    scenario: Scenario
    fault: str | None = None
    events: tuple[Event, ...] = ()

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.signals[name]

    def __contains__(self, name: str) -> bool:
        return name in self.signals

    @property
    def ticks(self) -> int:
        """Number of ticks that were run."""
        return len(self.signals["t"])

    def switches(self) -> NDArray[np.int64]:
        """Ticks k at which the stack's order differs from that of tick k - 1."""
        return np.flatnonzero(np.diff(self.signals["order"])) + 1

    def troubles(self) -> dict[tuple[str, str], list[int]]:
        """Ticks of each kind of trouble and what was done, in the order of their first."""
        found: dict[tuple[str, str], list[int]] = {}
        for tick, kind, action in self.events:
            found.setdefault((kind, action), []).append(tick)
        return found


def write(recording: Recording, folder: Path) -> None:
    """Write what a run consists of into a folder that exists.

    That is `run.npz` (the signals by name, with `orders`, `fault` and `events`), `timings.npz` (the
    signals time_*), `scenario.toml` as it was run, and `versions.json`. Times are measured, all
    else follows from the scenario: the same scenario and versions give a `run.npz` of the same
    bytes.
    """
    times = {name: signal for name, signal in recording.signals.items() if name.startswith("time_")}
    rest = {name: signal for name, signal in recording.signals.items() if name not in times}
    np.savez_compressed(folder / "run.npz", allow_pickle=False, **rest,
                        orders=np.array(recording.orders, dtype=np.str_),
                        fault=np.array(recording.fault or ""),
                        events=np.array(list(recording.events), dtype=_EVENT))
    np.savez_compressed(folder / "timings.npz", allow_pickle=False, **times)
    write_json(folder / "versions.json", versions())
    (folder / "scenario.toml").write_text(recording.scenario.to_toml(), encoding="utf-8")


def load_run(folder: str | Path) -> Recording:
    """Read the Recording that `write` wrote.

    Raises
    ------
    HierarchyError : a file of the run is missing or damaged, named.
    """
    from scenarios.config import load

    path = Path(folder)
    scenario = load(str(path / "scenario.toml"))
    if not (path / "run.npz").exists():
        raise HierarchyError(f"{path} is not a run folder: it has no run.npz")
    signals = _arrays(path / "run.npz")
    for name in ("orders", "fault"):
        if name not in signals:
            raise HierarchyError(f"{path / 'run.npz'} cannot be read: it has no {name!r}")
    orders, fault = signals.pop("orders"), signals.pop("fault")
    events = signals.pop("events", np.empty(0, _EVENT))
    if (path / "timings.npz").exists():  # earlier versions wrote the times into run.npz
        signals |= _arrays(path / "timings.npz")
    return Recording(signals, tuple(map(str, orders)), scenario, str(fault) or None,
                     tuple(Event(*event) for event in events.tolist()))


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise HierarchyError(f"{path} cannot be read: {error}") from error


def versions() -> dict[str, str]:
    """Return the versions and the processor that a run's numbers were made with."""
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
