"""What a run's folder and `hierarchy check ROBOT` give serves as it is."""

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from unittest import mock

import pytest
from refusals import refused

from hierarchy import Robot
from scenarios import load, load_run, save, simulate
from scenarios.cell.robot import make_robot
from scenarios.recording.fate import Fate
from scenarios.scene.drawn import scene

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run's folder, and the run; the robot's file is not there any more."""
    there = tmp_path_factory.mktemp("robot")
    for file in ("alone.toml", "seen/odd.urdf"):
        shutil.copy(DATA / file, there)
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
    assert again.facts.robot.position_units[:7] == ("m", "m", "1", "1", "1", "1", "rad")
    assert again.facts.robot.joint_names[:4] == ("glide", "turn", "lift", "reach")
    shown = scene(again)
    assert Fate.UNKNOWN not in shown.levels.fate
    assert shown.levels.names == ("mechanism", "joint limits", "separation", "position")


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
ROBOTS = [DATA / file for file in (
    "seen/odd.urdf", "seen/more/dotted.urdf", "seen/more/legs.urdf", "seen/more/mobile.urdf",
    "seen/more/biped.xml", "robots/four_joints.xml", "robots/falling.xml", "robots/odd.xml")]


def check_pasted(model, folder, command):
    """The robot of a scenario with what `check` printed of a robot is that robot, and runs."""
    said = command("check", model).out
    section, path = said[said.index("[robot]\n"):], folder / "pasted.toml"
    end = next(line for line in section.splitlines() if line.startswith("end_effector = "))
    path.write_text('name = "pasted"\n' + section + CONTROL
                    + end.replace("end_effector", "frame", 1))
    assert "20 ticks of 1 ms" in command("check", path).out
    command("run", path, "--out", folder / "run")
    one, other = Robot.load(model), make_robot(load(path).robot)
    assert (other.base, other.joint_names, other.end_effector) == (
        one.base, one.joint_names, one.end_effector)
    assert [c.joint for c in other.capsules] == [c.joint for c in one.capsules]
    assert [p.joint for p in other.control_points] == [p.joint for p in one.control_points]


@pytest.mark.parametrize("file", ROBOTS, ids=lambda file: file.name)
def test_the_section_to_paste_runs_as_it_is(file, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    name = file.name.replace("legs.urdf", "LEGS.URDF")
    (tmp_path / name).write_text(file.read_text().replace(
        "hinge.001", "a &quot;joint&quot; \\ é&#9; 'x' = [1]"))
    check_pasted(name, tmp_path, command)


@pytest.mark.usefixtures("example_robot_data")
@pytest.mark.parametrize("name", ["pr2", "romeo"])
def test_the_section_of_a_public_robot_runs_as_it_is(name, tmp_path, command):
    check_pasted(f"example_robot_data:{name}", tmp_path, command)
