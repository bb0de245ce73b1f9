"""One entrant on files of problems; a crash or a hang costs one problem, never another entrant."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
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


def run_entrant(row: Row, files: Sequence[Path], counts: Sequence[int], limit: float = LIMIT
                ) -> Iterator[tuple[Said, list[Said]]]:
    """Yield, file by file, what an entrant says of itself and of each of the file's problems.

    counts : number of problems of each file. limit : [s] for one problem. Raises MissingError if
    the entrant cannot be started at all.
    """
    with _staged() as folder:
        crew = _Crew(row, folder, limit)
        try:
            for k, count in enumerate(counts):
                yield crew.ask(list(files[k:]), count)
        finally:
            crew.dismiss()


@final
class _Crew:
    """The process of an entrant, and the ones that replace it."""

    def __init__(self, row: Row, folder: Path, limit: float) -> None:
        self.row, self.folder, self.limit = row, folder, limit
        self.about: Said = {}
        self.worker: _Worker | None = None

    def ask(self, files: list[Path], count: int) -> tuple[Said, list[Said]]:
        """Return about and answers of the first file; the process goes on with the next."""
        answers: list[Said] = []
        ready: Said = {}
        for _ in range(MOST_ENDS):
            patience = self._begin(files, len(answers))
            assert self.worker is not None
            said = self.worker.next(patience)
            if said is not None:
                ready = ready or said
                answers += self.worker.answers(count - len(answers), self.limit)
            if len(answers) == count:
                break
            kind = HUNG if self.worker.hung else CRASHED
            answers.append({"problem": len(answers), "ended": kind, "why": self.dismiss()})
            if len(answers) == count:
                break
        answers += [{"problem": p, "ended": LEFT_OUT} for p in range(len(answers), count)]
        return {**self.about, **ready}, answers

    def _begin(self, files: list[Path], first: int) -> float:
        """Start a process if none runs; return how long its first word may take [s]."""
        if self.worker is not None:
            return START_LIMIT  # it may compile for problems of another form
        known = bool(self.about)
        self.worker = _Worker(self.row, files, first, self.folder)
        self.about = self.worker.introduction()
        return 2.0 * self.limit if known else START_LIMIT

    def dismiss(self) -> str:
        """End the process and return its last words."""
        worker, self.worker = self.worker, None
        return "" if worker is None else worker.stop()


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

    def __init__(self, row: Row, files: Sequence[Path], first: int, folder: Path) -> None:
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
                 json.dumps(dict(row.options)), core, str(first),
                 *(str(file.resolve()) for file in files)],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._log, text=True,
                cwd=folder, env=own)
        except OSError as error:
            self._log.close()
            raise MissingError(f"{python}: {error.strerror}") from error

    def introduction(self) -> Said:
        """Return what the entrant says of itself; raises MissingError if it cannot."""
        said = self.next(START_LIMIT)
        if said is None:
            raise MissingError(f"no word within {START_LIMIT:g} s" if self.hung
                               else self._last_words())
        return said

    def answers(self, most: int, limit: float) -> list[Said]:
        """Return the answers until one takes too long, or the process ends."""
        found: list[Said] = []
        while len(found) < most and (said := self.next(limit)) is not None:
            found.append(said)
        return found

    def stop(self) -> str:
        """End the process and return its last words."""
        self._process.kill()
        self._process.communicate()
        said = self._last_words()
        self._log.close()
        return said

    def next(self, limit: float) -> Said | None:
        """Return the next line, or None if there is none within the limit [s]."""
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
