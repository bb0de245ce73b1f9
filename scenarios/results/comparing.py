"""Run scenarios under several resolvers, write the runs and report the comparison."""

import dataclasses
import shlex
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import final

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
    names = dict.fromkeys(run.scenario.name for run in planned)
    specs = ",".join(dict.fromkeys(run.spec for run in planned))
    said = command or shlex.join(["hierarchy", "compare", *names, "--resolvers", specs,
                                  *([] if out is None else ["--out", str(out)])])
    empty = Comparison((), said, versions(), refused, None if out is None else str(out))
    written, told = _Written(folder, empty, len(planned)), progress or (lambda *_: None)
    make = _together if min(workers, len(planned)) > 1 else _one_by_one
    try:
        for i, run in make(planned, folder, workers, told):
            written.add(i, run)
        return written.finish()
    except KeyboardInterrupt:
        with suppress(PageError):  # matplotlib cannot be used if its import was interrupted
            written.finish()
        raise
    finally:
        if folder is not None:
            files.remove_empty(folder)
            files.unlock(folder)


class PageError(RuntimeError):
    """The page could not be made; the runs are kept."""


@final
class _Written:
    """The runs made so far, also at Ctrl-C; page and table are written again as they come."""

    def __init__(self, folder: Path | None, empty: Comparison, count: int) -> None:
        self._folder, self._empty, self._count = folder, empty, count
        self._runs: dict[int, Run] = {}
        self._next = 0.0

    def add(self, i: int, run: Run) -> None:
        """Take a run; write the table, and the page of two or more unless it was just written."""
        self._runs[i] = run
        if self._folder is None or not self._made:
            return
        with suppress(FullError):  # `finish` says so
            self._write_table(self._folder)
        if 1 < len(self._runs) < self._count and time.monotonic() >= self._next:
            begun = time.monotonic()
            with suppress(Exception):  # `finish` says what is wrong with it
                self._write_page(self._folder)
            self._next = begun + (time.monotonic() - begun) / _SHARE

    def finish(self) -> Comparison:
        """Write all that is there and return it.

        Raises PageError, and KeyboardInterrupt if that came before the first tick.
        """
        if not self._made:
            raise KeyboardInterrupt
        found = self._found
        try:
            if self._folder is not None:
                self._write_table(self._folder)
                self._write_page(self._folder)
        except Exception as error:  # of the disk, a style of matplotlib, a user's figure
            apart = "".join(f"; {run.label}: {run.error}" for run in found.runs if run.error)
            raise PageError(f"the page cannot be made: {type(error).__name__}: {error}; the "
                            f"runs are in {found.folder}{apart}") from error
        return found

    @property
    def _made(self) -> bool:
        """Whether a run has ticks, or failed."""
        return any(run.recording or not run.interrupted for run in self._runs.values())

    @property
    def _found(self) -> Comparison:
        return dataclasses.replace(self._empty, runs=tuple(
            self._runs[i] for i in sorted(self._runs)))

    def _write_table(self, folder: Path) -> None:
        write_table(folder / TABLE, [(job, Outcome(
            job.key, run.recording.ticks if run.recording else 0, run.fault, None,
            tuple(run.metrics.values()))) for run in self._found.runs for job in [_job(run)]])

    def _write_page(self, folder: Path) -> None:
        from scenarios.results.page import comparison_page

        files.write_json(folder / "comparison.json", self._found.as_plain_data())
        files.write_text(folder / "index.html", comparison_page(self._found, self._count))


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
