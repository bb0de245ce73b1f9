"""One entrant on one file, in processes of its own: a crash or a hang costs one problem."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import Any, final

from scenarios.bench.open.table import Row
from scenarios.bench.peers.environments import MissingError, python_of

START_LIMIT = 180.0  # [s] for imports, including compilation of kernels
LIMIT = 10.0         # [s] for one problem with all its repetitions
MOST_ENDS = 5        # crashes and hangs of an entrant on a file, after which the rest is left out
CRASHED, HUNG, LEFT_OUT = "crashed", "time limit", "left out after crashes"
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_HERE = Path(__file__).parent

Said = dict[str, Any]


def run_entrant(row: Row, file: Path, count: int, limit: float = LIMIT) -> tuple[Said, list[Said]]:
    """Return what an entrant says of itself, and of each of the `count` problems of a file.

    limit : [s] for one problem. Raises MissingError if the entrant cannot be started at all.
    """
    about: Said = {}
    answers: list[Said] = []
    ends = 0
    with _staged() as folder:
        while len(answers) < count:
            if ends == MOST_ENDS:
                answers += [{"problem": p, "ended": LEFT_OUT} for p in range(len(answers), count)]
                break
            worker = _Worker(row, file, len(answers), folder)
            try:
                about = about or worker.line(START_LIMIT)
                if ends:
                    worker.line(START_LIMIT)
                answers += worker.answers(count - len(answers), limit)
            finally:
                why = worker.stop()
            if len(answers) < count:
                ends += 1
                answers.append({"problem": len(answers), "ended": HUNG if worker.hung else CRASHED,
                                "why": why})
    return about, answers


@contextmanager
def _staged() -> Iterator[Path]:
    """Give a folder from which environments without this project can import the worker."""
    with tempfile.TemporaryDirectory() as temporary:
        target = Path(temporary) / "scenarios" / "bench" / "open"
        shutil.copytree(_HERE / "entrants", target / "entrants",
                        ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("__init__.py", "entrant.py", "worker.py"):
            shutil.copy(_HERE / name, target)
        yield Path(temporary)


@final
class _Worker:
    """A process of `scenarios.bench.open.worker`; `hung` once it was killed for its time."""

    def __init__(self, row: Row, file: Path, first: int, folder: Path) -> None:
        self.hung = False
        python = row.python or python_of(row.package)
        own = dict(os.environ, **dict.fromkeys(_THREADS, "1"))
        if python != sys.executable:
            own.pop("PYTHONPATH", None)
        core = str(max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0)
        self._log = (folder / "log.txt").open("w+")
        try:
            self._process = subprocess.Popen(
                [python, "-m", "scenarios.bench.open.worker", row.adapter,
                 json.dumps(dict(row.options)), str(file.resolve()), str(first), core],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._log, text=True,
                cwd=folder, env=own)
        except OSError as error:
            self._log.close()
            raise MissingError(f"{python}: {error.strerror}") from error

    def line(self, limit: float) -> Said:
        """Return the next line; raises MissingError if there is none within the limit [s]."""
        said = self._next(limit)
        if said is None:
            raise MissingError(f"no answer within {limit:g} s" if self.hung else self._last_words())
        return said

    def answers(self, most: int, limit: float) -> list[Said]:
        """Return the answers until one takes too long, or the process ends."""
        found: list[Said] = []
        while len(found) < most and (said := self._next(limit)) is not None:
            found.append(said)
        return found

    def stop(self) -> str:
        """End the process and return its last words."""
        self._process.kill()
        self._process.communicate()
        said = self._last_words()
        self._log.close()
        return said

    def _next(self, limit: float) -> Said | None:
        assert self._process.stdout is not None
        timer = Timer(limit, self._kill)
        timer.start()
        try:
            line = self._process.stdout.readline()
        finally:
            timer.cancel()
        return json.loads(line) if line.endswith("\n") else None

    def _kill(self) -> None:
        self.hung = True
        self._process.kill()

    def _last_words(self) -> str:
        code = self._process.wait()
        self._log.seek(0)
        lines = self._log.read().strip().splitlines()
        return f"ended with code {code}" + (f": {lines[-1]}" if lines else "")
