"""Run scenarios from samples, from the file of a sweep or `compare --starts` to the page."""

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from hierarchy.errors import expect_each, file_path, refuse
from hierarchy.words import listed
from scenarios.config import Scenario, load
from scenarios.config.validation import validated
from scenarios.files import finite, write_text
from scenarios.measure.run_folder import versions
from scenarios.measure.statistics import spread
from scenarios.results import cluster, pool
from scenarios.results.columns import Results, results, verdict
from scenarios.results.plan import Job, Outcome, Plan, Sweep, find, load_sweep, outcome, plan
from scenarios.results.sampled_page import name_of, sampled_page, worst_runs
from scenarios.results.store import TABLE, Store, write_table, writing

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Workers:
    """Where runs are made: processes of this machine, by default one per processor, or Dask's.

    scheduler : address of a Dask scheduler, whose workers are used instead.
    part : (i, N), to make only the i-th of N parts of the runs, without the page.
    """

    processes: int | None = None
    scheduler: str | None = None
    part: tuple[int, int] | None = None


@dataclass(frozen=True)
class Finished:
    """A finished sweep; this call made `made` of its runs. Part of a sweep has no results."""

    plan: Plan
    found: Mapping[str, Results]
    made: int

    @property
    def failed(self) -> int:
        """Number of runs that did not finish."""
        return sum(reason is not None for one in self.found.values() for reason in one.reasons)


def sweep(name_or_path: str | Path, out: str | Path, workers: Workers | None = None,
          progress: Progress | None = None, command: str | None = None) -> Finished:
    """Make the runs of a sweep that `out` does not have yet, and write the results of all.

    `out` holds `runs/` (what came of each, as they finish), `results.csv` (all runs with their
    sampled values), `results.json` (the statistics), `index.html`, and the scenarios of worst and
    failed runs in `worst/`. After an interruption, and after its parts, the same call continues. A
    failed run is a row with its reason.

    Parameters
    ----------
    progress : called as progress(name, runs done, total runs).
    command : the command line shown on the page.

    Raises
    ------
    HierarchyError : before any run: an invalid file, key, value, resolver, folder or address.
    FullError : a file cannot be written, such as on a full disk.
    ClusterError : the scheduler is lost, or a worker has another version of the code.
    """
    planned = plan(load_sweep(name_or_path))
    text = find(name_or_path).read_text(encoding="utf-8")
    said = command or shlex.join(["hierarchy", "sweep", str(name_or_path), "--out", str(out)])
    return _made(planned, out, (said, text), workers or Workers(), progress)


def compare_starts(scenarios: Sequence[str | Scenario], resolvers: Sequence[str] | None,
                   starts: int, seed: int, out: str | Path, *, workers: Workers | None = None,
                   progress: Progress | None = None, command: str | None = None) -> Finished:
    """Run every scenario under every resolver from the same sampled starts, and compare.

    The samples are drawn from each scenario's `[variation]`; the rest is as for `sweep`.

    Parameters
    ----------
    resolvers : specs, by default those that `compare` takes.
    starts, seed : number of samples, and the seed from which they are drawn.
    """
    chosen = [load(one) if isinstance(one, str) else one for one in scenarios]
    expect_each("compare_starts", chosen, Scenario, "give names, or what `load` returns")
    names = [one.name for one in chosen]
    asked = validated(Sweep, {
        "name": "-".join(names)[:80], "samples": starts, "seed": seed, "variation": True,
        "title": f"{listed(names)} from {starts} sampled starts",
        "scenarios": names, "resolvers": resolvers or ()}, "compare_starts")
    said = command or shlex.join(
        ["hierarchy", "compare", *asked.scenarios,
         *(["--resolvers", ",".join(asked.resolvers)] if asked.resolvers else []),
         "--starts", str(starts), "--seed", str(seed), "--out", str(out)])
    return _made(plan(asked, chosen), out, (said, ""), workers or Workers(), progress)


def _made(planned: Plan, out: str | Path, source: tuple[str, str], workers: Workers,
          progress: Progress | None) -> Finished:
    """Make the runs of a plan that a folder does not have, and write the results of all."""
    i, count = workers.part or (1, 1)
    refuse(not 1 <= i <= count, f"part {i}/{count}: give 1/{count} to {count}/{count}")
    store = Store(file_path("out", out), f"part-{i}-of-{count}" if workers.part else "all")
    with store.opened():
        made = complete(planned.runs[i - 1::count], store, workers, planned.sweep.name, progress)
        found = {} if workers.part else _written(planned, store, source)
    return Finished(planned, found, made)


def complete(jobs: Sequence[Job], store: Store, workers: Workers, name: str,
             progress: Progress | None = None,
             work: Callable[[Job], Outcome] = outcome) -> int:
    """Make the runs that an opened store does not have, and return how many those were.

    name : what `progress` is called with. work : makes a run. Raises what `sweep` raises.
    """
    kept = store.outcomes()
    missing = [job for job in jobs if job.key not in kept]
    if not missing:
        return 0

    begun = len(jobs) - len(missing)
    told = partial(progress or (lambda *_: None), name)
    told(begun, len(jobs))
    ended = (pool.ended(work, missing, workers.processes) if workers.scheduler is None else
             cluster.ended(work, missing, workers.scheduler))
    for done, (job, found) in enumerate(ended, begun + 1):
        store.add(found or Outcome(job.key, 0, "Killed: every process that started this run died",
                                   None))
        told(done, len(jobs))
    return len(missing)


def _written(planned: Plan, store: Store, source: tuple[str, str]) -> dict[str, Results]:
    """Write the results of all runs, and return them by group."""
    kept = store.outcomes()
    found = results(planned, kept)
    command, file = source
    write_table(store.folder / TABLE, [(run, kept[run.key]) for run in planned.runs])
    texts = {"results.json": json.dumps(finite(_plain(planned, found, command)), indent=2,
                                        allow_nan=False) + "\n",
             "index.html": sampled_page(planned, found, store.folder, command, file),
             **{f"worst/{name_of(run)}": run.load().to_toml() for run in worst_runs(found)}}
    (store.folder / "worst").mkdir(exist_ok=True)
    for name, text in texts.items():
        with writing(store.folder / name):
            write_text(store.folder / name, text)
    return found


def _plain(plan: Plan, found: Mapping[str, Results], command: str) -> dict[str, Any]:
    """Return what `results.json` holds: spread, paired differences and shares, in SI units."""
    return {"command": command, "samples": plan.sweep.samples, "seed": plan.sweep.seed,
            "versions": versions(), "refused": list(plan.refused),
            "groups": {name: {
                "verdict": verdict(one),
                "columns": {label: _column(one, label) for label in one.labels},
                "failures": [{"reason": each.reason, "resolver": each.run.label,
                              "runs": each.count} for each in one.failures()]}
                for name, one in found.items()}}


def _column(results: Results, label: str) -> dict[str, Any]:
    """Return shares and metrics of a column, also beside the first column."""
    metrics, shares = {}, {what: {"met": by[label].met, "of": by[label].of,
                                  "wilson_95": list(by[label].interval)}
                           for what, by in results.shares().items()}
    for metric in results.shown():
        beside = results.paired(metric.name, label)
        metrics[metric.name] = {
            "label": metric.label, "unit": metric.unit,
            **spread(results.column(metric.name, label)),
            **({} if label == results.labels[0] else
               {"against_first": {**asdict(beside), "said": str(beside)}}),
            "best": label in results.best(metric)}
    return {"shares": shares, "metrics": metrics}
