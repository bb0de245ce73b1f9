"""Run a whole sweep, from its file to its page."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, final

from hierarchy.words import listed
from scenarios.config import Scenario, load
from scenarios.measure.run_folder import versions
from scenarios.sweep.config import Sweep, find, load_sweep
from scenarios.sweep.data import as_plain_data
from scenarios.sweep.engine import Work, carry_out, connected
from scenarios.sweep.page import Page, name_of
from scenarios.sweep.planning import Plan, Planned, plan
from scenarios.sweep.results import Results, joined, results
from scenarios.sweep.run import Job, run_batch
from scenarios.sweep.store import Store, write_table, write_text

if TYPE_CHECKING:
    from distributed import Client

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
    sampled values), `results.json` (the statistics), `index.html`, and the scenarios of worst and
    failed runs in `worst/`. After an interruption, the same call continues. A failed run is a row
    with its reason.

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
    text = find(name_or_path).read_text(encoding="utf-8")
    said = command or shlex.join(["hierarchy", "sweep", str(name_or_path), "--out", str(out)])
    with Workers(workers, scheduler) as some:
        return _made(plan(load_sweep(name_or_path)), Store(Path(out)), Source(said, text), some,
                     progress)


def compare_starts(scenarios: Sequence[str | Scenario], resolvers: Sequence[str] | None,
                   starts: int, seed: int, out: str | Path, *,
                   workers: int | Workers | None = None,
                   scheduler: str | None = None, progress: Progress | None = None,
                   command: str | None = None) -> Finished:
    """Run every scenario under every resolver from the same sampled starts, and compare.

    The samples are drawn from each scenario's `[variation]`; the rest is as for `sweep`.

    Parameters
    ----------
    resolvers : specs as for `compare`; by default those that a comparison takes.
    starts, seed : number of samples, and the seed from which they are drawn.
    workers : as for `sweep`, or those of the caller, who ends them.
    """
    chosen = [load(one) if isinstance(one, str) else one for one in scenarios]
    asked = Sweep(name="-".join(one.name for one in chosen)[:80], samples=starts, seed=seed,
                  scenarios=tuple(one.name for one in chosen), resolvers=tuple(resolvers or ()),
                  title=f"{listed([one.name for one in chosen])} from {starts} sampled starts",
                  variation=True)
    said = command or shlex.join(
        ["hierarchy", "compare", *asked.scenarios, "--resolvers", ",".join(asked.resolvers),
         "--starts", str(starts), "--seed", str(seed), "--out", str(out)])
    with ExitStack() as own:
        some = workers if isinstance(workers, Workers) else own.enter_context(
            Workers(workers, scheduler))
        return _made(plan(asked, chosen), Store(Path(out)), Source(said), some, progress)


@dataclass(frozen=True)
class Source:
    """Where a sweep comes from: the command, and the text of its file, if there is one."""

    command: str
    file: str = ""


@final
class Workers:
    """Processes on this machine, or those of the Dask scheduler at an address.

    A context: they start when a sweep first needs them, and end with it.
    """

    def __init__(self, processes: int | None = None, scheduler: str | None = None) -> None:
        self._processes, self._scheduler = processes, scheduler
        self._opened, self._client = ExitStack(), None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._client = None
        self._opened.close()

    def client(self) -> Client:
        """Return the client of the workers; raises what `connected` raises."""
        if self._client is None:
            self._client = self._opened.enter_context(
                connected(self._processes, self._scheduler))
        return self._client


def _made(planned: Plan, store: Store, source: Source, workers: Workers,
          progress: Progress | None) -> Finished:
    """Make the runs of a plan that the store does not have, and write the results of all."""
    with store.opened():
        made = complete([run.job for run in planned.runs], store, workers, planned.sweep.name,
                        progress)
        return Finished(planned, _written(planned, store, source), made)


def complete(jobs: Sequence[Job], store: Store, workers: Workers, name: str,
             progress: Progress | None = None, work: Work = run_batch) -> int:
    """Make the runs that an opened store does not have, and return how many those were.

    name : what `progress` is called with. work : runs a batch. Raises what `sweep` raises.
    """
    kept = store.keys()
    missing = [job for job in jobs if job.key not in kept]
    done = len(jobs) - len(missing)

    def told(count: int = 0) -> None:
        nonlocal done
        done += count
        if progress is not None:
            progress(name, done, len(jobs))

    if missing:
        client = workers.client()
        told()
        carry_out(missing, client, store.add, told, work=work)
    return len(missing)


def _written(planned: Plan, store: Store, source: Source) -> dict[str, Results]:
    """Write the results of all parts, and return them by group."""
    table = joined(planned, store)
    found = results(planned, table)
    page = Page(planned, found, store.folder, source.command, source.file, versions())
    write_table(table, store.folder / "runs.parquet")
    write_text(_json(versions()), store.folder / "versions.json")
    write_text(_json(as_plain_data(planned, found, source.command, versions())),
               store.folder / "results.json")
    (store.folder / "worst").mkdir(exist_ok=True)
    for run in page.worst_runs():
        write_text(_scenario_of(run), store.folder / "worst" / name_of(run))
    write_text(page.html(), store.folder / "index.html")
    return found


def _json(data: Any) -> str:
    return json.dumps(data, indent=2) + "\n"


def _scenario_of(run: Planned) -> str:
    """Return the scenario of a run as TOML, with its resolver."""
    return Scenario.from_toml(run.job.text).with_resolver(run.job.resolver).to_toml()
