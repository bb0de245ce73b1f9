"""Ask one entrant in its own process. Needs only numpy and the entrant.

    python -m benchmark.worker QUESTIONS ADAPTER OPTIONS PACKAGE CORE

QUESTIONS is MODULE:CLASS of what asks: `QUESTIONS(ADAPTER, OPTIONS)` makes it. The first line of
the answers has the version, its own or that of PACKAGE, and each line of stdin, [METHOD,
ARGUMENTS...] in JSON, is a call whose result is the next. ADAPTER is MODULE:NAME or FILE.py:NAME of
a class or function, OPTIONS its arguments in JSON.
"""

import json
import os
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from runpy import run_path
from time import get_clock_info, perf_counter_ns, process_time_ns
from types import SimpleNamespace
from typing import Any, NamedTuple

_FINE = get_clock_info("process_time").resolution < 1e-6  # coarse on some systems


class Repeats(NamedTuple):
    """How often a call is timed: `least` to `most` times, no more once they took `turn` [ns].

    Of calls that are slow fewer than `least` are enough, once they took `enough` [ns].
    """

    least: int = 3
    most: int = 20
    turn: int = 2_000_000
    enough: int = 5_000_000


def main() -> None:
    """Run from the command line; see the docstring of the module."""
    questions, adapter, options, package, core = sys.argv[1:]
    pipe = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # output of a package must not mix with answers
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    asked = load(questions)(load(adapter), json.loads(options))
    own = getattr(asked, "version", None)
    print(json.dumps({"version": own() if own else version(package)}), file=pipe, flush=True)
    for line in sys.stdin:
        method, *arguments = json.loads(line)
        answer = getattr(asked, method)(*arguments)
        plain = json.dumps(answer, default=lambda value: value.tolist())  # of numpy
        print(plain, file=pipe, flush=True)


def load(place: str) -> Any:
    """Return what MODULE:NAME or FILE.py:NAME names."""
    module, _, name = place.rpartition(":")
    own = SimpleNamespace(**run_path(module)) if module.endswith(".py") else import_module(module)
    return getattr(own, name)


def timed(call: Callable[[], Any], repeats: Repeats = Repeats()  # noqa: B008
          ) -> tuple[list[int], Any]:
    """Return times of calls [ns], as many as `repeats` says, and what the last one returned.

    Each is the time that passed, or the processor time of this process if that is less, which is so
    where other work interrupted it.
    """
    times, found = list[int](), None
    begin = perf_counter_ns()
    while not times or (len(times) < repeats.most and perf_counter_ns() - begin < (
            repeats.enough if len(times) < repeats.least else repeats.turn)):
        busy = process_time_ns()
        start = perf_counter_ns()
        found = call()
        passed = perf_counter_ns() - start
        spent = process_time_ns() - busy if _FINE else 0  # 0: the system has not counted yet
        times.append(min(passed, spent or passed))
    return times, found


def reason(error: Exception) -> str:
    """Return the kind of an exception and its first line."""
    return f"{type(error).__name__}: {error}".partition("\n")[0]


if __name__ == "__main__":
    main()
