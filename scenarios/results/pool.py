"""Processes of this machine that make runs side by side: each asks for the next as one ends.

They are fresh interpreters, so that a caller needs no main module that can be imported again, and
one that dies costs only its own run.
"""

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event
from typing import Any, final

from solvers.batch import cores

Process = subprocess.Popen[bytes]

_GIVEN_UP = object()  # what an interrupted job returns
_TRIES = 2  # processes that may die of the same job
_SERVE = "from scenarios.results.pool import serve; serve()"


def ended(work: Callable[[Any], Any], jobs: Sequence[Any], workers: int | None = None,
          salvage: bool = False) -> Iterator[tuple[Any, Any]]:
    """Yield each job with what `work` returns as it ends; None if it killed its process twice.

    Parameters
    ----------
    work : a function that another process can import, or a partial of one.
    workers : number of processes; by default one per core.
    salvage : at Ctrl-C, interrupt the work in progress too and yield what it returns before
        KeyboardInterrupt is raised; otherwise it is given up.
    """
    crew = _Crew(work)
    threads = ThreadPoolExecutor(max(1, min(workers or cores(), len(jobs))))
    waiting = {threads.submit(crew.made, job): job for job in jobs}
    try:
        for future in as_completed(list(waiting)):
            yield waiting.pop(future), future.result()
    except KeyboardInterrupt:
        crew.stop.set()
        threads.shutdown(wait=False, cancel_futures=True)
        for process in crew.all if salvage else ():
            process.terminate()
        for future, job in waiting.items() if salvage else ():
            if not future.cancelled() and (result := future.result()) is not _GIVEN_UP:
                yield job, result
        raise
    finally:
        crew.stop.set()
        threads.shutdown(wait=False, cancel_futures=True)
        for process in crew.all:
            _end(process)


@final
class _Crew:
    """Processes that each do one job at a time; `all` of them, also those that have died."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        self.stop, self.all = Event(), list[Process]()
        self._work, self._idle = work, SimpleQueue[Process]()

    def made(self, job: Any) -> Any:
        """Return what an idle process, or a new one, returns, None if it dies of the job twice."""
        for _ in range(_TRIES):
            if self.stop.is_set():
                break
            try:
                process = self._idle.get_nowait()
            except Empty:
                self.all.append(process := _started())
            if self.stop.is_set():  # since then, when all others were ended
                _end(process)
                break
            try:
                pickle.dump((self._work, job), process.stdin)  # type: ignore[arg-type]
                process.stdin.flush()  # type: ignore[union-attr]
                result = pickle.load(process.stdout)  # type: ignore[arg-type]
            except (EOFError, OSError, pickle.UnpicklingError):
                _end(process)
                continue
            self._idle.put(process)
            return result
        return _GIVEN_UP if self.stop.is_set() else None


def _end(process: Process) -> None:
    """Kill a process, which may have ended; any thread may."""
    with suppress(BrokenPipeError, ValueError), process:
        process.kill()


def _started() -> Process:
    path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
    settings = {**os.environ, "PYTHONPATH": path, "TASK_HIERARCHY_WORKER": "1"}
    return subprocess.Popen([sys.executable, "-c", _SERVE], stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, env=settings,
                            start_new_session=True)  # Ctrl-C of a terminal reaches the caller only


def serve() -> None:
    """Answer the jobs on standard input until it ends; what work prints goes to standard error."""
    jobs, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")  # exit() closes stdin
    os.dup2(2, 1)
    while True:
        try:
            work, job = pickle.load(jobs)
        except EOFError:
            return
        signal.signal(signal.SIGTERM, _interrupt_once)
        result = work(job)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        try:
            pickle.dump(result, answers)
            answers.flush()
        except BrokenPipeError:
            os._exit(1)  # whoever asked was killed


def _interrupt_once(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt
