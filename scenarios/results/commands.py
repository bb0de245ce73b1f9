"""The commands that repeat a comparison, run by run."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

from scenarios.measure.motions import motions

if TYPE_CHECKING:
    from scenarios.measure.comparison import Comparison
    from scenarios.measure.runs import Run


def run_command(run: Run, folder: str) -> str:
    """Return the command that repeats a run.

    It uses the scenario's name where that gives the same scenario, otherwise the file in the run's
    folder.
    """
    from scenarios.config import load, shipped

    name = run.scenario.name
    if name in shipped() and load(name).with_resolver(run.spec) == run.scenario:
        return shlex.join(["hierarchy", "run", name, "--resolver", run.spec])
    return shlex.join(["hierarchy", "run", str(PurePath(folder, run.folder, "scenario.toml"))])


def commands(comparison: Comparison, runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Return the purpose and text of each command for the runs of one group."""
    folder = comparison.folder or ""
    kept = [run for run in runs if run.recording is not None]
    found = [(f"Repeat {run.label}", run_command(run, folder)) for run in runs]
    if kept:
        first = str(PurePath(folder, kept[0].folder))
        every = [str(PurePath(folder, one.runs[0].folder)) for one in motions(kept)] or [first]
        found += [("View a run in 3D in the browser", shlex.join(["hierarchy", "view", first])),
                  ("Write the replay as a single file, each motion once",
                   shlex.join(["hierarchy", "replay", *every])),
                  ("Draw a run's figures for a paper, as PDF",
                   shlex.join(["hierarchy", "figures", first, "--style", "paper"]))]
    return found
