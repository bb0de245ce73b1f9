"""The part of a worker's process that is the same for every scene. Needs only Python."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from time import perf_counter, perf_counter_ns
from typing import Any

Answer = Callable[[Any], None]


def answers() -> Answer:
    """Return a function that answers a line of JSON; all else that is printed goes to stderr.

    Call it before a package is imported: its output must not mix with answers.
    """
    pipe = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(value: Any) -> None:
        print(json.dumps(value), file=pipe, flush=True)

    return answer


def pin(core: str) -> None:
    """Run on one core from now on, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})


def take_turns(go: Callable[[int, int], None], answer: Answer) -> None:
    """Call go(ticks, rehearsed) for each line of stdin; answer the seconds that it took."""
    for line in sys.stdin:
        begin = perf_counter()
        go(*json.loads(line))
        answer(perf_counter() - begin)


def nanoseconds(call: Callable[[], object] | None) -> int:
    """Return how long a call takes; 0 if there is none."""
    if call is None:
        return 0
    begin = perf_counter_ns()
    call()
    return perf_counter_ns() - begin


def reason(error: Exception) -> str:
    """Return the kind of an exception and its first line."""
    return f"{type(error).__name__}: {error}".partition("\n")[0]
