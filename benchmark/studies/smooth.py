"""Torques from tick to tick, and what is given up for them: python -m benchmark.studies.smooth.

The scenarios at level torque from sampled starts, the same for all resolvers. Steps are those of
runs in which the robot stands to the end; the others fall. Runs are kept in `out`: the same command
continues.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import typer

from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import Column, Table, power, whole
from scenarios.results.columns import Results
from scenarios.results.sampled import Workers, compare_starts

SCENARIOS = "reach-torque,stand-push,stand-momentum,stand-g1,stand-talos"
RESOLVERS = ("hcod", "weighted", "merged")
_COLUMNS = (
    Column("stood", "stood", str), Column("step", "step"), Column("largest", "largest"),
    Column("> 5", "above", whole), Column("limits", "limits", power),
    Column("joints", "excess", power), Column("com", "com", power), Column("hand", "hand", power),
    Column("com off", "end"), Column("time", "time"))
_WORDS = (
    "Of the runs in which the robot stands to the end: torque step, largest of a run, median and "
    "largest [N m]; ticks with a step above 5 N m; worst miss of torque and friction limits; worst "
    "excess of a joint limit [rad]; mean miss of the centre of mass and of the worse hand, medians "
    "[m/s2]; centre of mass off at the end [mm]; time of a solve over that of weighted.")


def run(starts: int = 16, seed: int = 14, scenarios: str = SCENARIOS,
        resolvers: Sequence[str] = RESOLVERS, out: Path = Path("runs/smooth"),
        workers: int | None = None) -> Report:
    """Run the scenarios (names with commas between) and return a table for each."""
    tables: list[Table] = []
    rows: list[Row] = []
    for name in scenarios.split(","):
        done = compare_starts([name], resolvers, starts, seed, out / f"{name}-{seed}",
                              workers=Workers(workers))
        (results,) = done.found.values()
        found = [_row(results, label) for label in results.labels]
        usual = next((one["time"] for one in found if one["entrant"] == "weighted"), np.nan)
        for one in found:
            one["time"] /= usual
        tables.append(Table(f"{name}, {starts} starts, seed {seed}", found, _COLUMNS))
        rows += [{"scenario": name, **one} for one in found]
    return Report("Torques from tick to tick", [Section("", tables, _WORDS)], {"smooth": rows})


def _row(results: Results, label: str) -> dict[str, Any]:
    """Return what is shown of a resolver; runs that fall count only as such."""
    ended = np.array([reason is None for run, reason in zip(
        results.runs, results.reasons, strict=True) if run.label == label])

    def of(metric: str) -> np.ndarray:
        return results.column(metric, label)[ended] if metric in results.values else np.array([])

    hands = np.maximum(of("miss_left_hand"), of("miss_right_hand"))
    step = of("torque_step_max")
    return {"entrant": label.split()[0], "stood": f"{ended.sum()} of {len(ended)}",
            "step": _median(step), "largest": step.max() if len(step) else np.nan,
            "above": of("torque_step_ticks").sum(),
            "limits": of("miss_limits").max(initial=0.0),
            "excess": of("joint_limit_excess").max(initial=0.0),
            "com": _median(of("miss_centre_of_mass")), "hand": _median(hands),
            "end": 1e3 * _median(of("task_centre_of_mass_end")),
            "time": _median(of("time_resolve_median"))}


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else float("nan")


def main(starts: int = 16, seed: int = 14, scenarios: str = SCENARIOS,
         out: Path = Path("runs/smooth")) -> None:
    """Print the tables."""
    run(starts, seed, scenarios, out=out).say()


if __name__ == "__main__":
    typer.run(main)
