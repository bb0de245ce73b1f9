"""Compile kernels ahead: `python -m scenarios.ahead` writes the object files of the package.

Jobs run as plain Python, which says what Python calls; processes side by side compile it.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from time import monotonic
from typing import Any

from scenarios.ahead import jobs
from scenarios.results.pool import ended

# The first part of a name of a kernel decides which object file it is in.
PARTS = {"solvers": ("solvers",), "robots": ("hierarchy", "scenarios")}


def main() -> None:
    """Write the object file of each part, unless both are as their sources are."""
    from hierarchy.jit.ahead import FOLDER
    from hierarchy.jit.building import ENVIRONMENT

    if is_current():
        return
    begun, calls = monotonic(), _recorded()
    _say(f"compiling {len(calls)} entries of kernels, once ...")
    parts = [(FOLDER / f"{part}.o", [call for call in calls if call[0].startswith(packages)])
             for part, packages in PARTS.items()]
    with _environment(**ENVIRONMENT):
        for (file, _), size in ended(compile_part, parts):
            _say(f"{file.name}: {size / 1e6:.2f} MB after {monotonic() - begun:.0f} s")


def is_current() -> bool:
    """Whether the object files were made of the jobs and sources as they are."""
    from hierarchy.jit import building
    from hierarchy.jit.ahead import FOLDER

    return all(building.is_current(FOLDER / f"{part}.o", _jobs()) for part in PARTS)


def record(job: str) -> list[Any]:
    """Return the calls of kernels that a job makes, in a process without compilation."""
    from hierarchy.jit import recording

    recording.begin()
    with (redirect_stdout(StringIO()), redirect_stderr(StringIO()),
          tempfile.TemporaryDirectory() as folder):
        jobs.JOBS[job](Path(folder))
    return recording.calls()


def compile_part(part: tuple[Path, Sequence[Any]]) -> int:
    """Write one object file and return its size [B]."""
    from hierarchy.jit.building import build

    file, calls = part
    build(file, _jobs(), calls, lambda count: None if count % 20 else _say(
        f"{file.stem}: {count} of {len(calls)}"))
    return file.stat().st_size


def _recorded() -> list[Any]:
    """Return all calls of all jobs in one order."""
    from hierarchy.jit.sources import described

    calls = set[Any]()
    with _environment(NUMBA_DISABLE_JIT="1"):
        for job, found in ended(record, list(jobs.JOBS)):
            if found is None:
                raise SystemExit(f"task-hierarchy: the job {job} ended its process")
            calls.update(found)
    return sorted(calls, key=lambda call: (call[0], described(call[1])))


def _jobs() -> str:
    from hierarchy.jit.sources import digest_of

    return digest_of(str(jobs.__file__))


@contextmanager
def _environment(**settings: str) -> Iterator[None]:
    before = dict(os.environ)
    os.environ.update(settings)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _say(what: str) -> None:
    print(f"task-hierarchy: {what}", file=sys.stderr, flush=True)
