"""Packages that take turns of ticks, each in its own process, all on one core."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from benchmark.packages import Entrant, MissingError
from benchmark.process import START_LIMIT, Process, staged
from benchmark.store import Row
from benchmark.timing import times_of
from hierarchy.problem import Array

TURN_LIMIT = 300.0  # [s]

Log = dict[str, Array]


class Turns(NamedTuple):
    """Numbers of ticks: before the first turn, of a turn, and at its start for cold caches.

    seconds : [s] of turns after which an entrant has no more; None for all `ticks`.
    """

    ticks: int
    warm_up: int
    each: int
    rehearsed: int
    seconds: float | None = None

    def parts(self) -> list[tuple[int, int]]:
        """Return ticks of each turn, and how many of them do not count."""
        return [(self.warm_up, self.warm_up)] + [
            (self.rehearsed + min(self.each, self.ticks - first), self.rehearsed)
            for first in range(0, self.ticks, self.each)]


def measure(entrants: Sequence[Entrant], questions: str, scene: tuple[Any, ...], turns: Turns,
            judge: Callable[[Log, str, Process], Row]) -> tuple[list[Row], dict[str, str]]:
    """Let all entrants take turns; return a judged row for each, and why others are missing.

    questions : MODULE:CLASS, of `Ticks`. scene : arguments of its `open`. judge : makes of a log,
    the reason of its first failure, and the process, in which it may ask for more, a row.
    """
    missing: dict[str, str] = {}
    rows: list[Row] = []
    processes: dict[str, Process] = {}
    logs: dict[str, list[Row]] = {}
    with staged() as folder:
        try:
            for one in entrants:
                with _noted(missing, one.label):
                    processes[one.label] = process = Process(one, questions, folder)
                    process.ask(("open", *scene), START_LIMIT)
            for part in turns.parts():
                for label in [label for label in processes if label not in missing]:
                    own = logs.setdefault(label, [])
                    late = len(own) > 1 and turns.seconds is not None and (
                        sum(reply["seconds"] for reply in own) > turns.seconds)
                    if not late:
                        with _noted(missing, label):
                            own.append(processes[label].ask(("turn", *part), TURN_LIMIT))
            for label, process in processes.items():
                if label not in missing:
                    with _noted(missing, label):
                        rows.append({"entrant": label, **process.about, **judge(
                            joined(logs[label]), logs[label][-1]["why"], process)})
        finally:
            for process in processes.values():
                process.stop()
    return rows, missing


@contextmanager
def _noted(missing: dict[str, str], label: str) -> Iterator[None]:
    """Record why an entrant is missing, and continue."""
    try:
        yield
    except MissingError as error:
        missing[label] = str(error)


def joined(replies: Sequence[Row]) -> Log:
    """Return the logs of turns as one, each signal an array."""
    logs = [reply["log"] for reply in replies if reply["log"]]
    return {key: np.concatenate([np.array(log[key]) for log in logs]) for key in logs[0]}


def times(log: Log) -> Row:
    """Return ticks that count, those without an answer, and times [us] of a tick and a solve."""
    counted = np.logical_and(log["clocked"], np.logical_not(log["failed"]))
    again = log["resolve"][counted]
    return {"ticks": int(log["clocked"].sum()), "failed": int(log["failed"].sum()),
            **times_of(log["time"][counted]),
            "solve_us": float(np.median(again)) / 1e3 if again.any() else np.nan}

