"""The control loop: a controller and a plant, tick after tick, recorded."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from scenarios.config import Scenario
from scenarios.controller import Controller
from scenarios.recorder import Recorder
from scenarios.recording import Recording
from solvers import certify

_REPORT_EVERY = 500  # ticks between two calls of `progress`


def simulate(scenario: Scenario, progress: Callable[[int, int], None] | None = None,
             certified: bool = False) -> Recording:
    """Run a scenario from its start to its end.

    `progress(done, total)` is called now and then. A run that is interrupted (Ctrl-C) or whose
    state stops being finite ends early: the Recording has all ticks so far and says why in
    `fault`. With `certified`, every answer is judged by `solvers.certify` after its tick was timed,
    and the Recording has the verdicts as its signal `certified`. Raises HierarchyError where the
    scenario does not fit its robot or resolver.
    """
    rehearsal = Controller(scenario)
    rehearsal.rehearse()
    Recorder(rehearsal, 1).write()
    controller = Controller(scenario)
    ticks = max(1, round(scenario.control.duration / scenario.control.period))
    recorder = Recorder(controller, ticks)
    verdicts = np.zeros(ticks, dtype=bool) if certified else None
    try:
        fault = _run(controller, recorder, scenario.control.period, ticks, progress or _silent,
                     verdicts)
    except KeyboardInterrupt:
        fault = f"interrupted at tick {recorder.ticks}"
    recording = recorder.finish(scenario, fault)
    if verdicts is not None:
        recording.signals["certified"] = verdicts[:recording.ticks]
    return recording


def _run(controller: Controller, recorder: Recorder, period: float, ticks: int,
         progress: Callable[[int, int], None], verdicts: NDArray[np.bool_] | None) -> str | None:
    plant = controller.cell.plant
    for k in range(ticks):
        if k % _REPORT_EVERY == 0:
            progress(k, ticks)
        plant.act(controller.command(k * period, plant.q, plant.v))
        if not recorder.write():
            return f"the state is not finite from tick {k} on (t = {k * period:.3f} s)"
        recorder.stamp(perf_counter())
        if verdicts is not None:
            verdicts[k] = certify(controller.hierarchy, controller.resolution.x).certified
    progress(ticks, ticks)
    return None


def _silent(done: int, total: int) -> None:
    pass
