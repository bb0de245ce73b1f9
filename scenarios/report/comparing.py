"""Run scenarios under several resolvers, write the runs and report the comparison."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from hierarchy.errors import HierarchyError, brief, expect, file_path
from scenarios.cell.build import build
from scenarios.config import Scenario, load, members, shipped_groups
from scenarios.config.resolvers import check_names, usable
from scenarios.config.scenario import OWN
from scenarios.files import claim, whole, write_json, write_text
from scenarios.loop.simulation import simulate
from scenarios.measure.comparison import Comparison
from scenarios.measure.run_folder import save, versions
from scenarios.measure.runs import Run

Progress = Callable[[str, int, int], None]


def compare(scenarios: Iterable[str | Scenario] | str | Scenario,
            resolvers: Sequence[str] | None = None,
            out: str | Path | None = None, progress: Progress | None = None,
            command: str | None = None) -> Comparison:
    """Run every scenario under every resolver, one after the other, and compare.

    A resolver that cannot resolve a scenario's rows is skipped, and the Comparison says so.

    With `out`, each run's folder is out/<scenario>/<resolver>, the page is out/index.html and the
    numbers are in out/comparison.json; `out` appears when all is there. A run that fails does not
    affect the others; Ctrl-C keeps the runs made so far.

    Parameters
    ----------
    scenarios : names of scenarios or groups, paths or Scenario objects.
    resolvers : specs `name` or `name:setting=value:setting=value`, or "own", the one that each
        scenario names; by default those of DEFAULT_RESOLVERS that can resolve the scenario and are
        installed, with a group "own".
    progress : called as progress(label, ticks done, total ticks).
    command : the command line shown on the page; derived from the names by default.

    Raises
    ------
    HierarchyError : before any run: an unknown scenario, resolver or setting, a scenario that does
        not fit its robot, no resolver that can resolve any scenario, or an output folder in use.
    """
    if not isinstance(scenarios, str | Scenario | Iterable):
        raise HierarchyError("compare: expected names, files, or what `load` returns, got "
                             f"{brief(scenarios)}")
    if out is not None:
        out = file_path("compare: out", out)
    asked = [scenarios] if isinstance(scenarios, str | Scenario) else scenarios
    planned, refused = _plan(asked, resolvers)
    with nullcontext() if out is None else whole(claim(out)) as folder:
        runs: list[Run] = []
        for run in planned:
            try:
                runs.append(_carried_out(run, folder, progress))
            except KeyboardInterrupt:
                runs.append(dataclasses.replace(run, error="interrupted"))
            if _interrupted(runs[-1]):
                break
        comparison = Comparison(tuple(runs), command or _command(planned, out), versions(),
                                tuple(refused), None if out is None else str(out))
        if folder is not None:
            _write(comparison, folder)
    return comparison


def _plan(scenarios: Iterable[str | Scenario],
          resolvers: Sequence[str] | None) -> tuple[list[Run], list[str]]:
    """Return the planned runs, and why others are not possible."""
    named = list(scenarios)
    if resolvers is None and any(one in shipped_groups() for one in named):
        resolvers = [OWN]
    loaded = [load(s) if isinstance(s, (str, Path)) else s for s in members(named)]
    for one in loaded:
        expect("compare", one, Scenario, "give names, files, or what `load` returns")
    check_names(loaded)
    runs, refused = [], []
    for scenario in loaded:
        build(scenario)
        can, cannot = usable(scenario, resolvers)
        runs += [Run(one, spec, str(one.make_resolver().label)) for spec, one in can.items()]
        refused += cannot
    if not runs:
        raise HierarchyError("; ".join(refused) or "no resolver was given")
    return [_distinct(run, runs) for run in runs], refused


def _distinct(run: Run, runs: Sequence[Run]) -> Run:
    """Return the run with a unique label.

    This is its resolver's label, its spec if another resolver has the same label, or its
    scenario's name if there is only one resolver.
    """
    if len(runs) > 1 and len({other.spec for other in runs}) == 1:
        return dataclasses.replace(run, label=run.scenario.name)
    same = {other.spec for other in runs if other.label == run.label}
    return dataclasses.replace(run, label=run.spec) if len(same) > 1 else run


def _carried_out(run: Run, folder: Path | None, progress: Progress | None) -> Run:
    tell = partial(progress, f"{run.scenario.name} {run.spec}") if progress else None
    try:
        recording = simulate(run.scenario, progress=tell)
    except Exception as error:  # a failure is a result too, and must not affect the other runs
        return dataclasses.replace(run, error=f"{type(error).__name__}: {error}")
    if folder is not None:
        save(recording, folder / run.folder)
    return dataclasses.replace(run, recording=recording)


def _interrupted(run: Run) -> bool:
    return bool(run.fault) and str(run.fault).startswith("interrupted")


def _write(comparison: Comparison, folder: Path) -> None:
    from scenarios.report import comparison_page

    write_json(folder / "comparison.json", comparison.as_plain_data())
    write_text(folder / "index.html", comparison_page(comparison))


def _command(planned: Sequence[Run], out: str | Path | None) -> str:
    names = dict.fromkeys(run.scenario.name for run in planned)
    specs = ",".join(dict.fromkeys(run.spec for run in planned))
    where = ["--out", str(out)] if out is not None else []
    return shlex.join(["hierarchy", "compare", *names, "--resolvers", specs, *where])
