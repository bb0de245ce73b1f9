"""Checks made after every tick, outside the measured times."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Hierarchy
from scenarios.cell.build import Cell
from scenarios.config import Scenario
from scenarios.loop.controller import Controller
from scenarios.recording.fate import Fates
from scenarios.recording.recording import Recording
from solvers import Resolver, Status, certify


class Audit(Protocol):
    """Computes numbers in every tick that become signals of the Recording."""

    def look(self, tick: int, controller: Controller) -> None:
        """Examine the tick that the controller has just answered."""

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return the signals by name, a row for each tick of the recording."""


@final
class Certified:
    """Whether `solvers.certify` accepts the answer."""

    def __init__(self, ticks: int) -> None:
        self._values = np.zeros(ticks, dtype=bool)

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the answer of a tick."""
        self._values[tick] = certify(
            controller.hierarchy, controller.resolution.x,
            witnesses=controller.resolution.witnesses).certified

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return `certified` (T,)."""
        return {"certified": self._values[:recording.ticks]}


@final
class Strictness:
    """How far [m] the levels below the position move the end effector in one tick.

    Zero for a strict resolver. The tick is solved a second time without the lower levels and
    without the null-space task; NaN where either solve fails.
    """

    def __init__(self, ticks: int, scenario: Scenario) -> None:
        self._values = np.full(ticks, np.nan)
        period = scenario.control.period
        self._share = period if scenario.control.level == "velocity" else period**2 / 2
        self._memory: Any = None

    def look(self, tick: int, controller: Controller) -> None:
        """Solve a tick without the levels below the position, and compare."""
        h, resolver = controller.hierarchy, controller.resolver
        level = h.names.index("position")
        rows = slice(h.offsets[level], h.offsets[level + 1])
        alone = self._resolve(resolver, upper_levels(h, level + 1))
        if alone is not None and controller.resolution.status is Status.SOLVED:
            moved = h.A[rows] @ (controller.resolution.x - alone)
            self._values[tick] = float(np.linalg.norm(moved)) * self._share

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return `moved_by_lower` (T,) [m]."""
        return {"moved_by_lower": self._values[:recording.ticks]}

    def _resolve(self, resolver: Resolver, h: Hierarchy) -> NDArray[np.float64] | None:
        res = resolver.solve(h, self._memory)
        self._memory = res.memory
        return res.x if res.status is Status.SOLVED else None


@final
class Judging:
    """The fate of each task of the stack under the command that was sent; see `fate`."""

    def __init__(self, ticks: int, cell: Cell) -> None:
        self._fates = Fates(cell.stack.names, ticks, cell.robot.n)

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the command of a tick."""
        self._fates.judge(tick, controller.cell, controller.hierarchy, controller.meant,
                          controller.resolver.accuracy)

    def signals(self, recording: Recording) -> Mapping[str, NDArray[Any]]:
        """Return `level_fate`, `level_violation` and `saturated`, see Recording."""
        return self._fates.signals(recording)


def upper_levels(h: Hierarchy, count: int) -> Hierarchy:
    """Return the first `count` levels of h, with a zero reference."""
    return h.upper_part(count).changed(reference=None, metric=None)
