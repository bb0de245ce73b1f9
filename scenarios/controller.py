"""One tick of control: from a measured joint state to a command."""

from __future__ import annotations

from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from hierarchy.allocation import POINTING, POSITION, Allocation, allocate
from hierarchy.problem import Array
from scenarios.build import Cell, build
from scenarios.config import Scenario
from solvers import Resolver, Status

_REHEARSALS = 20
_BRAKE = 10.0  # [1/s] deceleration per velocity in a tick without an answer


class Controller:
    """Sense, allocate, stack, resolve.

    After `command`: `allocation` and `cone_error` of the tick, its `hierarchy` (until the next
    command) and `resolution`, and `stamps`, the clock [s] at its begin, after kinematics, after
    rows (sensing and allocation included) and after resolving.
    """

    def __init__(self, scenario: Scenario, cell: Cell | None = None,
                 resolver: Resolver | None = None) -> None:
        self.cell = build(scenario) if cell is None else cell
        self.resolver = scenario.make_resolver() if resolver is None else resolver
        self.level = scenario.control.level
        self.cone_error = nan
        self.allocation = Allocation((), repulsion=False)
        self.stamps = (0.0, 0.0, 0.0, 0.0)
        self._always_point = bool(scenario.pointing and scenario.pointing.kind == "equality")
        self._memory: Any = None

    def command(self, t: float, q: Array, v: Array) -> Array:
        """Return the velocity or acceleration (n,) to send at time t [s], joints at q and v.

        A tick without an answer brakes: zero velocity, or deceleration in proportion to v.
        """
        cell = self.cell
        state = cell.state
        begin = perf_counter()
        state.move(t, q, v)
        moved = perf_counter()
        if cell.sensor is not None:
            cell.sensor.measure(state)
        if cell.pointing is not None:
            self.cone_error = cell.pointing.cone_error(state)
        self.allocation = self._allocate()
        self.hierarchy = hierarchy = cell.stack.hierarchy(state, self.allocation.order)
        written = perf_counter()
        self.resolution = resolution = self.resolver.solve(hierarchy, self._memory)
        self.stamps = (begin, moved, written, perf_counter())
        self._memory = resolution.memory
        if resolution.status is Status.SOLVED:
            return resolution.x
        return np.zeros_like(v) if self.level == "velocity" else -_BRAKE * v

    def rehearse(self) -> None:
        """Call every kernel of the loop once, so that none is loaded while ticks are timed.

        Spoils the controller's state; make another for the run.
        """
        plant, tasks = self.cell.plant, self.cell.stack.names
        self.command(0.0, plant.q, plant.v)
        for _ in range(_REHEARSALS):
            self.resolver.solve(self.cell.stack.hierarchy(self.cell.state, tasks), self._memory)
        plant.act(np.zeros_like(plant.v))

    def _allocate(self) -> Allocation:
        cell = self.cell
        if cell.sensor is None or cell.areas is None:
            point = self.cone_error > 0.0 or self._always_point
            return Allocation((POSITION,) * (cell.position is not None) + (POINTING,) * point,
                              repulsion=False)
        seen = cell.sensor.measurement
        return allocate(seen.minimal_distance, seen.end_effector_distance, self.cone_error,
                        cell.areas, self._always_point)
