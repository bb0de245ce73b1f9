"""Run one entrant on files of problems, in its own process. Needs only numpy and the entrant.

    python -m scenarios.bench.open.worker ADAPTER OPTIONS CORE FIRST FILE...

ADAPTER is MODULE:CLASS or FILE.py:CLASS, OPTIONS its arguments in JSON, FIRST the problem of the
first file to begin with. On stdout: a line of JSON about the entrant; then, for each file, one once
it is ready and one for each problem.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from time import get_clock_info, perf_counter_ns, process_time_ns
from typing import Any

import numpy as np

from scenarios.bench.open.entrant import Answer, Entrant, Problem, Repeats, read_problems

REPEATS = Repeats(least=3, most=20, turn=2_000_000, enough=20_000_000)
"""Timed solves of a problem."""

_FINE = get_clock_info("process_time").resolution < 1e-6  # coarse on some systems

Reply = Callable[[Any], None]


def main() -> None:
    """Run from the command line; see the docstring of the module."""
    adapter, options, core, first, *files = sys.argv[1:]
    lines = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # output of a package must not mix with the lines
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    entrant = load(adapter)(**json.loads(options))

    def reply(value: Any) -> None:
        print(json.dumps(value), file=lines, flush=True)

    reply({"version": entrant.version()})
    for file, begin in zip(files, [int(first)] + [0] * len(files), strict=False):
        run(entrant, Path(file), begin, reply)


def run(entrant: Entrant, file: Path, begin: int, reply: Reply) -> None:
    """Ask an entrant the problems of a file, from one on."""
    problems, sequence = read_problems(file), consecutive(file)
    rehearse(entrant, problems[begin])
    reply({"start_kib": resident(), "yardstick_ns": yardstick()})
    before = None
    for p in range(begin, len(problems)):
        said, before = asked(entrant, problems, p, before, sequence)
        reply({"problem": p, "rss_kib": resident(), **said})


def load(adapter: str) -> type[Entrant]:
    """Return the class of MODULE:CLASS or FILE.py:CLASS."""
    place, _, name = adapter.rpartition(":")
    if not place.endswith(".py"):
        return getattr(import_module(place), name)  # type: ignore[no-any-return]
    spec = importlib.util.spec_from_file_location(Path(place).stem, place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return getattr(module, name)  # type: ignore[no-any-return]


def consecutive(file: Path) -> bool:
    """Return whether the problems of a file are consecutive ticks."""
    with np.load(file, allow_pickle=False) as kept:
        return bool(json.loads(kept["head.json"])["sequence"])


def rehearse(entrant: Entrant, problem: Problem) -> None:
    """Solve a problem, so that nothing is loaded or compiled while it is timed."""
    try:
        if not entrant.refuses(problem):
            raw = entrant.solve(entrant.prepare(problem))
            if entrant.warm:
                entrant.solve_from(entrant.prepare(problem), raw)
    except Exception:  # it is asked again, and what it raises is told
        return


def asked(entrant: Entrant, problems: list[Problem], p: int, before: Any, sequence: bool
          ) -> tuple[dict[str, Any], Any]:
    """Return what an entrant answers to a problem, with its times, and its answer in its own form.

    before : its own answer to the problem before, if the problems are consecutive.
    """
    problem = problems[p]
    refusal = entrant.refuses(problem)
    if refusal:
        return {"refused": refusal}, None
    try:
        said, raw = cold(entrant, problem)
        if entrant.warm:
            start = before if sequence else entrant.solve(entrant.prepare(problem.moved(p)))
            if start is not None:
                more, raw = warm(entrant, problem, start)
                said |= more
        return said, raw
    except Exception as error:
        return {"raised": f"{type(error).__name__}: {error}".partition("\n")[0]}, None


def cold(entrant: Entrant, problem: Problem) -> tuple[dict[str, Any], Any]:
    """Solve from a cold start, time it, repeat it, and solve without the last level."""
    prepared = entrant.prepare(problem)
    raw = entrant.solve(prepared)
    first = entrant.read(raw)
    said = {**plain(first), "cold_ns": timed(lambda: entrant.solve(prepared)),
            "cold_inside_ns": entrant.inside(prepared, None, REPEATS)}
    again = entrant.read(entrant.solve(entrant.prepare(problem)))
    said["same"] = bool(np.array_equal(first.x, again.x, equal_nan=True))
    shorter = problem.without_last()
    if shorter is not None and not entrant.refuses(shorter):
        answer = entrant.read(entrant.solve(entrant.prepare(shorter)))
        said["without"] = answer.x.tolist() if answer.solved else None
    return said, raw


def warm(entrant: Entrant, problem: Problem, before: Any) -> tuple[dict[str, Any], Any]:
    """Solve from an earlier answer and time it."""
    prepared = entrant.prepare(problem)
    raw = entrant.solve_from(prepared, before)
    said = plain(entrant.read(raw))
    return {"warm_solved": said["solved"], "warm_x": said["x"],
            "warm_iterations": said["iterations"],
            "warm_ns": timed(lambda: entrant.solve_from(prepared, before)),
            "warm_inside_ns": entrant.inside(prepared, before, REPEATS)}, raw


def plain(answer: Answer) -> dict[str, Any]:
    """Return an answer as plain data."""
    return {"solved": bool(answer.solved), "x": np.asarray(answer.x, dtype=float).tolist(),
            "iterations": answer.iterations}


def timed(call: Callable[[], Any]) -> list[int]:
    """Return times of calls [ns], as many as REPEATS says.

    Each is the time that passed, or the processor time of this process if that is less, which is so
    where other work interrupted it.
    """
    times: list[int] = []
    begin = perf_counter_ns()
    while not times or (len(times) < REPEATS.most and perf_counter_ns() - begin < (
            REPEATS.enough if len(times) < REPEATS.least else REPEATS.turn)):
        busy = process_time_ns()
        start = perf_counter_ns()
        call()
        passed = perf_counter_ns() - start
        times.append(min(passed, process_time_ns() - busy) if _FINE else passed)
    return times


def yardstick() -> int:
    """Return the time [ns] of a fixed piece of work, so that a slow machine is noticed."""
    work = np.arange(40_000.0).reshape(200, 200)
    times = []
    for _ in range(20):
        start = perf_counter_ns()
        np.sort(work[::-1], axis=0).sum()
        times.append(perf_counter_ns() - start)
    return int(np.median(times))


def resident() -> int:
    """Return the largest memory that this process has had so far [KiB]; 0 if it is not known."""
    about = Path("/proc/self/status")  # getrusage counts what the parent had before
    lines = about.read_text().splitlines() if about.is_file() else []
    return next((int(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0)


if __name__ == "__main__":
    main()
