"""Compile kernels ahead: `python -m scenarios.ahead` writes the object files of the package.

Jobs run as plain Python, which says what Python calls; processes side by side compile it.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from time import monotonic
from typing import Any

from scenarios.ahead.jobs import JOBS
from scenarios.results.pool import ended

# The first part of a name of a kernel decides which object file it is in.
PARTS = {"solvers": ("solvers",), "robots": ("hierarchy", "scenarios")}


def main() -> None:
    """Record the jobs, and write the object file of each part."""
    begun, calls = monotonic(), set[Any]()
    with _environment(NUMBA_DISABLE_JIT="1"):
        for job, found in ended(record, list(JOBS)):
            if found is None:
                raise SystemExit(f"task-hierarchy: the job {job} ended its process")
            calls.update(found)
    from hierarchy.jit.ahead import FOLDER, described
    from hierarchy.jit.building import ENVIRONMENT

    ordered = sorted(calls, key=lambda call: (call[0], described(call[1])))
    _say(f"compiling {len(ordered)} entries of kernels, once ...")
    parts = [(FOLDER / f"{part}.o", [call for call in ordered if call[0].startswith(packages)])
             for part, packages in PARTS.items()]
    with _environment(**ENVIRONMENT):
        for (file, _), size in ended(compile_part, parts):
            _say(f"{file.name}: {size / 1e6:.2f} MB after {monotonic() - begun:.0f} s")


def record(job: str) -> list[Any]:
    """Return the calls of kernels that a job makes, in a process without compilation."""
    from hierarchy.jit import recording

    recording.begin()
    with redirect_stdout(StringIO()), tempfile.TemporaryDirectory() as folder:
        JOBS[job](Path(folder))
    return recording.noted()


def compile_part(part: tuple[Path, Sequence[Any]]) -> int:
    """Write one object file and return its size [B]."""
    from hierarchy.jit.building import build

    file, calls = part
    build(file, calls, lambda count: None if count % 20 else _say(
        f"{file.stem}: {count} of {len(calls)}"))
    return file.stat().st_size


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
