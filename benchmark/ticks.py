"""Ticks of an adapter with their results and times, turn by turn. Needs only Python."""

from __future__ import annotations

from collections.abc import Callable
from importlib import metadata
from time import perf_counter, perf_counter_ns
from typing import Any

from benchmark.worker import reason


class Ticks:
    """Ticks one after the other; a scene says what one of them is.

    adapter : of one package; `why` is the reason of its first failure.
    """

    adapter: Any
    why = ""

    def about(self) -> dict[str, str]:
        """Return what the adapter says of its package."""
        kind = self.adapter
        return {"version": metadata.version(kind.package), "priorities": kind.priorities,
                "rows": getattr(kind, "rows", "")}

    def tick(self) -> dict[str, Any]:
        """Run one tick; return what is to be kept of it."""
        raise NotImplementedError

    def turn(self, ticks: int, rehearsed: int) -> dict[str, Any]:
        """Run this number of ticks, of which the first `rehearsed` do not count; return the log."""
        log: dict[str, list[Any]] = {}
        begin = perf_counter()
        for k in range(ticks):
            for key, value in {**self.tick(), "clocked": k >= rehearsed}.items():
                log.setdefault(key, []).append(value)
        return {"log": log, "why": self.why, "seconds": perf_counter() - begin}

    def asked(self, call: Callable[..., Any], *arguments: Any) -> tuple[Any, int]:
        """Return what a call returns, None if it raises, and how long it took [ns]."""
        begin = perf_counter_ns()
        try:
            found = call(*arguments)
        except Exception as error:
            self.why = self.why or reason(error)
            found = None
        return found, perf_counter_ns() - begin

    def again(self) -> int:
        """Return how long the solve of the last tick takes alone [ns]; 0 if it is not to be had."""
        call = getattr(self.adapter, "resolve", None)
        if call is None:
            return 0
        begin = perf_counter_ns()
        call()
        return perf_counter_ns() - begin
