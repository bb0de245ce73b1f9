"""A thread that stops a robot when its control loop hangs."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Lock, Thread


class Watchdog:
    """Context manager that calls `stop` once, in a thread, if not fed for `limit` [s].

    The thread belongs to this process: it cannot act while compiled code holds the interpreter.
    """

    def __init__(self, limit: float, stop: Callable[[], object],
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.limit, self.fired = limit, False
        self.error: BaseException | None = None
        self._stop, self._clock, self._over, self._stopped = stop, clock, Event(), Event()
        self._fed = clock()
        self._thread = Thread(target=self._watch, name="watchdog", daemon=True)

    def feed(self) -> None:
        """Reset the timer."""
        self._fed = self._clock()

    def check(self) -> bool:
        """Call `stop` if the limit has passed; return whether it has been called."""
        if not self.fired and self._clock() - self._fed > self.limit:
            self.fired = True
            try:
                self._stop()
            except BaseException as error:
                self.error = error
            self._stopped.set()
        return self.fired

    def settle(self) -> None:
        """Wait until `stop` has returned, for at most the limit."""
        self._stopped.wait(self.limit)

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


class Once:
    """A function that runs only the first time it is called, from any thread."""

    def __init__(self, function: Callable[[], object]) -> None:
        self._function, self._lock, self._done = function, Lock(), False

    def __call__(self) -> None:
        """Call the function unless it has already been called."""
        with self._lock:
            first, self._done = not self._done, True
        if first:
            self._function()
