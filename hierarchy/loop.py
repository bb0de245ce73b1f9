"""A control loop for your hardware: fixed period, overruns, watchdog, and a log of every tick.

No robot interface is assumed: the user provides functions that compute the command, send it and
stop safely. This is Python on an ordinary operating system: the log shows how well the period is
kept, and the robot's own controller must be able to stop it.
"""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from threading import Event, Lock, Thread
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import (
    HierarchyError,
    ReadingError,
    brief,
    check_name,
    naming,
    number,
    positive,
    refuse,
    whole,
)
from hierarchy.problem import Array


class Watchdog:
    """Context manager that calls `stop` once, in a thread, if not fed for `limit` [s].

    The thread belongs to this process: it cannot act while compiled code holds the interpreter.
    `ended` is whether `stop` has come to its end.
    """

    def __init__(self, limit: float, stop: Callable[[], object],
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.limit, self.fired, self.ended = limit, False, False
        self.error: BaseException | None = None
        self._stop, self._clock, self._over, self._stopped = stop, clock, Event(), Event()
        self._begun, self._fed = Lock(), clock()  # a lock that who stops takes, and keeps
        self._thread = Thread(target=self._watch, name="watchdog", daemon=True)

    def stop(self) -> None:
        """Call `stop` unless it has already been called, from any thread."""
        if self._begun.acquire(blocking=False):
            self._stop()
            self.ended = True

    def feed(self) -> None:
        """Reset the timer."""
        self._fed = self._clock()

    def check(self) -> bool:
        """Call `stop` if the limit has passed; return whether it has been called."""
        if not self.fired and self._clock() - self._fed > self.limit:
            self.fired = True
            try:
                self.stop()
            except BaseException as error:
                self.error = error
            self._stopped.set()
        return self.fired

    def stop_again(self) -> None:
        """Stop motion that a command may have started after the watchdog stopped the robot.

        Before that, wait until it has, for at most the limit.
        """
        if self.fired:
            self._stopped.wait(self.limit)
            self._stop()

    def __enter__(self) -> Watchdog:
        self.feed()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join(self.limit)

    def _watch(self) -> None:
        while not self._over.wait(self.limit / 4) and not self.check():
            pass


PERCENTILES = {"median": 50.0, "p95": 95.0, "p99.9": 99.9, "max": 100.0}


def _of_ticks(kept: str) -> Any:
    """Return an array of a log as far as ticks ran."""
    return property(lambda log: getattr(log, kept)[:log.count])


class Log:
    """Times and commands of each tick that ran; memory is allocated before the loop starts.

    tick (K,) is the planned number, which jumps where ticks were skipped; late (K,) [s] the delay
    of the start after its planned time; duration (K,) [s] the time until the command was sent;
    command (K, n) if recorded. `due` is the number of planned ticks up to the last that ran, or all
    where the loop ran to its end. `ended` says why the loop ended, `notes` which settings could not
    be applied.
    """

    tick: NDArray[np.int64] = _of_ticks("_tick")
    late: Array = _of_ticks("_late")
    duration: Array = _of_ticks("_duration")
    command: Array = _of_ticks("_command")

    def __init__(self, period: float, ticks: int, width: int = 0) -> None:
        self.period, self.planned, self.count, self.due = period, ticks, 0, 0
        self.ended, self.notes = "not begun", list[str]()
        self._tick = np.full(ticks, -1, dtype=np.int64)
        self._late, self._duration = np.full((2, ticks), np.nan)
        self._command = np.full((ticks, width), np.nan)

    def write(self, tick: int, late: float, duration: float, command: Any) -> None:
        """Record one tick."""
        k = self.count
        self._tick[k], self._late[k], self._duration[k] = tick, late, duration
        if width := self._command.shape[1]:
            try:
                self._command[k] = command
            except (TypeError, ValueError) as error:
                raise HierarchyError(f"loop: record = {width}, and the command is "
                                     f"{brief(command)}") from error
        self.count, self.due = k + 1, tick + 1

    @property
    def overruns(self) -> int:
        """Number of ticks that ended after the planned start of the next one."""
        return int(np.count_nonzero(self.late + self.duration > self.period))

    @property
    def skipped(self) -> int:
        """Number of ticks that were due and did not run."""
        return self.due - self.count

    def summary(self) -> dict[str, dict[str, float]]:
        """Return median, p95, p99.9 and max of `late` and `duration` [s]; NaN without a tick."""
        return {name: {label: float(np.percentile(values, p)) if self.count else np.nan
                       for label, p in PERCENTILES.items()}
                for name, values in (("late", self.late), ("duration", self.duration))}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the log by name, for `numpy.savez`."""
        return {name: getattr(self, name) for name in ("tick", "late", "duration", "command")}

    def __str__(self) -> str:
        rows = [f"{name:9}" + "".join(f"{label:>9} {1e6 * value:8.1f} us"
                                      for label, value in row.items())
                for name, row in self.summary().items()]
        head = (f"{self.count} ticks of {1e3 * self.period:g} ms, {self.overruns} overruns, "
                f"{self.skipped} skipped; {self.ended}")
        return "\n".join([head, *rows, *self.notes])


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
        check_name("overrun policy", overrun, OVERRUNS)
        positive("loop: period [s]", period)
        whole("loop: behind", behind, 1)
        number("loop: spin [s]", spin, 0.0)
        if priority is not None:
            whole("loop: priority", priority)
        refuse(watchdog is not None and number("loop: watchdog [s]", watchdog) <= period,
               f"loop: watchdog {watchdog} s must be longer than the period {period} s")
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

        `safe_stop` is called however the loop ends: once, and a second time if Ctrl-C broke it off,
        or if the watchdog called it and a command may have been sent since. An exception in any of
        the functions, or Ctrl-C, then propagates to the caller.
        """
        positive("loop: duration [s]", duration)
        whole("loop: record", record)
        for name, function in (("step", step), ("safe_stop", safe_stop), ("send", send)):
            refuse(not (callable(function) or (name == "send" and function is None)),
                   f"loop: {name}: expected a function, got {brief(function)}")
        ticks = max(1, round(duration / self.period))
        with naming(f"loop: a log of {ticks:g} ticks", of=(MemoryError, ValueError)):
            self.log = log = Log(self.period, ticks, record)
        dog = Watchdog(self.watchdog or np.inf, safe_stop, self.clock)
        watched = dog if self.watchdog else nullcontext()
        with _quiet(self.pause_gc, self.priority, log.notes), watched:
            try:
                try:
                    log.ended = self._run(step, send, ticks, dog)
                except BaseException as error:
                    log.ended = f"{type(error).__name__} after {log.count} ticks: {error}"
                    dog.stop_again()
                    raise
                finally:
                    dog.stop()
                    if dog.error is not None:
                        log.notes.append(f"safe_stop failed in the watchdog: {dog.error!r}")
            except KeyboardInterrupt:
                if not dog.ended:  # the second of two, while the robot was being stopped
                    safe_stop()
                raise
        if dog.error is not None:
            raise dog.error
        return log

    def _run(self, step: Callable[[float], Any], send: Callable[[Any], object] | None, ticks: int,
             dog: Watchdog) -> str:
        """Run the ticks; return why the loop ended."""
        start, tick = self.clock(), 0
        while tick < ticks:
            planned = start + tick * self.period
            while (left := planned - self.clock()) > self.spin:
                self.sleep(left - self.spin)
            while (started := self.clock()) < planned:
                pass
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
                dog.stop_again()
                return f"the watchdog fired in tick {tick}"
            dog.feed()
            late = end - (planned + self.period)
            if late > 0.0 and self.overrun == "stop":
                return f"tick {tick} ended {1e3 * late:.3g} ms too late"
            missed = 1 + int(late / self.period) if late > 0.0 else 0  # their time has passed
            tick += 1 + (missed if self.overrun == "skip" else max(0, missed - self.behind))
        self.log.due = ticks
        return "all other ticks were run" if self.log.skipped else "all ticks were run"


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


_TURN, _PAUSED = Lock(), list[bool]()  # whether each loop that pauses the collector turned it off


@contextmanager
def _quiet(pause_gc: bool, priority: int | None, notes: list[str]) -> Iterator[None]:
    """Turn the garbage collector off and raise the priority, as far as permitted."""
    before = None
    if priority is not None:
        try:
            policy = os.sched_getscheduler(0), os.sched_getparam(0)
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
            before = policy
        except (OSError, AttributeError, ValueError) as error:
            notes.append(f"SCHED_FIFO at priority {priority} was not given: {error}")
    with _TURN:
        collecting = pause_gc and gc.isenabled()
        if pause_gc:
            _PAUSED.append(collecting)
            gc.disable()
    try:
        if collecting:
            gc.collect()
        yield
    finally:
        with _TURN:
            if pause_gc and _PAUSED.pop():  # the last loop of all threads to end
                gc.enable()
        if before is not None:
            os.sched_setscheduler(0, *before)
