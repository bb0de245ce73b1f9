"""The commands that repeat a comparison, run by run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from hierarchy.errors import HierarchyError
from scenarios.measure.motions import motions

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.measure.comparison import Comparison
    from scenarios.measure.runs import Run


def run_command(run: Run, folder: str) -> str:
    """Return the command that repeats a run.

    It uses the scenario's name and the changed values if they give the same scenario, otherwise
    the scenario file in the run's folder.
    """
    changes = _changes(run)
    if changes is None:
        return _shell("hierarchy", "run", str(PurePath(folder, run.folder, "scenario.toml")))
    sets = [part for change in changes for part in ("--set", change)]
    return _shell("hierarchy", "run", run.scenario.name, "--resolver", run.spec, *sets)


def commands(comparison: Comparison, runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Return the purpose and text of each command for the runs of one group."""
    folder = comparison.folder or ""
    kept = [run for run in runs if run.recording is not None]
    found = [(f"Repeat {run.label}", run_command(run, folder)) for run in runs]
    if kept:
        first = str(PurePath(folder, kept[0].folder))
        every = [str(PurePath(folder, one.runs[0].folder)) for one in motions(kept)] or [first]
        found += [("View a run in 3D in the browser",
                   _shell("hierarchy", "view", first)),
                  ("Write the replay as a single file, each motion once",
                   _shell("hierarchy", "replay", *every)),
                  ("Draw a run's figures for a paper, as PDF",
                   _shell("hierarchy", "figures", first, "--style", "paper"))]
    return found


def _shell(*words: str) -> str:
    return shlex.join(words)


def _changes(run: Run) -> list[str] | None:
    """Return the changes to the shipped scenario that give the run's; None if there are none."""
    from scenarios.config import Scenario, load, shipped

    scenario = run.scenario
    if not isinstance(scenario, Scenario) or scenario.name not in shipped():
        return None
    asked = load(scenario.name).with_resolver(run.spec)
    try:
        changes = list(_differences(_plain(asked), _plain(scenario)))
        same = load(scenario.name, changes).with_resolver(run.spec) == scenario
    except (HierarchyError, TypeError):
        return None
    return changes if same else None


def _plain(scenario: Scenario) -> dict[str, Any]:
    return scenario.model_dump(mode="json")


def _differences(asked: dict[str, Any], found: dict[str, Any], under: str = "") -> Iterator[str]:
    """Yield KEY=VALUE for every value that differs."""
    for key, value in found.items():
        if value == asked.get(key):
            continue
        if isinstance(value, dict) and isinstance(asked.get(key), dict):
            yield from _differences(asked[key], value, f"{under}{key}.")
        else:
            yield f"{under}{key}={_toml(value)}"


def _toml(value: Any) -> str:
    """Return a value as TOML; raises TypeError if TOML cannot represent it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()
                               if one is not None) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if value is None:
        raise TypeError("TOML has no null")
    return json.dumps(value)
