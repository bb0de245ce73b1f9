"""The one runner: entrants in a process each, which take turns, and start again if they end."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from contextlib import ExitStack, closing, suppress
from itertools import product
from math import inf
from pathlib import Path
from select import select
from time import monotonic
from typing import Any, final

from benchmark.packages import Entrant, MissingError, python_of

START_LIMIT = 180.0  # [s] for imports, including compilation of kernels
CRASHED, HUNG, LEFT_OUT, SLOW = "crashed", "time limit", "left out after crashes", "too slow"
_ROOT = Path(__file__).parents[1]  # from which every environment can import the benchmark
_WAITING = 10.0  # times the limit that an answer may take where other work has the processor
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class EndedError(MissingError):
    """A process that ended, or was ended at its time limit, without an answer."""

    def __init__(self, kind: str, why: str) -> None:
        super().__init__(why)
        self.kind = kind


@final
class Process:
    """`benchmark.worker` for one entrant; MissingError where it cannot be had.

    questions : MODULE:CLASS of what asks it. about : what it says of itself.
    """

    def __init__(self, entrant: Entrant, questions: str) -> None:
        self.entrant, self.questions, self._more = entrant, questions, START_LIMIT
        self._begin()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._log.close()

    def ask(self, question: tuple[Any, ...], limit: float) -> Any:
        """Return the answer to (METHOD, ARGUMENTS...); EndedError if none comes in `limit` [s].

        The limit is of processor time, so that other work on the machine ends nobody. The first
        question to a process may load and compile, and has more time; the next one after an end
        starts a new process.
        """
        if self._log.closed:
            self._begin()
            self._more = 2.0 * limit
        more, self._more = self._more, 0.0
        with suppress(OSError):  # it has ended; why, the log says
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        return self._next(limit + more, _WAITING * limit + more)

    def _begin(self) -> None:
        entrant = self.entrant
        python = entrant.python or python_of(entrant.package)
        own = dict(os.environ, **dict.fromkeys(_THREADS, "1"))
        if python != sys.executable:
            own.pop("PYTHONPATH", None)
        core = str(max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0)
        self._log = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        try:
            self._process: Any = subprocess.Popen(
                [python, "-m", "benchmark.worker", self.questions, entrant.adapter,
                 json.dumps(dict(entrant.options)), entrant.package.name, core],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, text=True,
                cwd=_ROOT, env=own)
        except OSError as error:
            self._log.close()
            raise MissingError(f"{python}: {error.strerror}") from error
        self.about: dict[str, Any] = self._next(START_LIMIT, START_LIMIT)

    def _next(self, limit: float, wait: float) -> Any:
        """Return the next line; EndedError, with the last words, if none comes in time.

        That is before the process has worked for `limit` [s] and before `wait` [s] have passed. A
        timer in the process itself would make its clock of processor time a coarse one.
        """
        process, left, kind = self._process, limit, CRASHED
        begin, until = _busy(process.pid), monotonic() + wait
        while kind == CRASHED and not select([process.stdout], [], [], left)[0]:
            left = min(begin + limit - _busy(process.pid), until - monotonic())
            if left <= 0.0:
                kind = HUNG
                process.kill()
        line = process.stdout.readline()
        if line.endswith("\n"):
            return json.loads(line)
        code = process.wait()
        self._log.seek(0)
        words = self._log.read().strip().splitlines()[-1:]
        self.close()
        raise EndedError(kind, ": ".join([f"ended with code {code}", *words]))


def _busy(process: int) -> float:
    """Return the processor time of a process [s]; the time that has passed if it is not known."""
    file = Path(f"/proc/{process}/stat")
    try:
        ticks = file.read_text().rpartition(")")[2].split()[11:13]
    except OSError:
        return monotonic()
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


@final
class Field(ExitStack):
    """Entrants in a process each, which take turns with every question.

    questions : MODULE:CLASS of what asks them. missing : why others are not asked, by label.
    """

    def __init__(self, entrants: Sequence[Entrant], questions: str) -> None:
        super().__init__()
        self.running: dict[str, Process] = {}
        self.missing: dict[str, str] = {}
        for one in entrants:
            try:
                self.running[one.label] = self.enter_context(closing(Process(one, questions)))
            except MissingError as error:
                self.missing[one.label] = str(error)

    def answers(self, questions: Iterable[tuple[Any, ...]], limit: float, most: int,
                labels: Iterable[str] | None = None, patience: float = inf
                ) -> dict[str, list[dict[str, Any]]]:
        """Return the answers to questions, or how and why a process ended without one.

        An entrant whose process has ended `most` times is not asked the rest, nor is one whose
        answers took `patience` [s] of processor time together.
        """
        found: dict[str, list[dict[str, Any]]] = {
            label: [] for label in (self.running if labels is None else labels)}
        ends, spent = dict.fromkeys(found, 0), dict.fromkeys(found, 0.0)
        for question, (label, answers) in product(questions, found.items()):
            if ends[label] >= most:
                answers.append({"ended": LEFT_OUT})
                continue
            if spent[label] >= patience:
                answers.append({"refused": SLOW})
                continue
            try:
                answers.append(self.running[label].ask(question, limit) or {})
                spent[label] += answers[-1].get("busy_s", 0.0)
            except EndedError as end:
                ends[label] += 1
                spent[label] += limit if end.kind == HUNG else 0.0
                answers.append({"ended": end.kind, "why": str(end)})
        return found
