"""Run scenarios under several resolvers, write the runs and report the comparison."""

import dataclasses
import shlex
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from hierarchy import plugins
from hierarchy.errors import HierarchyError, brief, expect, file_path, whole
from scenarios import files
from scenarios.config import Scenario, load, members, shipped_groups
from scenarios.config.scenario import OWN
from scenarios.loop.simulation import simulate, uninterrupted
from scenarios.measure.run_folder import kept, versions
from scenarios.measure.runs import Run
from scenarios.measure.verdict import Comparison
from scenarios.recording.recording import Recording
from scenarios.results import pool
from scenarios.results.plan import Job, Outcome, digest, key_of, side_by_side
from scenarios.results.store import TABLE, FullError, write_table

Progress = Callable[[str, int, int], None]

TIMED = 1000  # ticks that are timed alone after runs side by side
_SHARE = 0.1  # of the time that is spent on pages while runs are still being made


def compare(scenarios: Iterable[str | Scenario] | str | Scenario,
            resolvers: Sequence[str] | None = None,
            out: str | Path | None = None, progress: Progress | None = None,
            command: str | None = None, workers: int = 1) -> Comparison:
    """Run every scenario under every resolver that can resolve its rows, and compare.

    With `out`, each run's folder is out/<scenario>/<resolver>, the page is out/index.html, the
    table of results out/results.csv, and the numbers are in out/comparison.json. They are written
    as runs end; a run that fails does not affect the others, and Ctrl-C keeps what was made.

    Parameters
    ----------
    scenarios : names of scenarios or groups, paths or Scenario objects.
    resolvers : specs `name:setting=value:setting=value`, or "own", the one that each scenario
        names; by default those of DEFAULT_RESOLVERS that are installed, with a group "own".
    progress : called as progress(label, done, total) with ticks, of several workers with runs.
    command : the command line shown on the page; derived from the names by default.
    workers : number of processes that make runs side by side; the first TIMED ticks of each run are
        then repeated alone for the computing times. With 1, runs are made here one by one.

    Raises
    ------
    HierarchyError : before any run: an unknown scenario, resolver or setting, a scenario that does
        not fit its robot, no resolver that can resolve any scenario, or an output folder in use.
    """
    whole("compare: workers", workers, 1)
    planned, refused = _plan(scenarios, resolvers)
    folder = None if out is None else files.make_folder(files.claim(file_path("compare: out", out)))
    where = None if out is None else str(out)
    empty = Comparison((), command or _command(planned, where), versions(), refused, where)
    made, count, due = dict[int, Run](), len(planned), 0.0

    def found() -> Comparison:
        return dataclasses.replace(empty, runs=tuple(made[i] for i in sorted(made)))

    make = _together if min(workers, count) > 1 else _one_by_one
    try:
        for i, run in make(planned, folder, workers, progress or (lambda *_: None)):
            made[i] = run
            due = _so_far(folder, found(), count, due)
        return _written(folder, found(), count)
    except KeyboardInterrupt:
        with suppress(PageError):  # matplotlib cannot be used if its import was interrupted
            _written(folder, found(), count)
        raise
    finally:
        if folder is not None:
            files.remove_empty(folder)
            files.unlock(folder)


def _command(planned: Sequence[Run], out: str | None) -> str:
    """Return the command that makes a comparison."""
    names = dict.fromkeys(run.scenario.name for run in planned)
    specs = ",".join(dict.fromkeys(run.spec for run in planned))
    where = [] if out is None else ["--out", out]
    return shlex.join(["hierarchy", "compare", *names, "--resolvers", specs, *where])


class PageError(RuntimeError):
    """The page could not be made; the runs are kept."""


def _so_far(folder: Path | None, found: Comparison, count: int, due: float) -> float:
    """Write the table, and of two runs or more the page if it is due; return when it is again."""
    if folder is None or not _began(found):
        return due
    with suppress(FullError):  # `_written` says so
        _write_table(folder, found)
    if 1 < len(found.runs) < count and time.monotonic() >= due:
        begun = time.monotonic()
        with suppress(Exception):  # `_written` says what is wrong with it
            _write_page(folder, found, count)
        due = begun + (time.monotonic() - begun) / _SHARE
    return due


def _written(folder: Path | None, found: Comparison, count: int) -> Comparison:
    """Write all that is there, also at Ctrl-C, and return it.

    Raises PageError, and KeyboardInterrupt if that came before the first tick.
    """
    if not _began(found):
        raise KeyboardInterrupt
    try:
        if folder is not None:
            _write_table(folder, found)
            _write_page(folder, found, count)
    except Exception as error:  # of the disk, a style of matplotlib, a user's figure
        apart = "".join(f"; {run.label}: {run.error}" for run in found.runs if run.error)
        raise PageError(f"the page cannot be made: {type(error).__name__}: {error}; the runs are "
                        f"in {found.folder}{apart}") from error
    return found


def _began(found: Comparison) -> bool:
    """Whether a run has ticks, or failed."""
    return any(run.recording or not run.interrupted for run in found.runs)


def _write_table(folder: Path, found: Comparison) -> None:
    write_table(folder / TABLE, [(job, Outcome(
        job.key, run.recording.ticks if run.recording else 0, run.fault, None,
        tuple(run.metrics.values()))) for run in found.runs for job in [_job(run)]])


def _write_page(folder: Path, found: Comparison, count: int) -> None:
    from scenarios.results.page import comparison_page

    files.write_json(folder / "comparison.json", found.as_plain_data())
    files.write_text(folder / "index.html", comparison_page(found, count))


def _job(run: Run) -> Job:
    text = run.scenario.to_toml()
    return Job(key_of(text, run.spec, digest()), text, run.spec, run.scenario.name,
               plugins=plugins.loaded())


def _plan(scenarios: Iterable[str | Scenario] | str | Scenario,
          resolvers: Sequence[str] | None) -> tuple[list[Run], tuple[str, ...]]:
    """Return the planned runs, and why others are not possible."""
    if not isinstance(scenarios, str | Scenario | Iterable):
        raise HierarchyError("compare: expected names, files, or what `load` returns, got "
                             f"{brief(scenarios)}")
    named = [scenarios] if isinstance(scenarios, str | Scenario) else list(scenarios)
    if resolvers is None and any(one in shipped_groups() for one in named):
        resolvers = [OWN]
    loaded = [load(s) if isinstance(s, (str, Path)) else s for s in members(named)]
    for one in loaded:
        expect("compare", one, Scenario, "give names, files, or what `load` returns")
    return side_by_side(loaded, resolvers)


def _one_by_one(planned: Sequence[Run], folder: Path | None, _: int, progress: Progress
                ) -> Iterator[tuple[int, Run]]:
    """Make the runs in this process, up to an interrupted one."""
    for i, run in enumerate(planned):
        found, error = _recorded(run.scenario, folder and folder / run.folder,
                                 partial(progress, f"{run.scenario.name} {run.spec}"))
        made = dataclasses.replace(run, recording=found, error=error)
        yield i, made
        if made.interrupted:
            return


def _together(planned: Sequence[Run], folder: Path | None, workers: int, progress: Progress
              ) -> Iterator[tuple[int, Run]]:
    """Make the runs in processes; then repeat the first ticks of each here, to time them alone."""
    made, total = dict[int, Run](), len(planned)
    asked = [(i, _job(run), folder and folder / run.folder) for i, run in enumerate(planned)]
    try:
        for (i, _, _), answer in pool.ended(_asked, asked, workers, salvage=True):
            found, error = answer or (None, "the process that made this run died")
            made[i] = dataclasses.replace(planned[i], recording=found, error=error)
            yield i, made[i]
            progress("compare", len(made), total)
    except KeyboardInterrupt:
        for i in set(range(total)) - made.keys():
            yield i, dataclasses.replace(planned[i], error="interrupted")
        return
    for i, run in made.items():
        timed = dataclasses.replace(run, timing=_timed(run))
        if "happened" in vars(run):  # a page has worked it out
            vars(timed)["happened"] = run.happened
        yield i, timed


def _asked(asked: tuple[int, Job, Path | None]) -> tuple[Recording | None, str | None]:
    _, job, folder = asked
    return _recorded(job.load(), folder)


def _recorded(scenario: Scenario, folder: Path | None,
              progress: Callable[[int, int], None] | None = None
              ) -> tuple[Recording | None, str | None]:
    """Return the recording of a run, which is saved in `folder`, or why there is none."""
    try:
        recording = simulate(scenario, progress=progress)
    except KeyboardInterrupt:
        return None, "interrupted"
    except Exception as error:  # a failure is a result too, and must not affect the other runs
        if folder is not None:
            files.write_text(files.make_folder(folder) / "scenario.toml", scenario.to_toml())
        return None, f"{type(error).__name__}: {error}"
    try:
        return recording, None if folder is None else kept(recording, folder)
    except (OSError, files.OutputError) as error:
        return recording, f"not saved: {error}"


def _timed(run: Run) -> Recording | None:
    """Return the first ticks of a run, made while no other run is; None if they cannot be."""
    ticks = min(TIMED, run.recording.ticks if run.recording else 0)
    with suppress(Exception):  # a scenario that allows no shorter duration keeps its own times
        lasting = {"control.duration": ticks * run.scenario.control.period}
        return uninterrupted(run.scenario.with_changes(lasting)) if ticks else None
    return None
