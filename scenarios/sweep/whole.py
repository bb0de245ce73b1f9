"""Run a whole sweep, from its file to its page."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from scenarios.config import Scenario
from scenarios.loop.recording import versions
from scenarios.sweep.config import find, load_sweep
from scenarios.sweep.engine import carry_out, connected
from scenarios.sweep.page import Page, name_of
from scenarios.sweep.planning import Plan, Planned, plan
from scenarios.sweep.results import Results, joined, results
from scenarios.sweep.store import Store, write_table, write_text

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Finished:
    """A finished sweep; this call made `made` of its runs."""

    plan: Plan
    found: Mapping[str, Results]
    made: int

    @property
    def failed(self) -> int:
        """Number of runs that did not finish."""
        return sum(reason is not None for one in self.found.values() for reason in one.reasons)


def sweep(name_or_path: str | Path, out: str | Path, workers: int | None = None,
          scheduler: str | None = None, progress: Progress | None = None,
          command: str | None = None) -> Finished:
    """Make the runs of a sweep that `out` does not have yet, and write the results of all.

    `out` holds `parts/` (the runs, written as they finish), `runs.parquet` (all runs with their
    sampled values), `index.html`, and the scenarios of worst and failed runs in `worst/`. After an
    interruption, the same call continues. A failed run is a row with its reason.

    Parameters
    ----------
    workers : processes on this machine; by default one per processor.
    scheduler : address of a Dask scheduler whose workers are used instead.
    progress : called as progress(name, runs done, total runs).
    command : the command line shown on the page.

    Raises
    ------
    HierarchyError : before any run: an invalid file, key, value, resolver, folder or address.
    FullError : a file cannot be written, such as on a full disk.
    EngineError : the scheduler is lost, or a worker has another version of the code.
    """
    planned = plan(load_sweep(name_or_path))
    store = Store(Path(out))
    with store.opened():
        kept = store.keys()
        missing = [run.job for run in planned.runs if run.job.key not in kept]
        done = len(planned.runs) - len(missing)

        def told(count: int = 0) -> None:
            nonlocal done
            done += count
            if progress is not None:
                progress(planned.sweep.name, done, len(planned.runs))

        if missing:
            with connected(workers, scheduler) as client:
                told()
                carry_out(missing, client, store.add, told)
        text = find(name_or_path).read_text(encoding="utf-8")
        said = command or shlex.join(["hierarchy", "sweep", str(name_or_path), "--out", str(out)])
        return Finished(planned, _written(planned, store, text, said), len(missing))


def _written(planned: Plan, store: Store, text: str, command: str) -> dict[str, Results]:
    """Write the results of all parts, and return them by scenario."""
    table = joined(planned, store)
    found = results(planned, table)
    page = Page(planned, found, store.folder, command, text, versions())
    write_table(table, store.folder / "runs.parquet")
    write_text(json.dumps(versions(), indent=2) + "\n", store.folder / "versions.json")
    (store.folder / "worst").mkdir(exist_ok=True)
    for run in page.worst_runs():
        write_text(_scenario_of(run), store.folder / "worst" / name_of(run))
    write_text(page.html(), store.folder / "index.html")
    return found


def _scenario_of(run: Planned) -> str:
    """Return the scenario of a run as TOML, with its resolver."""
    return Scenario.from_toml(run.job.text).with_resolver(
        run.job.resolver).to_toml()
