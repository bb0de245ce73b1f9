"""`hierarchy compare` without `--starts`: run every pair, print the metrics, write the report."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from scenarios.cli.progress import bar
from scenarios.cli.terminal import exit_code, interruptible, print_json, print_table, shown
from scenarios.config import Scenario
from scenarios.config.resolvers import default_resolvers
from scenarios.results.comparing import compare
from scenarios.results.pool import processors


def compare_scenarios(scenarios: list[Scenario], resolvers: list[str] | None, folder: Path,
                      as_json: bool, workers: int | None = None) -> int:
    """Run scenarios under resolvers, None for all suitable ones, and return the exit code."""
    if resolvers is None:
        _say_what_is_missing(scenarios, as_json)
    command, count = shlex.join(["hierarchy", *sys.argv[1:]]), workers or processors()
    with (interruptible(f"the runs made so far are in {shown(folder)}"),
          bar("runs" if count > 1 else "ticks") as told):
        comparison = compare(scenarios, resolvers, out=folder, progress=told, command=command,
                             workers=count)
    report = shown(folder / "index.html")
    if as_json:
        print_json({"report": report, **comparison.as_plain_data()})
    else:
        for runs in comparison.groups().values():
            print_table(runs)
        print("", *comparison.refused, sep="\n" if comparison.refused else "")
        print(f"\nReport: {report}")
    return max([exit_code(f"{run.label}: {run.fault}") for run in comparison.faults], default=0)


def _say_what_is_missing(scenarios: list[Scenario], as_json: bool) -> None:
    """Name the suitable resolvers that are not installed, and the remedy."""
    missing: dict[str, str] = {}
    for scenario in scenarios:
        missing |= default_resolvers(scenario.asks)[1]
    for spec, remedy in missing.items():
        print(f"skipped: {spec} is not installed; {remedy}",
              file=sys.stderr if as_json else sys.stdout)
