"""What a program that waits for kernels says on stderr."""

import os
import sys
from contextlib import suppress
from functools import cache
from time import monotonic
from typing import Any

from hierarchy.jit.inside import event

_EVERY = 5.0  # [s] between two words on a compilation that goes on


class _Compilations(event.Listener):  # type: ignore[misc]
    """Says that kernels are being compiled, and how many are; numba compiles on a cache miss."""

    def __init__(self) -> None:
        self._count, self._begun, self._said = 0, 0.0, 0.0

    def on_start(self, event: Any) -> None:
        if self._begun == 0.0 and _is_own(event):
            self._begun = self._said = monotonic()
            say("compiling kernels for this machine, once ...")

    def on_end(self, event: Any) -> None:
        self._count += _is_own(event)
        now = monotonic()
        if self._begun > 0.0 and now - self._said > _EVERY:
            self._said = now
            say(f"{self._count} kernels in {now - self._begun:.0f} s ...")


def _is_own(event: Any) -> bool:
    module: str = event.data["dispatcher"].py_func.__module__
    return module.partition(".")[0] in ("hierarchy", "solvers", "scenarios")


def say(what: str) -> None:
    """Say one line on stderr, if somebody listens."""
    with suppress(AttributeError, OSError, ValueError):  # none, a full disk, closed
        sys.stderr.write(f"task-hierarchy: {what}\n")
        sys.stderr.flush()


@cache
def announce_compilation() -> None:
    """Let the compilation of kernels be announced on stderr: it makes a program wait."""
    if "TASK_HIERARCHY_WORKER" not in os.environ:  # what started a worker has said it
        event.register("numba:compile", _Compilations())
