"""Time of a whole tick of `ellipse`: sense, allocate, rows, resolve, integrate, record."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from hierarchy.problem import Array
from scenarios.bench.plain import PlainTick
from scenarios.bench.rows import write_rows
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.recorder import Recorder
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording

SPECS = ("tpm-published", "tpm", "recursive", "augmented")
PARTS = ("kinematics", "rows", "resolve", "act and record")
_WARM_UP = 2000    # ticks before counting starts
_BLOCK = 500       # ticks per turn of a candidate
_LEAD_IN = 5       # ticks at the start of a block that do not count: cold caches
_AGREE = 1e-7      # [rad/s^2] tolerance between compiled and plain commands


def run(out: Path | None = None) -> list[dict[str, Any]]:
    """Time every tick of the letter's run under each resolver, and the plain numpy tick.

    The candidates take turns in blocks of the same run, so that noise of the machine affects all
    equally. Returns one row per candidate, times in microseconds; prints a table; writes tick.csv
    into the folder `out` if given.
    """
    scenario = load("ellipse")
    path = simulate(scenario)  # the states at which all candidates are timed
    compiled = {spec: _Compiled(scenario.with_resolver(spec), path) for spec in SPECS}
    plain = _Plain(scenario, path)
    _check_same_command(compiled["tpm"], plain, path)
    candidates: dict[str, _Compiled | _Plain] = {**compiled, "plain numpy": plain}
    for candidate in candidates.values():
        candidate.run(0, min(_WARM_UP, path.ticks))
        candidate.forget()
    for begin in range(0, path.ticks, _BLOCK):
        for candidate in candidates.values():
            candidate.run(begin, min(begin + _BLOCK, path.ticks))
    rows = [_row(name, candidate) for name, candidate in candidates.items()]
    slow = rows[-1]["median_us"]
    for row in rows:
        row["times_faster_than_plain"] = slow / row["median_us"]
    _print(rows)
    if out is not None:
        write_rows(rows, out / "tick.csv")
    return rows


class _Compiled:
    """The compiled tick: controller, plant and recorder as the loop calls them."""

    def __init__(self, scenario: Any, path: Recording) -> None:
        self.controller = Controller(scenario)
        self.path = path
        self.forget()

    def forget(self) -> None:
        self.recorder = Recorder(self.controller, self.path.ticks)

    def run(self, begin: int, end: int) -> None:
        controller, recorder, plant = self.controller, self.recorder, self.controller.cell.plant
        t, q, v = self.path["t"], self.path["q"], self.path["v"]
        for k in range(begin, end):
            plant.act(controller.command(t[k], q[k], v[k]))
            recorder.write()
            recorder.stamp(perf_counter())

    def times(self) -> Array:
        run = self.recorder.finish(None, None)  # type: ignore[arg-type]
        parts = [run[f"time_{part}"] for part in ("kinematics", "rows", "resolve", "tick")]
        return np.column_stack([*parts[:3], parts[3] - sum(parts[:3]), parts[3]]) * 1e6

    def failures(self) -> int:
        return int((self.recorder.finish(None, None)["status"] != 0).sum())  # type: ignore[arg-type]


class _Plain:
    """The same tick in plain numpy."""

    def __init__(self, scenario: Any, path: Recording) -> None:
        self.tick = PlainTick(scenario, build(scenario))
        self.path = path
        self.forget()

    def forget(self) -> None:
        self.tick.log.clear()
        self._times: list[float] = []

    def run(self, begin: int, end: int) -> None:
        t, q, v = self.path["t"], self.path["q"], self.path["v"]
        for k in range(begin, end):
            start = perf_counter()
            self.tick.step(t[k], q[k], v[k])
            self._times.append(perf_counter() - start)

    def times(self) -> Array:
        whole = np.array(self._times) * 1e6
        return np.column_stack([np.full((len(whole), 4), np.nan), whole])

    def failures(self) -> int:
        return 0


def _check_same_command(compiled: _Compiled, plain: _Plain, path: Recording) -> None:
    for k in range(0, path.ticks, 50):
        state = path["t"][k], path["q"][k], path["v"][k]
        gap = np.abs(compiled.controller.command(*state) - plain.tick.step(*state)).max()
        if gap > _AGREE:
            raise AssertionError(f"tick {k}: compiled and plain commands differ by {gap}")


def _row(name: str, candidate: _Compiled | _Plain) -> dict[str, Any]:
    times = candidate.times()
    times = times[np.arange(len(times)) % _BLOCK >= _LEAD_IN]
    whole = times[:, -1]
    median, p95, p999 = np.percentile(whole, [50, 95, 99.9])
    parts = dict(zip((f"{part}_us" for part in PARTS), np.median(times[:, :-1], axis=0),
                     strict=True))
    return {"tick": name, "ticks": len(whole), "median_us": median, "p95_us": p95,
            "p99.9_us": p999, **parts, "failures": candidate.failures()}


def _print(rows: list[dict[str, Any]]) -> None:
    table = Table(title="One control tick of ellipse, microseconds, one core, warm kernels",
                  padding=(0, 0))
    table.add_column("tick", no_wrap=True)
    for column in ("median", "p95", "p99.9", "kinem.", "rows", "resolve", "act+rec", "failed",
                   "faster"):
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        parts = [row[f"{part}_us"] for part in PARTS]
        table.add_row(row["tick"], *(f"{row[key]:.1f}" for key in ("median_us", "p95_us",
                                                                    "p99.9_us")),
                      *("-" if np.isnan(part) else f"{part:.1f}" for part in parts),
                      str(row["failures"]), f"{row['times_faster_than_plain']:.1f}x")
    Console().print(table)
