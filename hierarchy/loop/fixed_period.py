"""The loop: planned times, overruns, priority, and how it ends."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any, Literal

import numpy as np

from hierarchy.errors import HierarchyError, ReadingError, UnknownNameError, brief, number
from hierarchy.loop.log import Log
from hierarchy.loop.watchdog import Once, Watchdog

Overrun = Literal["skip", "catch up", "stop"]
OVERRUNS = ("skip", "catch up", "stop")


class Loop:
    """Runs a function at a fixed period, at planned times that do not drift.

    period : [s].
    overrun : what to do if a tick ends after the planned start of the next. "skip" continues at the
        next planned time; "catch up" runs the last `behind` missed ticks at once and skips the
        others; "stop" ends the loop.
    watchdog : time [s] without the end of a tick after which `safe_stop` is called from another
        thread and the loop ends; None for no watchdog.
    spin : time [s] before a planned time during which the loop polls the clock instead of sleeping:
        more accurate, but it occupies a core.
    priority : of SCHED_FIFO (Linux), None to leave it. If it is not permitted, the log says so.
    pause_gc : whether Python's garbage collector is off while the loop runs.
    clock, sleep : replacements for tests. `log` is that of the last run, even after an exception.
    """

    def __init__(self, period: float, *, overrun: Overrun = "skip", behind: int = 10,
                 watchdog: float | None = None, spin: float = 0.0, priority: int | None = None,
                 pause_gc: bool = True, clock: Callable[[], float] = time.monotonic,
                 sleep: Callable[[float], object] = time.sleep) -> None:
        if overrun not in OVERRUNS:
            raise UnknownNameError("overrun policy", overrun, OVERRUNS)
        for name, value in (("period", period), ("behind", behind), ("spin", spin),
                            ("watchdog", period if watchdog is None else watchdog)):
            number(f"loop: {name}", value)
        _require(period > 0.0, f"period {period} s must be positive")
        _require(behind >= 1, f"behind = {behind}, expected 1 or more ticks")
        _require(spin >= 0.0, f"spin {spin} s must not be negative")
        _require(watchdog is None or watchdog > period,
                 f"watchdog {watchdog} s must be longer than the period {period} s")
        self.period, self.overrun, self.behind = period, overrun, behind
        self.watchdog, self.spin, self.priority, self.pause_gc = watchdog, spin, priority, pause_gc
        self.clock, self.sleep = clock, sleep
        self.log = Log(period, 0)

    def run(self, step: Callable[[float], Any], safe_stop: Callable[[], object], duration: float,
            send: Callable[[Any], object] | None = None, record: int = 0) -> Log:
        """Call `send(step(t))` every period for `duration` [s], then `safe_stop()`.

        t [s] is the planned time of the tick since the start of the loop. `step` returns the
        command, or what has it with a status: a resolution or a step of `solve_ik`. Without `send`,
        `step` sends the command itself. `record` is the size of the commands to keep in the log.

        A tick without a command to send ends the loop, and `log.ended` says why: a status that is
        not SOLVED, a command that is None or not finite, a reading that is not finite (a stack's
        ReadingError).

        `safe_stop` is called however the loop ends: once, and a second time if the watchdog called
        it and a command may have been sent since. An exception in any of the functions, or Ctrl-C,
        then propagates to the caller.
        """
        _require(number("loop: duration", duration) > 0.0,
                 f"duration {duration} s must be positive")
        for name, function in (("step", step), ("safe_stop", safe_stop), ("send", send)):
            _require(callable(function) or (name == "send" and function is None),
                     f"{name}: expected a function, got {brief(function)}")
        ticks = max(1, round(duration / self.period))
        self.log = log = Log(self.period, ticks, record)
        stop = Once(safe_stop)
        dog = Watchdog(self.watchdog or np.inf, stop, self.clock)
        watched = dog if self.watchdog else nullcontext()
        with _quiet(self.pause_gc, self.priority, log.notes), watched:
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
        """Run the ticks; return why the loop ended."""
        start, tick = self.clock(), 0
        while tick < ticks:
            planned = start + tick * self.period
            self._wait(planned)
            started = self.clock()
            command, why = _command(step, tick * self.period, send is not None)
            if why:
                return f"tick {tick}: {why}"
            if send is not None:
                if dog.fired:
                    return f"the watchdog fired in tick {tick}"
                send(command)
            end = self.clock()
            self.log.write(tick, started - planned, end - started, command)
            if dog.fired:
                _stop_again(dog, safe_stop)
                return f"the watchdog fired in tick {tick}"
            dog.feed()
            late = end - (planned + self.period)
            if late > 0.0 and self.overrun == "stop":
                return f"tick {tick} ended {1e3 * late:.3g} ms too late"
            tick = self._next(tick, late)
        self.log.due = ticks
        return "all other ticks were run" if self.log.skipped else "all ticks were run"

    def _next(self, tick: int, late: float) -> int:
        """Return the tick to run after one that ended `late` [s] after the start of the next."""
        if late <= 0.0:
            return tick + 1
        missed = tick + 1 + int(late / self.period)  # the last whose planned time has passed
        return missed + 1 if self.overrun == "skip" else max(tick + 1, missed + 1 - self.behind)

    def _wait(self, until: float) -> None:
        while (left := until - self.clock()) > self.spin:
            self.sleep(left - self.spin)
        while self.clock() < until:
            pass


def _command(step: Callable[[float], Any], t: float, needed: bool) -> tuple[Any, str]:
    """Return the command of a step, and why there is none to send, or ""."""
    try:
        found = step(t)
    except ReadingError as error:
        return None, str(error)
    status = getattr(found, "status", None)
    if status is not None:
        if int(status) != 0:
            return None, str(status)
        found = getattr(found, "x", getattr(found, "v", None))
    if found is None:
        return None, "the step returned no command" if needed else ""
    try:
        finite = bool(np.isfinite(np.asarray(found, dtype=float)).all())
    except (TypeError, ValueError):  # a message of the robot's own
        finite = True
    return found, "" if finite else f"the command is not finite: {brief(found)}"


def _stop_again(dog: Watchdog, safe_stop: Callable[[], object]) -> None:
    """Stop motion that a command may have started after the watchdog stopped the robot."""
    if dog.fired:
        dog.settle()
        safe_stop()


@contextmanager
def _quiet(pause_gc: bool, priority: int | None, notes: list[str]) -> Iterator[None]:
    """Turn the garbage collector off and raise the priority, as far as permitted."""
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
    """Set SCHED_FIFO and return the previous setting, or None with a note on why not."""
    if priority is None:
        return None
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError, ValueError) as error:
        notes.append(f"SCHED_FIFO at priority {priority} was not given: {error}")
        return None
    return before


def _require(condition: bool, text: str) -> None:
    if not condition:
        raise HierarchyError(f"loop: {text}")
