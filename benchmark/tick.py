"""Time of a whole tick of `ellipse`: sense, allocate, rows, resolve, integrate, record."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter

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
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording

SPECS = ("tpm-published", "tpm", "recursive", "augmented")
PARTS = ("kinematics", "rows", "resolve", "act and record")
LEAD_IN = 50       # ticks at the start of a run that do not count: cold caches
_ROUNDS = 5        # runs of each candidate, which take turns
_AGREE = 1e-7      # [rad/s^2] tolerance between compiled and plain commands
_COLUMNS = (*TIMES, *(Column(head, f"{part}_us") for head, part in zip(
    ("kinem.", "rows", "resolve", "act+rec"), PARTS, strict=True)),
    Column("failed", "failures", whole), Column("faster", "times_faster_than_plain"))


def run(scenario: Scenario | None = None) -> Report:
    """Time every tick of the letter's run under each resolver, and the plain numpy tick.

    The plain tick is asked at the states of the run, and must command the same.
    """
    scenario = scenario or load("ellipse")
    path = simulate(scenario)
    runs = runs_in_turns({spec: scenario.with_resolver(spec) for spec in SPECS}, _ROUNDS)
    rows: list[Row] = []
    for spec, times in runs.items():
        parts = {f"{part}_us": float(np.nanmedian(some)) for part, some in zip(
            PARTS, times.T, strict=False)}
        rows.append({"tick": spec, **parts, **of_ticks(times[:, -1])})
    rows.append({"tick": "plain numpy", **of_ticks(1e6 * _plain(scenario, path))})
    for row in rows:
        row["times_faster_than_plain"] = rows[-1]["median_us"] / row["median_us"]
    title = "One control tick of ellipse, microseconds, one core, warm kernels"
    return Report("The control tick", [Section("", [Table(title, rows, _COLUMNS, "tick")])],
                  {"tick": rows})


def runs_in_turns(scenarios: Mapping[str, Scenario], rounds: int) -> dict[str, Array]:
    """Return the times [us] of ticks of runs, which take turns on one core: (T, 5) by label.

    The columns are PARTS and the whole tick; NaN where there is no answer. One run of each before
    them is not counted: it compiles and fills caches.
    """
    found: dict[str, list[Array]] = {label: [] for label in scenarios}
    with one_core():
        for _ in range(rounds + 1):
            for label, scenario in scenarios.items():
                found[label].append(_times(simulate(scenario)))
    return {label: np.concatenate(runs[1:]) for label, runs in found.items()}


def of_ticks(times: Array) -> Row:
    """Return the row of times [us] of ticks: those answered, and how many are not."""
    answered = times[~np.isnan(times)]
    return {"ticks": len(times), "failures": len(times) - len(answered), **times_of(1e3 * answered)}


def _times(run: Recording) -> Array:
    parts = [run[f"time_{part}"] for part in ("kinematics", "rows", "resolve", "tick")]
    times = 1e6 * np.column_stack([*parts[:3], parts[3] - sum(parts[:3]), parts[3]])
    times[run["status"] != 0] = np.nan
    return times[LEAD_IN:]


def _plain(scenario: Scenario, path: Recording) -> Array:
    """Return the times [s] of the plain tick along a run, whose commands it must repeat."""
    tick, times = PlainTick(scenario, build(scenario)), np.empty(path.ticks)
    with one_core():
        for k, (t, q, v, a) in enumerate(zip(*(path[key] for key in ("t", "q", "v", "a")),
                                             strict=True)):
            start = perf_counter()
            found = tick.step(t, q, v)
            times[k] = perf_counter() - start
            if np.abs(found - a).max() > _AGREE:
                raise AssertionError(f"tick {k}: compiled and plain commands differ by "
                                     f"{np.abs(found - a).max()}")
    return times[LEAD_IN:]
