"""The simulation loop: a controller and a plant, recorded tick by tick."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from hierarchy.errors import HierarchyError, brief, expect
from scenarios.cell.build import Cell, build
from scenarios.config import Scenario, load
from scenarios.loop.audit import Audit, Strictness, certify_tick
from scenarios.loop.controller import Controller
from scenarios.loop.faults import Faults, with_room
from scenarios.loop.recorder import FASTEST, Recorder
from scenarios.measure.judging import Fates, completed
from scenarios.recording.blame import blamed, blaming
from scenarios.recording.recording import Recording, was_interrupted

_REPORT_EVERY = 500  # ticks between two calls of `progress`


def simulate(scenario: Scenario | str | Path, progress: Callable[[int, int], None] | None = None,
             certified: bool = False, audits: Sequence[Audit] = ()) -> Recording:
    """Run a scenario, or the one of a name or a file, from its start to its end.

    `progress(done, total)` is called every 500 ticks. A run ends early if it is interrupted
    (Ctrl-C), if its policy stops it, if its plant cannot go on, such as a robot that has fallen, if
    its state is no longer finite, if a joint is faster than `recorder.FASTEST`, or if a tick raises
    an error: the Recording then has all ticks so far and says why in `fault`. With `certified`,
    `solvers.certify` judges every answer after its tick was timed, and the Recording has the
    verdicts as its signal `certified`; with `control.strictness` it has `moved_by_lower`, see
    scenarios.loop.audit.Strictness; `audits` are further checks of that kind. What became of each
    level is judged after the last tick, or, with a camera, after each tick. Raises HierarchyError
    where the scenario does not fit its robot or resolver, or a plug-in fails in a first tick.
    """
    if isinstance(scenario, (str, Path)):
        scenario = load(scenario)
    expect("simulate", scenario, Scenario, "give a name, a file, or what `load` returns")
    if progress is not None and not callable(progress):
        raise HierarchyError(f"simulate: progress: expected a function, got {brief(progress)}")
    expect("simulate: audits", audits, Iterable, "give a list of audits")
    rehearsal = rehearsed(scenario)
    cell = build(with_room(scenario))
    faults = Faults(cell) if scenario.faults else None
    controller = Controller(faults.cell, faults.clock) if faults else Controller(cell)
    ticks = scenario.control.ticks
    recorder, fates = watching(controller, ticks, certified, audits)
    try:
        fault = _run(controller, recorder, scenario.control.period, ticks,
                     progress or (lambda done, total: None), faults)
    except KeyboardInterrupt:
        fault = f"interrupted at tick {recorder.ticks}"
    return completed(recorder.finish(scenario, fault), rehearsal, fates)


def watching(controller: Controller, ticks: int, certified: bool = False,
             audits: Sequence[Audit] = ()) -> tuple[Recorder, Fates | None]:
    """Return a recorder with these audits and those of the scenario, and what judges its levels.

    That is None where they can be judged after the run, whose rows are written again.
    """
    cell = controller.cell
    fates = Fates(cell.stack.names, ticks, cell.robot.n) \
        if cell.scenario.sensor.kind != "exact" else None  # no rows again without images
    return Recorder(controller, ticks, (
        *([certify_tick] if certified else []),
        *([Strictness()] if cell.scenario.control.strictness else []),
        *([fates.look] if fates else []), *audits)), fates


def uninterrupted(scenario: Scenario, audits: Sequence[Audit] = ()) -> Recording:
    """Return the recording of a run; KeyboardInterrupt where `simulate` keeps a part of it."""
    recording = simulate(scenario, audits=audits)
    if was_interrupted(recording.fault):
        raise KeyboardInterrupt
    return recording


def rehearsed(scenario: Scenario) -> Cell:
    """Call everything of a tick once, so that nothing is loaded later; return a cell at rest.

    Raises HierarchyError where the scenario does not fit its robot or resolver.
    """
    with blaming():
        controller = Controller(build(scenario))
        controller.rehearse()
        Recorder(controller, 1).write()
    return controller.cell


def _run(controller: Controller, recorder: Recorder, period: float, ticks: int,
         progress: Callable[[int, int], None], faults: Faults | None) -> str | None:
    policy = controller.policy
    for k in range(ticks):
        if k % _REPORT_EVERY == 0:
            progress(k, ticks)
        broken = tick(controller, recorder, k * period, faults)
        if broken:
            return f"{broken} from tick {k} on (t = {k * period:.3f} s)"
        if policy.stopped:
            return policy.fault
    progress(ticks, ticks)
    return policy.fault


def tick(controller: Controller, recorder: Recorder, t: float,
         faults: Faults | None = None) -> str | None:
    """Command, act and record once at time t [s]; return what went wrong, or None."""
    plant = controller.cell.plant
    try:
        if faults is None:
            command = controller.command(t, plant.q, plant.v)
        else:
            command = controller.command(t, *faults.measure(t))
        plant.act(command.copy())  # what was sent is recorded, and perhaps held
        sound = recorder.write()
        recorder.stamp(controller.clock())
        recorder.look()
        fault: str | None = getattr(plant, "fault", None) or None
    except (Exception, SystemExit) as error:  # a user's code, which may fail in any way
        return blamed(error)
    if not sound or (controller.policy.events and not (
            np.isfinite(plant.q).all() and np.isfinite(plant.v).all())):
        return _unsound(controller)
    return fault


def _unsound(controller: Controller) -> str:
    state = controller.cell.state
    robot, i = state.robot, int(np.abs(state.v).argmax())
    if not FASTEST < abs(state.v[i]) < np.inf:
        return "the state is not finite"
    return (f"the motion has diverged: joint {robot.velocity_names[i]} moves at {state.v[i]:.3g} "
            f"{robot.velocity_units[i]}/s, more than {FASTEST:g},")
