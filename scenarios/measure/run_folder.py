"""The folder of one run: its recording, its metrics, and the versions that it was made with."""

import dataclasses
import json
import os
import platform
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from hierarchy.archives import read_arrays
from hierarchy.errors import HierarchyError, expect, file_path, naming, refuse
from scenarios.config import load
from scenarios.files import OutputError, whole, write_json
from scenarios.measure import metrics
from scenarios.measure.verdict import verdict
from scenarios.recording.facts import Facts
from scenarios.recording.recording import DepthView, Event, Recording
from scenarios.recording.signals import check_shapes
from solvers.status import Status

_ALWAYS = ("t", "q", "v", "a", "command", "ee_position", "order", "status", "iterations",
           "joint_lower", "joint_upper", "velocity_limit")  # what every run has, beside its times
_PACKAGES = ("task-hierarchy", "numpy", "numba", "pin", "qpsolvers", "proxsuite", "osqp", "mujoco")
_EVENT = np.dtype([("tick", np.int64), ("kind", "U24"), ("action", "U8")])


def save(recording: Recording, folder: str | Path,
         changes: Sequence[Mapping[str, Any]] = ()) -> Path:
    """Write a run's folder, which must be new or empty, whole or not at all; return its path.

    The files are `run.npz` (the signals by name, `orders`, `fault` and `events`), `timings.npz`
    (the signals time_*), `facts.json`, `depth.npz` if there is a camera image, `metrics.json`, with
    the goals, `scenario.toml` as run, `versions.json`, and `changes.json` with the `changes` of a
    live run, if there are any; `hierarchy figures` adds the figures.
    Only times are measured: the same scenario and versions give the same bytes of `run.npz`.
    """
    expect("save", recording, Recording, "give what `simulate` returns")
    signals: dict[str, Any] = recording.signals
    times = {name: signal for name, signal in signals.items() if name.startswith("time_")}
    rest = {name: signal for name, signal in signals.items() if name not in times}
    path = file_path("save", folder)
    with whole(path) as partial:
        np.savez_compressed(partial / "run.npz", **rest,
                            orders=np.array(recording.orders, dtype=np.str_),
                            fault=np.array(recording.fault or ""),
                            events=np.array(list(recording.events), dtype=_EVENT))
        np.savez_compressed(partial / "timings.npz", **times)
        if recording.depth is not None:
            np.savez_compressed(partial / "depth.npz", **recording.depth._asdict())
        write_json(partial / "facts.json", dataclasses.asdict(recording.facts))
        write_json(partial / "versions.json", versions())
        (partial / "scenario.toml").write_text(recording.scenario.to_toml(), encoding="utf-8")
        if changes:
            write_json(partial / "changes.json", changes)
        write_json(partial / "metrics.json", metrics.as_plain_data(recording)
                   | verdict(recording).as_plain_data())
    return path


def kept(recording: Recording, folder: Path,
         changes: Sequence[Mapping[str, Any]] = ()) -> str | None:
    """Save a run, where `folder` cannot be written in the system's temporary folder.

    Returns None, or why and where; or why in neither.
    """
    try:
        save(recording, folder, changes)
    except OutputError as error:
        spare = Path(tempfile.mkdtemp(prefix="hierarchy-"))
        try:
            return f"{error}; the run is in {save(recording, spare / 'run', changes)}"
        except OutputError as too:
            spare.rmdir()
            return f"{error}; {too}"
    return None


def load_run(folder: str | Path) -> Recording:
    """Read the Recording that `save` wrote; nothing outside the folder is needed.

    Raises
    ------
    HierarchyError : a file of the run is missing or damaged, named, or the run was written by an
        earlier version.
    """
    path = file_path("load_run", folder)
    if not path.is_dir():
        what = "a file, not the folder of a run" if path.exists() else "no folder of a run"
        raise HierarchyError(f"{path} is {what}; `hierarchy run SCENARIO` writes one")
    if not (path / "run.npz").exists():
        inside = sorted(file.parent for file in path.glob("*/*/run.npz"))
        hint = f"; it holds runs, such as {inside[0]}" if inside else ""
        raise HierarchyError(f"{path} is not a run folder: it has no run.npz{hint}")
    scenario = load(str(path / "scenario.toml"))
    facts = _facts(path / "facts.json")
    signals = _arrays(path / "run.npz", *_ALWAYS, "orders", "fault", "events")
    orders, fault, events = (signals.pop(name) for name in ("orders", "fault", "events"))
    signals |= _arrays(path / "timings.npz", *metrics.PARTS)
    ticks = signals["t"].size
    with naming(f"{path} cannot be read"):
        check_shapes(signals, T=ticks, nq=len(facts.robot.rest), n=len(facts.robot.velocity_names))
        refuse(events.dtype != _EVENT or not _indices(events["tick"], ticks), "an event of no tick")
        refuse(not _indices(signals["order"], orders.size), "signal 'order': no index into orders")
        refuse(not {*signals["status"].tolist()} <= {*Status}, "signal 'status': no Status")
    depth = None
    if (path / "depth.npz").exists():
        seen: dict[str, Any] = _arrays(path / "depth.npz", *DepthView._fields)
        depth = DepthView(**{**seen, "t": float(seen["t"]), "active": int(seen["active"])})
    return Recording(signals, tuple(map(str, orders)), scenario, facts, str(fault) or None,
                     tuple(Event(*event) for event in events.tolist()), depth)


def _indices(values: NDArray[Any], count: int) -> bool:
    """Whether values are whole numbers from 0 to count - 1."""
    return values.dtype.kind in "iu" and bool(((values >= 0) & (values < count)).all())


def _arrays(path: Path, *names: str) -> dict[str, NDArray[Any]]:
    with naming(f"{path} cannot be read"):
        found = read_arrays(path)
        for name in names:
            refuse(name not in found, f"it has no {name!r}")
    return found


def _facts(path: Path) -> Facts:
    with naming(f"{path} cannot be read", of=(OSError, ValueError, RecursionError)):
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        refuse('"model"' not in text,  # none, or a tree of joints in its place
               "an earlier version wrote it; run the scenario again")
        found = TypeAdapter(Facts).validate_python(json.loads(text))
        found.robot.placements(np.array(found.robot.rest))  # the model can be read
        return found


def versions(*more: str) -> dict[str, str]:
    """Return the versions of packages, those of a run and `more`, and the processor."""
    found = {name: version_of(name) or "not installed" for name in (*_PACKAGES, *more)}
    return {"python": platform.python_version(), **found,
            "system": f"{platform.system()} {platform.machine()}",
            "processor": f"{_processor()}, {os.cpu_count()} cores"}


def version_of(package: str) -> str | None:
    """Return the version of a package, None if it is not installed."""
    with suppress(PackageNotFoundError):
        return version(package)
    return None


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line[:10] == "model name")
    except (OSError, StopIteration):
        return platform.processor() or "unknown processor"
