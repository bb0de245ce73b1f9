"""Log of every tick of a loop."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array

PERCENTILES = {"median": 50.0, "p95": 95.0, "p99.9": 99.9, "max": 100.0}


class Log:
    """Times and commands of each tick that ran; memory is allocated before the loop starts.

    tick (K,) is the planned number, which jumps where ticks were skipped; late (K,) [s] the delay
    of the start after its planned time; duration (K,) [s] the time until the command was sent;
    command (K, n) if recorded. `due` is the number of planned ticks up to the last that ran, or all
    where the loop ran to its end. `ended` says why the loop ended, `notes` which settings could not
    be applied.
    """

    def __init__(self, period: float, ticks: int, width: int = 0) -> None:
        self.period, self.planned, self.count, self.due = period, ticks, 0, 0
        self.ended, self.notes = "not begun", list[str]()
        self._tick = np.full(ticks, -1, dtype=np.int64)
        self._times = np.full((ticks, 2), np.nan)
        self._command = np.full((ticks, width), np.nan)

    def write(self, tick: int, late: float, duration: float, command: Any) -> None:
        """Record one tick."""
        k = self.count
        self._tick[k], self._times[k] = tick, (late, duration)
        if self._command.shape[1]:
            self._command[k] = command
        self.count, self.due = k + 1, tick + 1

    @property
    def tick(self) -> NDArray[np.int64]:
        """Planned number of each tick: (K,)."""
        return self._tick[:self.count]

    @property
    def late(self) -> Array:
        """Delay of the start of each tick: (K,) [s]."""
        return self._times[:self.count, 0]

    @property
    def duration(self) -> Array:
        """Duration of each tick: (K,) [s]."""
        return self._times[:self.count, 1]

    @property
    def command(self) -> Array:
        """Command of each tick: (K, n)."""
        return self._command[:self.count]

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
        return {"tick": self.tick, "late": self.late, "duration": self.duration,
                "command": self.command}

    def __str__(self) -> str:
        rows = [f"{name:9}" + "".join(f"{label:>9} {1e6 * value:8.1f} us"
                                      for label, value in row.items())
                for name, row in self.summary().items()]
        head = (f"{self.count} ticks of {1e3 * self.period:g} ms, {self.overruns} overruns, "
                f"{self.skipped} skipped; {self.ended}")
        return "\n".join([head, *rows, *self.notes])
