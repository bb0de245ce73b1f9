"""Packages that take turns of ticks, each in its own process, all on one core."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmark.packages import Entrant
from benchmark.process import EndedError, Field
from benchmark.report import Column, Row, text
from benchmark.timing import times_of
from hierarchy.problem import Array

TURN_LIMIT = 300.0  # [s]
TICK = (Column("tick\nmedian", "median_us"), Column("\np95", "p95_us"),
        Column("\np99.9", "p99.9_us"), Column("solve\nmedian", "solve_us"))
ABOUT = Column("version", "version", text), Column("priorities; inequality rows", "kind", text)

Log = dict[str, Array]
Ask = Callable[[tuple[Any, ...], float], Any]  # as `Process.ask`


def turns(ticks: int, warm_up: int, each: int, rehearsed: int) -> list[tuple[str, int, int]]:
    """Return the questions that make `ticks` ticks in turns of `each`.

    Before them are `warm_up` that do not count, nor do `rehearsed` at the start of each turn, which
    fill caches.
    """
    return [("turn", warm_up, warm_up)] + [
        ("turn", rehearsed + min(each, ticks - first), rehearsed)
        for first in range(0, ticks, each)]


def measure(entrants: Sequence[Entrant], questions: str, asked: Sequence[tuple[Any, ...]],
            judge: Callable[[Log, Ask], Row], seconds: float = np.inf
            ) -> tuple[list[Row], dict[str, str]]:
    """Let all entrants take turns; return a judged row for each, and why others are missing.

    questions : MODULE:CLASS of what is asked, `open` first. judge : makes a row of a log, and may
    ask for more. seconds : [s] of processor time after which an entrant has no more turns.
    """
    rows: list[Row] = []
    with Field(entrants, questions) as field:
        for label, replies in field.answers(asked, TURN_LIMIT, 1, patience=seconds).items():
            process, ends = field.running[label], [one for one in replies if "ended" in one]
            if ends:
                field.missing[label] = ends[0]["why"]
                continue
            own = [one for one in replies if "log" in one]
            try:
                rows.append({"entrant": label, **process.about, "kind": process.entrant.limits,
                             "why": own[-1]["why"], **judge(joined(own), process.ask)})
            except EndedError as end:
                field.missing[label] = str(end)
    return rows, field.missing


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
