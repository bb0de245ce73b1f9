"""Time of a whole tick of `ellipse`: sense, allocate, rows, resolve, integrate, record."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from benchmark.machine import one_core
from benchmark.plain import PlainTick
from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import TIMES, Column, Table, whole
from benchmark.timing import times_of
from hierarchy.problem import Array
from scenarios.cell.build import build
from scenarios.config import Scenario, load
from scenarios.loop.controller import Controller
from scenarios.loop.recorder import Recorder
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording

SPECS = ("tpm-published", "tpm", "recursive", "augmented")
PARTS = ("kinematics", "rows", "resolve", "act and record")
LEAD_IN = 5        # ticks at the start of a block that do not count: cold caches
_WARM_UP = 2000    # ticks before counting starts
_BLOCK = 500       # ticks per turn of a candidate
_AGREE = 1e-7      # [rad/s^2] tolerance between compiled and plain commands
_COLUMNS = (*TIMES, *(Column(head, f"{part}_us") for head, part in zip(
    ("kinem.", "rows", "resolve", "act+rec"), PARTS, strict=True)),
    Column("failed", "failures", whole), Column("faster", "times_faster_than_plain"))


def run(scenario: Scenario | None = None) -> Report:
    """Time every tick of the letter's run under each resolver, and the plain numpy tick.

    The candidates take turns in blocks of the same run, so that noise of the machine affects all
    equally.
    """
    scenario = scenario or load("ellipse")
    path = simulate(scenario)  # the states at which all candidates are timed
    compiled = {spec: _Compiled(scenario.with_resolver(spec), path) for spec in SPECS}
    plain = _Plain(scenario, path)
    for k in range(0, path.ticks, 50):
        state = path["t"][k], path["q"][k], path["v"][k]
        gap = np.abs(compiled["tpm"].controller.command(*state) - plain.tick.step(*state)).max()
        if gap > _AGREE:
            raise AssertionError(f"tick {k}: compiled and plain commands differ by {gap}")
    candidates: dict[str, _Compiled | _Plain] = {**compiled, "plain numpy": plain}
    with one_core():
        for candidate in candidates.values():
            candidate.run(0, min(_WARM_UP, path.ticks))
            candidate.forget()
        for begin in range(0, path.ticks, _BLOCK):
            for candidate in candidates.values():
                candidate.run(begin, min(begin + _BLOCK, path.ticks))
    rows = [_row(name, *candidate.result()) for name, candidate in candidates.items()]
    for row in rows:
        row["times_faster_than_plain"] = rows[-1]["median_us"] / row["median_us"]
    title = "One control tick of ellipse, microseconds, one core, warm kernels"
    return Report("The control tick", [Section("", [Table(title, rows, _COLUMNS, "tick")])],
                  {"tick": rows})


class _Compiled:
    """The compiled tick: controller, plant and recorder as the loop calls them."""

    def __init__(self, scenario: Scenario, path: Recording) -> None:
        self.controller, self.path = Controller(scenario), path
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

    def result(self) -> tuple[Array, int]:
        """Return times [us] of the parts and the whole (T, 5), and the ticks without an answer."""
        run: Any = self.recorder.finish(None, None)  # type: ignore[arg-type]
        parts = [run[f"time_{part}"] for part in ("kinematics", "rows", "resolve", "tick")]
        times = np.column_stack([*parts[:3], parts[3] - sum(parts[:3]), parts[3]])
        return 1e6 * times, int((run["status"] != 0).sum())


class _Plain:
    """The same tick in plain numpy."""

    def __init__(self, scenario: Scenario, path: Recording) -> None:
        self.tick, self.path = PlainTick(scenario, build(scenario)), path
        self.forget()

    def forget(self) -> None:
        self.tick.log.clear()
        self.times: list[float] = []

    def run(self, begin: int, end: int) -> None:
        t, q, v = self.path["t"], self.path["q"], self.path["v"]
        for k in range(begin, end):
            start = perf_counter()
            self.tick.step(t[k], q[k], v[k])
            self.times.append(perf_counter() - start)

    def result(self) -> tuple[Array, int]:
        """Return the same; the times of the parts are not known."""
        return np.array([[np.nan] * 4 + [1e6 * time] for time in self.times]), 0


def _row(name: str, times: Array, failures: int) -> Row:
    times = times[np.arange(len(times)) % _BLOCK >= LEAD_IN]
    parts = dict(zip((f"{part}_us" for part in PARTS), np.median(times[:, :-1], axis=0),
                     strict=True))
    return {"tick": name, "ticks": len(times), **times_of(1e3 * times[:, -1]), **parts,
            "failures": failures}
