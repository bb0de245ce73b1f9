"""Compile kernels ahead: `python -m scenarios.ahead` writes the object files of the package.

With the name of a part it writes that one; `solvers` needs nothing but numba and scipy.

`calls.txt` says what Python calls. `python -m scenarios.ahead record` writes it anew, of what the
jobs of `jobs.py` call.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from time import monotonic

from scenarios.ahead import jobs
from scenarios.results.pool import ended

CALLS = Path(__file__).with_name("calls.txt")
# The first part of a name of a kernel decides which object file it is in.
PARTS = {"solvers": ("solvers",), "robots": ("hierarchy", "scenarios")}


def main() -> None:
    """Write the object files of the parts that are named, or all, unless they are current."""
    from hierarchy.jit.ahead import FOLDER
    from hierarchy.jit.building import ENVIRONMENT

    names = sys.argv[1:]
    if names == ["record"]:
        CALLS.write_text("".join(f"{call}\n" for call in _recorded()))
        names = []
    begun, calls = monotonic(), CALLS.read_text().splitlines()
    parts = [(FOLDER / f"{part}.o", [call for call in calls if call.startswith(PARTS[part])])
             for part in names or PARTS if not is_current(part)]
    for file, entries in parts:
        _say(f"{file.name}: compiling {len(entries)} entries of kernels, once ...")
    os.environ.update(ENVIRONMENT)  # of the processes that compile
    for (file, _), size in ended(compile_part, parts):
        _say(f"{file.name}: {size / 1e6:.2f} MB after {monotonic() - begun:.0f} s")


def is_current(part: str) -> bool:
    """Whether the object file of a part was made of the calls and sources as they are."""
    from hierarchy.jit import building
    from hierarchy.jit.ahead import FOLDER

    return building.is_current(FOLDER / f"{part}.o", _listed())


def record(job: str) -> list[str]:
    """Return the calls of kernels that a job makes, and those of this process before it."""
    from hierarchy.jit.dispatching import asked

    with (redirect_stdout(StringIO()), redirect_stderr(StringIO()),
          tempfile.TemporaryDirectory() as folder):
        jobs.JOBS[job](Path(folder))
    return sorted(asked)


def compile_part(part: tuple[Path, Sequence[str]]) -> int:
    """Write one object file and return its size [B]."""
    from hierarchy.jit.building import build

    file, calls = part
    build(file, _listed(), calls, lambda count: None if count % 20 else _say(
        f"{file.stem}: {count} of {len(calls)}"))
    return file.stat().st_size


def _recorded() -> list[str]:
    """Return all calls of all jobs in one order."""
    calls = set[str]()
    for job, found in ended(record, list(jobs.JOBS)):
        if found is None:
            raise SystemExit(f"task-hierarchy: the job {job} ended its process")
        calls.update(found)
    return sorted(calls)


def _listed() -> str:
    from hierarchy.jit.sources import digest_of

    return digest_of(str(CALLS))


def _say(what: str) -> None:
    print(f"task-hierarchy: {what}", file=sys.stderr, flush=True)
