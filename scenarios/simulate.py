"""The control loop: sense, allocate, stack, resolve, act, record."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from time import perf_counter

import numpy as np

from hierarchy.allocation import AVOIDANCE, POINTING, POSITION, Allocation, allocate
from hierarchy.problem import Array
from hierarchy.task import Level
from scenarios.build import Cell, build
from scenarios.config import Scenario
from scenarios.recorder import Recorder
from scenarios.recording import Recording
from solvers import Resolver, Status

_REPORT_EVERY = 500  # ticks between two calls of `progress`


def simulate(scenario: Scenario, progress: Callable[[int, int], None] | None = None) -> Recording:
    """Run a scenario from its start to its end.

    `progress(done, total)` is called now and then. A run that is interrupted (Ctrl-C) or whose
    state stops being finite ends early: the Recording has all ticks so far and says why in
    `fault`. Raises HierarchyError where the scenario does not fit its robot or resolver.
    """
    cell, resolver = build(scenario), scenario.make_resolver()
    ticks = max(1, round(scenario.control.duration / scenario.control.period))
    recorder = Recorder(cell, ticks)
    try:
        fault = _run(scenario, cell, resolver, recorder, ticks, progress or _silent)
    except KeyboardInterrupt:
        fault = f"interrupted at tick {recorder.ticks}"
    return recorder.finish(scenario, fault)


def _run(scenario: Scenario, cell: Cell, resolver: Resolver, recorder: Recorder, ticks: int,
         progress: Callable[[int, int], None]) -> str | None:
    period, level, clock = scenario.control.period, scenario.control.level, perf_counter
    state, plant, sensor, stack = cell.state, cell.plant, cell.sensor, cell.stack
    pointing = cell.pointing
    decide = _allocator(scenario, cell)
    memory = None
    for k in range(ticks):
        if k % _REPORT_EVERY == 0:
            progress(k, ticks)
        begin = clock()
        state.move(k * period, plant.q, plant.v)
        moved = clock()
        if sensor is not None:
            sensor.measure(state)
        cone_error = pointing.cone_error(state) if pointing is not None else nan
        order, repulsion = decide(cone_error)
        hierarchy = stack.hierarchy(state, order)
        written = clock()
        resolution = resolver.solve(hierarchy, memory)
        resolved = clock()
        memory = resolution.memory
        solved = resolution.status == Status.SOLVED
        command = resolution.x if solved else _brake(level, state.v)
        plant.act(command)
        active = _active(cell, order)
        finite = recorder.write(
            resolution.x, cone_error, order, active, repulsion, int(resolution.status),
            resolution.iterations, (moved - begin, written - moved, resolved - written,
                                    clock() - begin))
        if not finite:
            return f"the state is not finite from tick {k} on (t = {k * period:.3f} s)"
    progress(ticks, ticks)
    return None


def _allocator(scenario: Scenario, cell: Cell) -> Callable[[float], Allocation]:
    """Algorithm 1 on the cell's measurement, or the tasks there are where nothing is avoided."""
    always = scenario.pointing is not None and scenario.pointing.kind == "equality"
    if cell.sensor is None or cell.areas is None:
        return lambda cone_error: _without_obstacles(cell, always or cone_error > 0.0)
    seen, areas = cell.sensor.measurement, cell.areas

    def decide(cone_error: float) -> Allocation:
        distance = seen.distance
        return allocate(distance[seen.active], distance[-1], cone_error, areas, always)

    return decide


def _without_obstacles(cell: Cell, point: bool) -> Allocation:
    order = (POSITION,) * (cell.position is not None) + (POINTING,) * point
    return Allocation(order, repulsion=False)


def _active(cell: Cell, order: tuple[str, ...]) -> int:
    """Number of the control point whose avoidance is in the stack, or -1."""
    if cell.sensor is None or AVOIDANCE not in order:
        return -1
    return cell.sensor.measurement.active + 1


_BRAKE = 10.0  # [1/s] deceleration per velocity when a tick has no answer


def _brake(level: Level, v: Array) -> Array:
    return np.zeros_like(v) if level == "velocity" else -_BRAKE * v


def _silent(done: int, total: int) -> None:
    pass
