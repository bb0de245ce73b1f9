"""Processes of this machine that make runs side by side: each asks for the next as one ends.

They are fresh interpreters, so that a caller needs no main module that can be imported again, and
one that dies costs only its own run.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Thread
from typing import Any, final

_TRIES = 2  # processes that may die of the same job
_SERVE = "from scenarios.results.pool import serve; serve()"


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (
        os.cpu_count() or 1)


def ended(work: Callable[[Any], Any], jobs: Sequence[Any], workers: int | None = None,
          salvage: bool = False) -> Iterator[tuple[Any, Any]]:
    """Yield each job with what `work` returns as it ends; None if it killed its process twice.

    Parameters
    ----------
    work : a function that another process can import, or a partial of one.
    workers : number of processes; by default one per processor.
    salvage : at Ctrl-C, interrupt the work in progress too and yield what it returns before
        KeyboardInterrupt is raised; otherwise it is given up.
    """
    waiting, done, stop = iter(jobs), SimpleQueue[Any](), Event()
    count = min(workers or processors(), len(jobs))
    crew = [_Worker(work, waiting, done, stop) for _ in range(count)]
    left = len(jobs)
    try:
        while left:
            yield done.get()
            left -= 1
    except KeyboardInterrupt:
        stop.set()
        if salvage:
            for worker in crew:
                worker.signal(salvage=True)
            for worker in crew:
                worker.join()
            while not done.empty():
                yield done.get()
        raise
    finally:
        stop.set()
        for worker in crew:
            worker.signal(salvage=False)


@final
class _Worker(Thread):
    """A process, and the thread that hands it jobs."""

    def __init__(self, work: Any, waiting: Iterator[Any], done: SimpleQueue[Any], stop: Event
                 ) -> None:
        super().__init__(daemon=True)
        self._work, self._waiting, self._done, self._stopped = work, waiting, done, stop
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def run(self) -> None:
        """Hand on jobs until there are none left."""
        while not self._stopped.is_set() and (job := next(self._waiting, None)) is not None:
            result = None
            for _ in range(_TRIES):
                result = self._asked(job)
                if result is not None or self._stopped.is_set():
                    break
            if result is not None or not self._stopped.is_set():
                self._done.put((job, result))
        self._end()

    def _asked(self, job: Any) -> Any:
        """Return what the process answers, None if it dies of it."""
        process = self._process = self._process or _started()
        assert process.stdin is not None
        assert process.stdout is not None
        if self._stopped.is_set():
            return None
        try:
            pickle.dump((self._work, job), process.stdin)
            process.stdin.flush()
            return pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._end()
            return None

    def signal(self, salvage: bool) -> None:
        """Interrupt the work in progress as Ctrl-C would, or kill the process; any thread may."""
        if self._process is not None:
            self._process.terminate() if salvage else self._process.kill()

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            with suppress(BrokenPipeError), process:
                process.kill()


def _started() -> subprocess.Popen[bytes]:
    path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
    settings = {**os.environ, "PYTHONPATH": path, "TASK_HIERARCHY_WORKER": "1"}
    return subprocess.Popen([sys.executable, "-c", _SERVE], stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, env=settings,
                            start_new_session=True)  # Ctrl-C of a terminal reaches the caller only


def serve() -> None:
    """Answer the jobs on standard input until it ends; what work prints goes to standard error."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            work, job = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        signal.signal(signal.SIGTERM, _interrupt_once)
        result = work(job)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        pickle.dump(result, answers)
        answers.flush()


def _interrupt_once(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt
