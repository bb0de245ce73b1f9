"""What is looked at after every tick, outside the times measured."""

from __future__ import annotations

from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Hierarchy
from scenarios.config import Scenario
from scenarios.control.controller import Controller
from solvers import Resolver, Status, certify


class Audit(Protocol):
    """One number a tick, kept as the signal `name` of the Recording."""

    name: str
    values: NDArray[Any]

    def look(self, tick: int, controller: Controller) -> None:
        """Look at the tick that the controller has just answered."""


@final
class Certified:
    """Whether `solvers.certify` accepts the answer."""

    name = "certified"

    def __init__(self, ticks: int) -> None:
        self.values = np.zeros(ticks, dtype=bool)

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the answer of a tick."""
        self.values[tick] = certify(controller.hierarchy, controller.resolution.x).certified


@final
class Strictness:
    """How far [m] what is below the position moves the end effector in a tick; strict: not at all.

    The tick is resolved once more without the levels below and without the null-space task. NaN
    where either is not solved.
    """

    name = "moved_by_lower"

    def __init__(self, ticks: int, scenario: Scenario) -> None:
        self.values = np.full(ticks, np.nan)
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


def upper_levels(h: Hierarchy, count: int) -> Hierarchy:
    """Return the first `count` levels of h, without its reference."""
    m = h.offsets[count]
    return Hierarchy(h.A[:m], h.lower[:m], h.upper[:m], h.sizes[:count], np.zeros(h.n),
                     h.names[:count])
