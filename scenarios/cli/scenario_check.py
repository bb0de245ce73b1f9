"""`hierarchy check SCENARIO`: validate a scenario, build it, and run its first tick."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import fill
from typing import Any

from scenarios.cli.options import loaded
from scenarios.config import Scenario
from scenarios.loop.first_tick import FirstTick, first_tick
from solvers import Status

_WIDTH, _UNDER = 100, " " * 12


def look_at(name: str, changes: list[str] | None) -> tuple[Scenario, FirstTick]:
    """Load a scenario with changes "key=value", and run its first tick."""
    scenario = loaded(name, changes)
    return scenario, first_tick(scenario)


def as_plain_data(scenario: Scenario, found: FirstTick) -> dict[str, Any]:
    """Return a scenario and its first tick as plain data for JSON."""
    return {"scenario": scenario.model_dump(mode="json"), "first_tick": {
        "status": None if found.status is None else found.status.name,
        "levels": list(found.levels), "unmet": list(found.unmet),
        "distances_m": found.distances}, "warnings": list(found.warnings)}


def say(scenario: Scenario, found: FirstTick) -> str:
    """Return the summary of a scenario and its first tick as text."""
    lines = [f"{scenario.name}: {scenario.title}", *_sections(scenario), *_first(found)]
    lines += [fill(f"Warning: {text}.", _WIDTH, subsequent_indent="  ") for text in found.warnings]
    return "\n".join([*lines, "Valid."])


def _first(found: FirstTick) -> Iterator[str]:
    if found.distances:
        yield "  start     " + ", ".join(f"{name} {1e3 * distance:.0f} mm from the nearest obstacle"
                                         for name, distance in found.distances.items())
    if found.status is None:
        yield "  tick 0    not resolved: there is no usable measurement yet"
        return
    solved = "" if found.status is Status.SOLVED else f", {found.status}"
    yield f"  tick 0    {' > '.join(found.levels)}{solved}"
    for line in found.unmet or ("Every level is met.",):
        yield fill(line, _WIDTH, initial_indent=_UNDER, subsequent_indent=f"{_UNDER}  ")


def _sections(scenario: Scenario) -> Iterator[str]:
    control = scenario.control
    yield f"  robot     {scenario.robot.model}"
    yield (f"  control   {control.level} level, {control.ticks} ticks of "
           f"{1e3 * control.period:g} ms")
    yield f"  plant     {scenario.plant.kind}"
    yield f"  resolver  {scenario.make_resolver()!r}"
    if scenario.pointing is not None:
        yield f"  pointing  {scenario.pointing.rows}, cone of {scenario.pointing.alpha_d:g} deg"
    if scenario.avoidance is not None:
        asked = scenario.avoidance
        body, tip = (" and ".join(f"{distance:g}" for distance in thresholds.values())
                     for thresholds in (asked.thresholds, asked.tip_thresholds))
        yield (f"  avoidance {asked.kind}, {len(asked.obstacles)} obstacles; within {body} m of "
               f"the body, {tip} m of the end effector")
    if scenario.limits is not None:
        yield (f"  limits    positions and velocities of the robot, {scenario.limits.acceleration} "
               f"rad/s^2, "
               f"{'in the stack' if scenario.limits_in_stack else 'as a guard outside the stack'}")
    for i, task in enumerate(scenario.tasks):
        yield f"  task {i:<4} {task.title}" + (f", {task.kind}" if task.name else "")
