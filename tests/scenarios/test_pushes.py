"""What is drawn of a run: frames, levels, forces, friction cones, pushes."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from scenarios.measure.judging import judge
from scenarios.recording.fate import Fate, levels_at

NAMES = ("ellipse", "ellipse-velocity", "ellipse-published", "ellipse-limits", "ellipse-hqp")


@pytest.fixture(scope="module")
def recording():
    return simulate(load("ellipse", ["control.duration=1.5"]))


@pytest.mark.parametrize("name", NAMES)
def test_violations_are_those_of_the_hierarchy_that_was_resolved(name):
    """A second run asks the loop's own hierarchy, tick by tick, what its command violates."""
    scenario = load(name, ["control.duration=0.2", "start.v=[0.1, -0.1, 0, 0.2, 0, 0.1, 0]"])
    controller = Controller(build(scenario))
    plant, seen = controller.cell.plant, []
    for k in range(200):
        x = controller.command(k * scenario.control.period, plant.q, plant.v)
        seen.append(dict(zip(controller.hierarchy.names, controller.hierarchy.violations(x),
                             strict=True)))
        plant.act(x)
    levels = levels_at(simulate(scenario), range(200))
    assert (levels.fate != Fate.UNKNOWN).all()
    for found, fates, expected in zip(levels.violation, levels.fate, seen, strict=True):
        for task, violation, fate in zip(levels.names, found, fates, strict=True):
            assert np.isclose(violation, expected.get(task, np.nan), atol=1e-9, equal_nan=True)
            assert (fate == Fate.ABSENT) == (task not in expected)
            assert (fate == Fate.MISSED) == (violation > 1e-5) or 1e-9 < violation < 1e-3


def test_distances_that_are_not_those_recorded_leave_levels_unknown(recording):
    moved = recording["control_point_distance"] + 1e-3
    other = replace(recording, signals=recording.signals | {"control_point_distance": moved})
    judge(other, build(recording.scenario))
    levels = levels_at(other, [0, 700])
    assert (levels.fate == Fate.UNKNOWN).any(axis=1).all()
    assert np.isnan(levels.violation).all()
