"""The loop itself: planned times, overruns, priority, and how it ends."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

import numpy as np

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.loop.log import Log
from hierarchy.loop.watchdog import Once, Watchdog

Overrun = Literal["skip", "catch up", "stop"]
OVERRUNS = ("skip", "catch up", "stop")


class Loop:
    """Runs a function at a fixed period, by planned times that do not drift.

    period : [s].
    overrun : what follows a tick that ends after the next was to begin. "skip" goes on with the
        next planned time to come; "catch up" runs missed ticks at once, the last `behind` of them,
        and skips the others; "stop" ends the loop.
    watchdog : [s] without the end of a tick after which `safe_stop` is called from another thread,
        and the loop ends; None for none.
    spin : [s] before a planned time from which the clock is watched instead of sleeping: more
        punctual, at the price of a core.
    priority : of SCHED_FIFO (Linux), None to leave it. Where it is not permitted the log says so.
    pause_gc : whether Python's garbage collector rests while the loop runs.
    clock, sleep : others for tests.

    `log` is that of the last run, also where it ended in an exception.
    """

    def __init__(self, period: float, *, overrun: Overrun = "skip", behind: int = 10,
                 watchdog: float | None = None, spin: float = 0.0, priority: int | None = None,
                 pause_gc: bool = True, clock: Callable[[], float] = time.monotonic,
                 sleep: Callable[[float], object] = time.sleep) -> None:
        if overrun not in OVERRUNS:
            raise UnknownNameError("overrun policy", overrun, OVERRUNS)
        _require(0.0 < period < np.inf, f"period {period} s must be positive and finite")
        _require(behind >= 1, f"behind = {behind}, expected 1 or more ticks")
        _require(0.0 <= spin < np.inf, f"spin {spin} s must not be negative")
        _require(watchdog is None or watchdog > period,
                 f"watchdog {watchdog} s must be longer than the period {period} s")
        self.period, self.overrun, self.behind = period, overrun, behind
        self.watchdog, self.spin, self.priority, self.pause_gc = watchdog, spin, priority, pause_gc
        self.clock, self.sleep = clock, sleep
        self.log = Log(period, 0)

    def run(self, step: Callable[[float], Any], safe_stop: Callable[[], object], duration: float,
            send: Callable[[Any], object] | None = None, record: int = 0) -> Log:
        """Call `send(step(t))` every period for `duration` [s], then `safe_stop()`.

        t [s] is the planned time of the tick since the loop began. Without `send`, `step` sends by
        itself. `record` is the size of the commands to keep in the log.

        However the loop ends, `safe_stop` is called: once; a second time if the watchdog called it
        and a command may have been sent since. An exception of any of the functions, and Ctrl-C,
        goes on to the caller after that.
        """
        _require(0.0 < duration < np.inf, f"duration {duration} s must be positive and finite")
        ticks = max(1, round(duration / self.period))
        self.log = log = Log(self.period, ticks, record)
        stop = Once(safe_stop)
        dog = Watchdog(self.watchdog or np.inf, stop, self.clock)
        with _quiet(self.pause_gc, self.priority, log.notes), dog if self.watchdog else _nothing():
            try:
                log.ended = self._run(step, safe_stop, send, ticks, dog)
            except BaseException as error:
                log.ended = f"{type(error).__name__} after {log.count} ticks: {error}"
                _stop_again(dog, safe_stop)
                raise
            finally:
                stop()
                if dog.error is not None:
                    log.notes.append(f"safe_stop failed in the watchdog: {dog.error!r}")
        if dog.error is not None:
            raise dog.error
        return log

    def _run(self, step: Callable[[float], Any], safe_stop: Callable[[], object],
             send: Callable[[Any], object] | None, ticks: int, dog: Watchdog) -> str:
        """Go through the ticks; return why it ended."""
        start, tick = self.clock(), 0
        while tick < ticks:
            planned = start + tick * self.period
            self._wait(planned)
            begin = self.clock()
            command = step(tick * self.period)
            if send is not None:
                if dog.fired:
                    return f"the watchdog fired in tick {tick}"
                send(command)
            end = self.clock()
            self.log.write(tick, begin - planned, end - begin, command)
            if dog.fired:
                _stop_again(dog, safe_stop)
                return f"the watchdog fired in tick {tick}"
            dog.feed()
            late = end - (planned + self.period)
            if late > 0.0 and self.overrun == "stop":
                return f"tick {tick} ended {1e3 * late:.3g} ms too late"
            tick = self._next(tick, late)
        return "all ticks were run"

    def _next(self, tick: int, late: float) -> int:
        """Return the tick that follows one that ended `late` [s] after it was to begin."""
        if late <= 0.0:
            return tick + 1
        missed = tick + 1 + int(late / self.period)  # the last whose time has passed
        return missed + 1 if self.overrun == "skip" else max(tick + 1, missed + 1 - self.behind)

    def _wait(self, until: float) -> None:
        while (left := until - self.clock()) > self.spin:
            self.sleep(left - self.spin)
        while self.clock() < until:
            pass


def _stop_again(dog: Watchdog, safe_stop: Callable[[], object]) -> None:
    """Stop what a command may have set going after the watchdog stopped it."""
    if dog.fired:
        dog.settle()
        safe_stop()


@contextmanager
def _quiet(pause_gc: bool, priority: int | None, notes: list[str]) -> Iterator[None]:
    """Keep the garbage collector and other processes from the loop, as far as allowed."""
    before = _raise_priority(priority, notes)
    collecting = pause_gc and gc.isenabled()
    if collecting:
        gc.collect()
        gc.freeze()
        gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
            gc.unfreeze()
        if before is not None:
            os.sched_setscheduler(0, *before)


def _raise_priority(priority: int | None, notes: list[str]) -> tuple[int, Any] | None:
    """Take SCHED_FIFO and return what was before, or None with a note why not."""
    if priority is None:
        return None
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError, ValueError) as error:
        notes.append(f"SCHED_FIFO at priority {priority} was not given: {error}")
        return None
    return before


@contextmanager
def _nothing() -> Iterator[None]:
    yield


def _require(condition: bool, text: str) -> None:
    if not condition:
        raise HierarchyError(f"loop: {text}")
