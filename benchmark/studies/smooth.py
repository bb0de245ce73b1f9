"""Commands from tick to tick, and what is given up for them: python -m benchmark.studies.smooth.

Scenarios from sampled starts, the same for all resolvers, also with `--set plant.delay=0.002` and
other changes. Steps are those of runs that reach their end; in the others the robot falls. Runs are
kept in `out`: the same command continues, and folders of several machines can be put together.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmark.report import Column, Report, Row, Section, Table, power, whole
from benchmark.solve.judge import over
from hierarchy.problem import Array
from scenarios.config import load
from scenarios.results.columns import Results
from scenarios.results.sampled import Workers, compare_starts

SCENARIOS = "reach-torque,stand-push,stand-momentum,stand-g1,stand-talos"
RESOLVERS = "hcod,weighted,merged"
_COLUMNS = (
    Column("stood", "stood", str), Column("step", "step"), Column("largest", "largest"),
    Column("ticks", "above", whole), Column("limits", "limits", power),
    Column("joints", "excess", power), Column("com", "com", power), Column("hand", "hand", power),
    Column("off", "end"), Column("time", "time"))
_WORDS = (
    "Of the runs that reach their end: step of torque, acceleration or speed by level, largest "
    "of a run, median and largest [N m, rad/s2, rad/s]; ticks with one above 5, 50 or 0.1; worst "
    "miss of torque and friction limits; worst excess of a joint limit [rad]; mean miss of the "
    "centre of mass and of the worse hand, medians [m/s2]; centre of mass off at the end, or error "
    "of the position, medians [mm]; time of a solve over that of weighted.")


def main(starts: int = 16, seed: int = 14, scenarios: str = SCENARIOS, resolvers: str = RESOLVERS,
         out: Path = Path("runs/smooth"), workers: int | None = None,
         changes: Annotated[list[str] | None, typer.Option("--set")] = None) -> None:
    """Print a table for each scenario (names with commas between).

    changes : KEY=VALUE of all scenarios, as of `hierarchy run --set`.
    """
    tables: list[Table] = []
    for name in scenarios.split(","):
        scenario = load(name, changes or ())
        done = compare_starts([scenario], resolvers.split(","), starts, seed,
                              out / f"{name}-{seed}", workers=Workers(workers))
        (results,) = done.found.values()
        found = [_row(results, label, f"{scenario.control.level}_step")
                 for label in results.labels]
        usual = next((one["time"] for one in found if one["entrant"] == "weighted"), np.nan)
        for one in found:
            one["time"] /= usual
        title = ", ".join([name, *(changes or ()), f"{starts} starts", f"seed {seed}"])
        tables.append(Table(title, found, _COLUMNS))
    Report("Commands from tick to tick", [Section("", tables, _WORDS)]).say()


def _row(results: Results, label: str, step: str) -> Row:
    """Return what is shown of a resolver; runs that fall count only as such."""
    def of(*metrics: str) -> Array:
        """Return the first of these metrics that is known, NaN of runs that fall."""
        known = [name for name in metrics if name in results.values]
        return results.compared(known[0], label) if known else np.empty(0)

    hands = [of(f"miss_{side}_hand") for side in ("left", "right")]
    return {"entrant": label.split()[0], "stood": str(results.shares()["Reached the end"][label]),
            "step": over(np.median, of(f"{step}_max")),
            "largest": over(np.max, of(f"{step}_max")),
            "above": over(np.sum, of(f"{step}_ticks")),
            "limits": over(np.max, of("miss_limits")),
            "excess": over(np.max, of("joint_limit_excess")),
            "com": over(np.median, of("miss_centre_of_mass")),
            "hand": over(np.median, np.maximum(*hands)),
            "end": 1e3 * over(np.median, of("task_centre_of_mass_end",
                                            "position_error_median_settled")),
            "time": over(np.median, of("time_resolve_median"))}


if __name__ == "__main__":
    typer.run(main)
