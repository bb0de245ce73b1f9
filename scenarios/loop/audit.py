"""What is looked at after every tick, outside the times measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Hierarchy
from scenarios.config import Scenario
from scenarios.loop.controller import Controller
from scenarios.loop.fate import judged
from solvers import Resolver, Status, certify


class Audit(Protocol):
    """Numbers of every tick, kept as `signals` of the Recording."""

    @property
    def signals(self) -> Mapping[str, NDArray[Any]]:
        """Return the signals by name, a row a tick."""

    def look(self, tick: int, controller: Controller) -> None:
        """Look at the tick that the controller has just answered."""


@final
class Certified:
    """Whether `solvers.certify` accepts the answer."""

    def __init__(self, ticks: int) -> None:
        self.values = np.zeros(ticks, dtype=bool)
        self.signals = {"certified": self.values}

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the answer of a tick."""
        self.values[tick] = certify(controller.hierarchy, controller.resolution.x).certified


@final
class Strictness:
    """How far [m] what is below the position moves the end effector in a tick; strict: not at all.

    The tick is resolved once more without the levels below and without the null-space task. NaN
    where either is not solved.
    """

    def __init__(self, ticks: int, scenario: Scenario) -> None:
        self.values = np.full(ticks, np.nan)
        self.signals = {"moved_by_lower": self.values}
        period = scenario.control.period
        self._share = period if scenario.control.level == "velocity" else period**2 / 2
        self._memory: Any = None

    def look(self, tick: int, controller: Controller) -> None:
        """Resolve a tick without what is below the position, and compare."""
        h, resolver = controller.hierarchy, controller.resolver
        level = h.names.index("position")
        rows = slice(h.offsets[level], h.offsets[level + 1])
        alone = self._resolve(resolver, upper_levels(h, level + 1))
        if alone is not None and controller.resolution.status is Status.SOLVED:
            moved = h.A[rows] @ (controller.resolution.x - alone)
            self.values[tick] = float(np.linalg.norm(moved)) * self._share

    def _resolve(self, resolver: Resolver, h: Hierarchy) -> NDArray[np.float64] | None:
        res = resolver.solve(h, self._memory)
        self._memory = res.memory
        return res.x if res.status is Status.SOLVED else None


@final
class Judged:
    """What became of each task of the stack at the command that was sent, see `fate`.

    Signals level_fate (T, N), level_violation (T, N) in the unit of the rows, NaN for a task that
    is not in the stack, and saturated (T, n); N tasks as in `stack.names`.
    """

    def __init__(self, ticks: int, controller: Controller) -> None:
        self._names = controller.cell.stack.names
        shape = ticks, len(self._names)
        self.fate, self.violation = np.zeros(shape, np.int8), np.full(shape, np.nan)
        self.saturated = np.zeros((ticks, controller.cell.robot.n), np.int8)
        self.signals = {"level_fate": self.fate, "level_violation": self.violation,
                        "saturated": self.saturated}

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the command of a tick."""
        h = controller.hierarchy
        found = judged(controller.cell, h, controller.sent, controller.resolver.accuracy)
        columns = [self._names.index(name) for name in h.names]
        self.fate[tick, columns], self.violation[tick, columns] = found.fate, found.violation
        self.saturated[tick] = found.saturated


def upper_levels(h: Hierarchy, count: int) -> Hierarchy:
    """Return the first `count` levels of h, without its reference."""
    m = h.offsets[count]
    return Hierarchy(h.A[:m], h.lower[:m], h.upper[:m], h.sizes[:count], np.zeros(h.n),
                     h.names[:count])
