"""What a run's folder and `hierarchy check ROBOT` give serves as it is."""

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from unittest import mock

import pytest
from refusals import refused
from urdf_text import INERTIAL, joint, link, placed, shape, urdf

from hierarchy import Robot
from scenarios import load, load_run, save, simulate
from scenarios.cell.robot import make_robot
from scenarios.recording.fate import Fate
from scenarios.scene.drawn import scene

LIMIT = '<limit lower="-2.5" upper="2.5" effort="50" velocity="3"/>'
ARM = urdf(
    *(link(name, INERTIAL + shape(f'<cylinder radius="0.04" length="{length}"/>', f"0 0 {middle}"))
      for name, middle, length in (("base", 0.05, 0.1), ("one", 0.1, 0.2), ("two", 0.15, 0.3),
                                   ("three", 0.15, 0.3), ("four", 0.05, 0.1), ("tip", 0, 0.02))),
    joint("turn", "revolute", "base", "one", LIMIT, "0 0 1", placed("0 0 0.1", "0 0 0.2")),
    joint("shoulder", "revolute", "one", "two", LIMIT, "0 1 0", placed("0 0 0.2", "0 0.4 0")),
    joint("elbow", "revolute", "two", "three", LIMIT, "0 0.8 0.6", placed("0 0 0.3", "0 0.9 0")),
    joint("wrist", "continuous", "three", "four", LIMIT, "1 0 0", placed("0 0 0.3")),
    joint("end", "fixed", "four", "tip", "", "", placed("0 0 0.12")))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run's folder, and the run; the robot's file is not there any more."""
    there = tmp_path_factory.mktemp("robot")
    (there / "arm.urdf").write_text(ARM)
    shutil.copy(Path(__file__).parents[1] / "data" / "alone.toml", there)
    run = simulate(load(there / "alone.toml"))
    assert run.fault is None
    folder = save(run, tmp_path_factory.mktemp("runs") / "run")
    shutil.rmtree(there)
    return folder, run


@pytest.fixture
def alone(made, monkeypatch):
    """The same, where whatever would make the robot, the cell or the resolver again fails."""
    broken = mock.Mock(side_effect=AssertionError("a reader went back to the robot or resolver"))
    for name in ("hierarchy.Robot.load", "scenarios.config.Scenario.make_resolver",
                 "scenarios.cell.sensors.camera.DepthCamera.__init__"):
        monkeypatch.setattr(name, broken)
    return made


def test_what_is_loaded_is_what_was_run_and_its_scene_is_whole(alone):
    folder, run = alone
    again = load_run(folder)
    assert (again.facts, again.signals.keys()) == (run.facts, run.signals.keys())
    assert again.facts.resolver.label == "hcod"
    assert again.facts.robot.position_units == ("rad", "rad", "rad", "1", "1")
    assert again.facts.robot.joint_names == ("turn", "shoulder", "elbow", "wrist")
    shown = scene(again)
    assert Fate.UNKNOWN not in shown.levels.fate
    assert shown.levels.names == ("joint limits", "separation", "position")


def test_facts_that_are_missing_or_damaged_are_named(alone, tmp_path):
    folder, run = alone
    shutil.copytree(folder, tmp_path / "bad")
    facts, damaged = asdict(run.facts), asdict(run.facts)
    del facts["robot"]["rest"]
    damaged["robot"]["model"] = damaged["robot"]["model"].replace("1", "9", 1)
    for text in ("{", json.dumps(facts), json.dumps(damaged)):
        (tmp_path / "bad" / "facts.json").write_text(text)
        refused("facts.json cannot be read", load_run, tmp_path / "bad")
    (tmp_path / "bad" / "facts.json").unlink()
    refused("earlier version", load_run, tmp_path / "bad")


CONTROL = """
[damping]
value = 5.0
[control]
stack = "hierarchical"
resolver = "hcod"
duration = 0.02
[[tasks]]
kind = "pose"
"""
NARROW = '<limit lower="0.5" upper="1" velocity="0" effort="1"/>'


def tree(*joints):
    """A tree of joints (name, kind, parent, child, inside)."""
    links = dict.fromkeys(end for _, _, *ends, _ in joints for end in ends)
    return urdf(
        *(link(name, INERTIAL + shape('<sphere radius="0.01"/>')) for name in links),
        *(joint(*one, origin=placed("0.1 0.2 0.3")) for one in joints))


FOLLOWING = [("f1", "revolute", "palm", "finger1", NARROW),
             *((f"f{i}", "revolute", "palm", f"finger{i}", f'{NARROW}<mimic joint="f1"/>')
               for i in (2, 3, 4))]
ROBOTS = {
    "gripper.urdf": tree(("wrist", "revolute", "arm", "palm", NARROW), *FOLLOWING),
    "free.urdf": tree(("free", "floating", "world", "trunk", ""),
                      ("hip", "revolute", "trunk", "leg", NARROW)),
    "turning.urdf": tree(("pan", "continuous", "base", "head", ""),
                         ("tilt", "continuous", "head", "eye", "")),
    "odd.urdf": tree(("a &quot;joint&quot; \\ é&#9;", "revolute", "base", "tool 'x' = [1]", NARROW),
                     ("left/wrist.pitch", "prismatic", "tool 'x' = [1]", "ns::tool0", NARROW)),
    "UPPER.URDF": tree(("hip", "revolute", "trunk", "leg", NARROW)),
    "scene.xml": """<mujoco><worldbody><geom type="plane" size="1 1 1"/><light pos="0 0 1"/>
        <body name="arm" pos="0 0 0.2"><joint name="hinge" axis="0 1 0" range="-90 90"/>
        <geom type="capsule" size="0.05" fromto="0 0 0 0 0 0.3"/><body name="hand" pos="0 0 0.3">
        <joint name="wrist" axis="1 0 0" range="-90 90"/><geom size="0.05"/></body></body>
        </worldbody></mujoco>""",
}


def pasted(model, folder, command):
    """Return the robot that `check` described, and that of a scenario with what it printed."""
    said = command("check", model).out
    assert said.count("  follows         f") == 3 * ("gripper" in model)
    section, path = said[said.index("[robot]\n"):], folder / "pasted.toml"
    end = next(line for line in section.splitlines() if line.startswith("end_effector = "))
    path.write_text('name = "pasted"\n' + section + CONTROL
                    + end.replace("end_effector", "frame", 1))
    assert "20 ticks of 1 ms" in command("check", path).out
    command("run", path, "--out", folder / "run")
    return Robot.load(model), make_robot(load(path).robot)


def expect_the_same(one, other):
    assert (other.base, other.joint_names, other.end_effector) == (
        one.base, one.joint_names, one.end_effector)
    assert [c.joint for c in other.capsules] == [c.joint for c in one.capsules]
    assert [p.joint for p in other.control_points] == [p.joint for p in one.control_points]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_section_to_paste_runs_as_it_is(name, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(ROBOTS[name])
    expect_the_same(*pasted(name, tmp_path, command))


@pytest.mark.usefixtures("example_robot_data")
@pytest.mark.parametrize("name", ["pr2", "romeo"])
def test_the_section_of_a_public_robot_runs_as_it_is(name, tmp_path, command):
    expect_the_same(*pasted(f"example_robot_data:{name}", tmp_path, command))
