"""`hierarchy sweep` and `hierarchy compare --starts`: sampled runs and their statistics."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from rich.text import Text

from scenarios.cli.progress import bar
from scenarios.cli.terminal import interruptible, print_columns, print_json
from scenarios.results.columns import Results, compared, summary, verdict
from scenarios.results.sampled import Finished, Workers, compare_starts, sweep
from scenarios.results.store import TABLE
from scenarios.results.sweep_file import load_sweep

if TYPE_CHECKING:
    from scenarios.config import Scenario


def sweep_command(file: str, out: Path | None, workers: Workers, as_json: bool = False) -> int:
    """Run a sweep, print its results, and return the exit code.

    The code is 0 if every run has a row, 1 if no run finished.
    """
    folder = out if out is not None else Path("runs") / f"sweep-{load_sweep(file).name}"
    begun = perf_counter()
    with interruptible(_continues(folder)), bar("runs") as told:
        done = sweep(file, folder, workers, told, shlex.join(["hierarchy", *sys.argv[1:]]))
    return _say(done, folder, as_json, perf_counter() - begun)


def starts_command(scenarios: list[Scenario], resolvers: list[str] | None, starts: int, seed: int,
                   out: Path | None, workers: Workers, as_json: bool = False) -> int:
    """Compare scenarios from sampled starts, print the statistics, and return the exit code."""
    folder = out if out is not None else Path("runs") / f"starts-{scenarios[0].name}"
    begun = perf_counter()
    with interruptible(_continues(folder)), bar("runs") as told:
        done = compare_starts(scenarios, resolvers, starts, seed, folder, workers=workers,
                              progress=told, command=shlex.join(["hierarchy", *sys.argv[1:]]))
    return _say(done, folder, as_json, perf_counter() - begun)


def _continues(folder: Path) -> str:
    return f"finished runs are in {folder}, and the same command continues from there"


def _say(done: Finished, folder: Path, as_json: bool, seconds: float) -> int:
    runs, part = len(done.plan.runs), not done.found
    if as_json:
        print_json({"folder": str(folder), "report": str(folder / "index.html"),
                    "table": str(folder / TABLE), "statistics": str(folder / "results.json"),
                    "runs": runs, "made_now": done.made, "did_not_reach_their_end": done.failed,
                    "refused": list(done.plan.refused)})
        return int(done.failed == runs)
    for name, results in done.found.items():
        _show(name, results)
    if done.plan.refused:
        print("", *done.plan.refused, sep="\n")
    if part:
        print(f"{done.made} runs of this part made in {folder}; {seconds:.0f} s\n"
              "After all parts, the same command without --part makes the table and the page.")
        return 0
    kept = f", {runs - done.made} of them from before" if done.made < runs else ""
    print(f"\n{runs} runs{kept}; {done.failed} did not finish; {seconds:.0f} s")
    print(f"Report: {folder / 'index.html'}")
    return int(done.failed == runs)


def _show(name: str, results: Results) -> None:
    """Print the verdict, success rates, and the spread of each metric by resolver."""
    rows = [(one.label, [Text(str(results.share(one, label))) for label in results.labels])
            for one in results.criteria()]
    for metric in results.shown():
        best = results.best(metric)
        cells = []
        for label in results.labels:
            text = Text(summary(results, metric, label) + "* "[label not in best],
                        "bold" if label in best else "")
            said = compared(results, metric, label)
            cells.append(text.append(f"\n{said} ", "not bold dim") if said else text)
        rows.append((f"{metric.label} [{metric.shown_unit}]" if metric.shown_unit else
                     metric.label, cells))
    print_columns([f"{name}: {results.samples} samples, paired", *verdict(results)],
                  "median [quartiles]", results.labels, rows)
