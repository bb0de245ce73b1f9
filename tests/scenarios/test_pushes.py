"""What is drawn of a run: frames, levels, forces, friction cones, pushes."""

from dataclasses import replace

import numpy as np
import pytest

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.draw.replay import html
from scenarios.draw.viewer.live import Live
from scenarios.loop.controller import Controller
from scenarios.measure.judging import judge
from scenarios.recording.fate import Fate, levels_at
from scenarios.recording.listed import errors
from scenarios.scene.drawn import scene


@pytest.mark.parametrize("name", ["reach-torque", "stand-momentum", "wipe", "step", "crawl"])
def test_every_shipped_scenario_of_torques_can_be_replayed(name):
    """A level of momentum had no name for its curve; a position in two axes had three."""
    pytest.importorskip("mujoco")
    run = simulate(load(name).with_changes({"control.duration": 0.01}))
    names = [one.name for one in scene(run).series]
    assert len(set(names)) == len(names)
    assert "</html>" in html({"a": run}, name)
    live = Live(run.scenario)
    live.tick()
    for now, path in zip(live.frame().paths, scene(run).paths, strict=True):
        np.testing.assert_allclose(now.actual[0], path.actual[0], atol=1e-9)
        assert (now.wanted is None) == (path.wanted is None)
        if name == "wipe":
            assert (scene(run).pushes.table[..., 2] == load(name).plant.height).all()
        if path.wanted is not None:
            np.testing.assert_allclose(now.wanted[0], path.wanted[0], atol=1e-9)


@pytest.mark.parametrize(("units", "all_of_them", "two"), [
    (["rad"] * 7, "rad", "rad"), (["m"] * 7, "m", "m"), (["m"] * 6 + ["rad"], "", "m")])
def test_tasks_of_joints_have_their_unit_and_none_where_those_differ(units, all_of_them, two):
    """Those of joints that slide were said to be missed by so many rad/s², and off by rad."""
    tasks = [{"kind": "coupling", "joints": {"joint_1": 1.0, "joint_2": 1.0}},
             {"kind": "posture"}]
    run = simulate(load("ellipse-hqp", {"control.duration": 0.002, "tasks": tasks}))
    robot = replace(run.facts.robot, velocity_units=tuple(units))
    run = replace(run, facts=replace(run.facts, robot=robot))
    levels = levels_at(run, [0])
    said = dict(zip(levels.names, levels.units, strict=True))
    expected = {"joint limits": all_of_them, "coupling": two, "posture": all_of_them}
    assert {name: said[name] for name in expected} == {
        name: unit and f"{unit}/s²" for name, unit in expected.items()}
    del expected["joint limits"]
    assert {section.title: unit for section, unit, _ in errors(run)} == expected


NAMES = ("ellipse", "ellipse-velocity", "ellipse-published", "ellipse-limits", "ellipse-hqp")


@pytest.fixture(scope="module")
def recording():
    return simulate(load("ellipse", ["control.duration=1.5"]))


@pytest.mark.parametrize("name", NAMES)
def test_violations_are_those_of_the_hierarchy_that_was_resolved(name):
    """A second run asks the loop's own hierarchy, tick by tick, what its command violates."""
    scenario = load(name, ["control.duration=0.2", "start.v=[0.1, -0.1, 0, 0.2, 0, 0.1, 0]"])
    controller = Controller(scenario)
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
