"""An entrant in its own process, controlled by lines of text."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from threading import Timer
from typing import Any, final

from scenarios.bench.peers.entrants import Entrant
from scenarios.bench.peers.environments import MissingError, python_of

WORKER = "scenarios.bench.peers.worker"
START_LIMIT = 120.0  # [s] for imports, including compilation of kernels
TURN_LIMIT = 300.0   # [s]
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_HERE = Path(__file__).parent


def stage(folder: Path) -> Path:
    """Copy only this package to a folder from which other environments can import it."""
    target = folder / "scenarios" / "bench" / "peers"
    shutil.copytree(_HERE, target, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@final
class Process:
    """`scenarios.bench.peers.worker` for one entrant; MissingError where it cannot be had.

    about : what it says of itself. seconds : how long its turns took. `worker` is the module that
    the process runs.
    """

    def __init__(self, entrant: Entrant, scenes: Path, staged: Path, core: int,
                 worker: str = WORKER) -> None:
        self.entrant, self.seconds = entrant, 0.0
        self.result = scenes.parent / f"{entrant.label.replace(' ', '-')}.npz"
        self._log = scenes.parent / f"{entrant.label.replace(' ', '-')}.log"
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                _command(entrant, scenes, self.result, str(core), worker), stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=log, text=True, cwd=staged,
                env=_environment(entrant))
        self.about: dict[str, str] = self._answer(START_LIMIT)

    def turn(self, ticks: int, rehearsed: int) -> None:
        """Run this number of ticks, the first `rehearsed` of which do not count."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps([ticks, rehearsed]) + "\n")
            self._process.stdin.flush()
        except OSError as error:
            raise MissingError(self._ended()) from error
        self.seconds += self._answer(TURN_LIMIT)

    def finish(self) -> Path:
        """Run the step and write the results; return the file."""
        try:
            self._process.communicate(timeout=TURN_LIMIT)
        except subprocess.TimeoutExpired as error:
            self.stop()
            raise MissingError(f"no answer within {TURN_LIMIT:g} s") from error
        if self._process.returncode != 0 or not self.result.is_file():
            raise MissingError(self._ended())
        return self.result

    def stop(self) -> None:
        """Kill the process."""
        self._process.kill()
        self._process.communicate()

    def _answer(self, limit: float) -> Any:
        assert self._process.stdout is not None
        timer = Timer(limit, self._process.kill)
        timer.start()
        try:
            line = self._process.stdout.readline()
        finally:
            timer.cancel()
        if not line:
            raise MissingError(self._ended())
        return json.loads(line)

    def _ended(self) -> str:
        code = self._process.wait()
        said = self._log.read_text(errors="replace").strip().splitlines()
        return f"ended with code {code}" + (f": {said[-1]}" if said else "")


def after_nan(entrant: Entrant, scenes: Path, staged: Path) -> str:
    """Return the reaction to a NaN, tested in a separate process since some packages crash."""
    try:
        done = subprocess.run(_command(entrant, scenes, Path(os.devnull), "nan"), text=True,
                              capture_output=True, cwd=staged, env=_environment(entrant),
                              timeout=START_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return f"hangs, {START_LIMIT:g} s at least"
    if done.returncode != 0:
        return f"crashes, code {done.returncode}"
    return str(json.loads(done.stdout))


def _command(entrant: Entrant, scenes: Path, result: Path, core: str,
             worker: str = WORKER) -> list[str]:
    return [python_of(entrant.package), "-m", worker, entrant.adapter,
            json.dumps(dict(entrant.options)), str(scenes), str(result), core]


def _environment(entrant: Entrant) -> dict[str, str]:
    """One thread each; other environments see only the staged package."""
    one = {**os.environ, **dict.fromkeys(_THREADS, "1")}
    if python_of(entrant.package) != sys.executable:
        one.pop("PYTHONPATH", None)
    return one
