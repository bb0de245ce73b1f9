"""The first tick of a scenario: does it fit together, and what can its stack meet?"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

import numpy as np

from hierarchy.tasks.separation import SelfSeparation, inseparable_pairs
from hierarchy.words import listed
from scenarios.cell.build import Cell, build
from scenarios.config import Scenario, ScenarioError
from scenarios.config.validation import doubtful_units
from scenarios.loop.controller import Controller
from scenarios.loop.faults import check
from scenarios.loop.footing import footing
from scenarios.recording.blame import blaming
from solvers import Status, explain, make
from solvers.explain import is_missed

_NAMED = 3        # pairs of capsules named at most
_ROUNDING = 1e-6  # [m] below a distance that is not said
_NOTHING = 1e-12  # violation that rounding leaves of a robot at rest at its targets
_MET = 1e-6       # violation of a level relative to its terms, below which it is met


@dataclass(frozen=True)
class FirstTick:
    """What the first tick showed.

    status : of the resolver, None if the measurement could not be used. levels : the level names
    of the stack, most important first. unmet : one line for each level that cannot be met, and what
    holds it back. distances : to the nearest obstacle [m], of "body" and "end effector", where
    they are measured. warnings : what is allowed, but perhaps not meant.
    """

    status: Status | None
    levels: tuple[str, ...]
    unmet: tuple[str, ...]
    distances: dict[str, float]
    warnings: tuple[str, ...]


def first_tick(scenario: Scenario) -> FirstTick:
    """Build a scenario and run its first tick.

    Raises HierarchyError where a run would: the scenario does not fit its robot or resolver.
    """
    controller = _after_one(scenario)
    distances = _distances(controller)
    unmet = tuple(_unmet(controller)) if controller.answered else ()
    warnings = (*_warnings(scenario, distances), *_itself(controller.cell), *footing(controller),
                *_undrawn(scenario))
    status, levels = (controller.resolution.status, controller.hierarchy.names) \
        if controller.answered else (None, ())
    return FirstTick(status, levels, unmet, distances, warnings)


def _undrawn(scenario: Scenario) -> Iterator[str]:
    """Yield why no start can be drawn from the [variation] of a scenario."""
    try:
        scenario.with_drawn(scenario.drawn(0, 0), "variation")
    except ScenarioError as error:
        yield f"no sampled starts: {error}".removesuffix(".")


def contact_warnings(scenario: Scenario) -> tuple[str, ...]:
    """Return warnings from the first tick of a scenario with contacts that its run may fall.

    Nothing but at level "torque". Raises HierarchyError where a run would.
    """
    return tuple(footing(_after_one(scenario))) if scenario.control.level == "torque" else ()


def _after_one(scenario: Scenario) -> Controller:
    """Return a controller after its first tick."""
    with blaming():
        controller = Controller(build(scenario))
        check(scenario.faults, controller.cell.robot)
        plant = controller.cell.plant
        controller.command(0.0, plant.q, plant.v)
        if not controller.answered:  # before a first image, where a run resolves its rows too
            controller.rehearse()
    return controller


def _unmet(controller: Controller) -> Iterator[str]:
    """Yield what `explain` says of each level that the exact resolver cannot meet."""
    h = controller.hierarchy
    exact = make("hcod").solve(h)
    missed = h.violations(exact.x)
    lines = explain(h, exact, _MET, controller.cell.stack.row_names(h.names)).splitlines()
    crossed = len(lines) < len(h.sizes)  # sides of rows, which is all that is said
    yield from (line for k, line in enumerate(lines[:len(h.sizes)])
                if crossed or (missed[k] > _NOTHING and is_missed(h, exact.x, k, _MET)))


def _distances(controller: Controller) -> dict[str, float]:
    if controller.cell.sensor is None:
        return {}
    seen = controller.cell.sensor.measurement
    both = {"body": seen.minimal_distance, "end effector": seen.end_effector_distance}
    return {name: distance for name, distance in both.items() if isfinite(distance)}


def _itself(cell: Cell) -> Iterator[str]:
    """Yield what self-collision leaves out, and pairs that are too near at the start."""
    for task in map(cell.stack.__getitem__, cell.stack.names):
        if not isinstance(task, SelfSeparation):
            continue
        least = task.barrier.distance
        if out := inseparable_pairs(cell.robot, least):
            more = [f"{len(out) - _NAMED} more pairs"] if len(out) > _NAMED else []
            yield (f"{task.name} leaves out {listed([*out[:_NAMED], *more])}: their "
                   f"capsules overlap, or are nearer than {1e3 * least:g} mm in every posture; "
                   "slimmer robot.capsules keep them")
        for name, apart in zip(task.row_names, task.distances(cell.state).tolist(), strict=True):
            if apart < least - _ROUNDING:
                yield (f"{task.name}: {name} are {1e3 * apart:.0f} mm apart at the start, less "
                       f"than the {1e3 * least:g} mm to be kept")


def _warnings(scenario: Scenario, distances: dict[str, float]) -> Iterator[str]:
    if scenario.avoidance is not None:
        kept = scenario.avoidance.promised
        for name, key in (("body", "body"), ("end effector", "ee")):
            if key in kept and distances.get(name, kept[key]) < kept[key] - _ROUNDING:
                yield (f"{name}: {1e3 * distances[name]:.0f} mm from the nearest obstacle at the "
                       f"start, less than the {1e3 * kept[key]:.0f} mm to be kept")
    yield from doubtful_units(scenario)
    yield from _idle(scenario)


def _idle(scenario: Scenario) -> Iterator[str]:
    """Yield the faults and pushes that no tick of the run has."""
    end, period = scenario.control.duration, scenario.control.period
    begins, pushes = period * np.arange(scenario.control.ticks), getattr(
        scenario.plant, "pushes", ())
    for key, one, acts in (
            *((f"faults.{i}", one, one.acts(begins, period))
              for i, one in enumerate(scenario.faults)),
            *((f"plant.pushes.{i}", one, one.acts(begins)) for i, one in enumerate(pushes))):
        if one.at >= end:
            yield f"{key}.at = {one.at:g} s is after the run, which ends at {end:g} s"
        elif not acts.any():
            yield (f"{key} does nothing: from {one.at:g} s, for {one.duration:g} s, it falls "
                   f"between two ticks of {period:g} s")
