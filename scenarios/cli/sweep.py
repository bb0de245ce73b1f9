"""`hierarchy sweep` and `hierarchy compare --starts`: sampled runs and their statistics."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from scenarios.cli.options import INTERRUPTED
from scenarios.cli.progress import bar
from scenarios.cli.terminal import print_json
from scenarios.sweep.config import load_sweep
from scenarios.sweep.engine import EngineError
from scenarios.sweep.printing import show
from scenarios.sweep.store import FullError
from scenarios.sweep.whole import Finished, Progress, compare_starts, sweep

if TYPE_CHECKING:
    from scenarios.config import Scenario


def sweep_command(file: str, out: Path | None, workers: int | None, scheduler: str | None,
                  as_json: bool = False) -> int:
    """Run a sweep, print its results, and return the exit code.

    The code is 0 if every run has a row, 1 if the sweep could not continue or no run finished.
    """
    folder = out if out is not None else Path("runs") / f"sweep-{load_sweep(file).name}"
    command = shlex.join(["hierarchy", *sys.argv[1:]])
    return _carried_out(folder, as_json, lambda told: sweep(
        file, folder, workers, scheduler, progress=told, command=command))


def starts_command(scenarios: list[Scenario], resolvers: list[str] | None, starts: int, seed: int,
                   out: Path | None, workers: int | None, scheduler: str | None,
                   as_json: bool = False) -> int:
    """Compare scenarios from sampled starts, print the statistics, and return the exit code."""
    folder = out if out is not None else Path("runs") / f"starts-{scenarios[0].name}"
    command = shlex.join(["hierarchy", *sys.argv[1:]])
    return _carried_out(folder, as_json, lambda told: compare_starts(
        scenarios, resolvers, starts, seed, folder, workers=workers, scheduler=scheduler,
        progress=told, command=command))


def _carried_out(folder: Path, as_json: bool, make: Callable[[Progress | None], Finished]) -> int:
    begun = perf_counter()
    try:
        with bar("runs") as told:
            done = make(told)
    except (FullError, EngineError) as error:
        print(f"hierarchy: fault: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("hierarchy: interrupted; the same command continues from here", file=sys.stderr)
        return INTERRUPTED
    if as_json:
        print_json({"folder": str(folder), "report": str(folder / "index.html"),
                    "table": str(folder / "runs.parquet"),
                    "statistics": str(folder / "results.json"), "runs": len(done.plan.runs),
                    "made_now": done.made, "did_not_reach_their_end": done.failed,
                    "refused": list(done.plan.refused)})
        return int(done.failed == len(done.plan.runs))
    for name, results in done.found.items():
        show(name, results)
    if done.plan.refused:
        print("", *done.plan.refused, sep="\n")
    runs = len(done.plan.runs)
    kept = f", {runs - done.made} of them from before" if done.made < runs else ""
    print(f"\n{runs} runs{kept}; {done.failed} did not finish; "
          f"{perf_counter() - begun:.0f} s")
    print(f"Report: {folder / 'index.html'}")
    return int(done.failed == runs)
