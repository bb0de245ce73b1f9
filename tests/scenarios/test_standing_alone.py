"""A run's folder is all that a reader needs: the robot's file is gone, and no cell is built."""

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from urdf_text import INERTIAL, joint, link, placed, shape, urdf

from hierarchy import HierarchyError
from scenarios import load, load_run, save, simulate
from scenarios.draw.replay.page import html
from scenarios.scene import scene


def tube(name, middle, length):
    return link(name, INERTIAL + shape(f'<cylinder radius="0.04" length="{length}"/>',
                                       f"0 0 {middle}"))


LIMIT = '<limit lower="-2.5" upper="2.5" effort="50" velocity="3"/>'
ARM = urdf(
    tube("base", 0.05, 0.1), tube("one", 0.1, 0.2), tube("two", 0.15, 0.3),
    tube("three", 0.15, 0.3), tube("four", 0.05, 0.1), tube("tip", 0, 0.02),
    joint("turn", "revolute", "base", "one", LIMIT, "0 0 1", placed("0 0 0.1", "0 0 0.2")),
    joint("shoulder", "revolute", "one", "two", LIMIT, "0 1 0", placed("0 0 0.2", "0 0.4 0")),
    joint("elbow", "revolute", "two", "three", LIMIT, "0 0.8 0.6", placed("0 0 0.3", "0 0.9 0")),
    joint("wrist", "continuous", "three", "four", LIMIT, "1 0 0", placed("0 0 0.3")),
    joint("end", "fixed", "four", "tip", "", "", placed("0 0 0.12")))
SCENARIO = (Path(__file__).parents[1] / "data" / "alone.toml").read_text()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run's folder, the run, and the replay drawn of it while the robot's file was there."""
    there = tmp_path_factory.mktemp("robot")
    (there / "arm.urdf").write_text(ARM)
    (there / "alone.toml").write_text(SCENARIO)
    run = simulate(load(there / "alone.toml"))
    assert run.fault is None
    folder = save(run, tmp_path_factory.mktemp("runs") / "run")
    before = html({"run": load_run(folder)}, "alone")
    shutil.rmtree(there)
    return folder, run, before


@pytest.fixture(autouse=True)
def no_way_back(request, monkeypatch):
    """Whatever would make the robot, the cell or the resolver again fails."""
    if "made" not in request.fixturenames:
        return
    request.getfixturevalue("made")

    broken = mock.Mock(side_effect=AssertionError("a reader went back to the robot or resolver"))
    monkeypatch.setattr("hierarchy.Robot.load", broken)
    monkeypatch.setattr("scenarios.config.Scenario.make_resolver", broken)
    monkeypatch.setattr("scenarios.cell.sensors.camera.DepthCamera.__init__", broken)


def test_what_is_loaded_is_what_was_run_and_its_scene_is_whole(made):
    folder, run, _ = made
    again = load_run(folder)
    assert (again.facts, again.signals.keys()) == (run.facts, run.signals.keys())
    assert again.facts.resolver.label == "hcod"
    assert again.facts.robot.position_units == ("rad", "rad", "rad", "1", "1")
    assert again.facts.robot.joint_names == ("turn", "shoulder", "elbow", "wrist")
    shown = scene(again)
    assert np.allclose(shown.traced, run["ee_position"][shown.ticks], atol=1e-12)
    assert np.allclose(shown.distance[:, -1], run["ee_distance"][shown.ticks], atol=1e-12)
    assert shown.levels.known.all()
    assert shown.levels.names == ("joint limits", "separation", "position")


def test_facts_that_are_missing_or_damaged_are_named(made, tmp_path):
    folder, run, _ = made
    shutil.copytree(folder, tmp_path / "bad")
    facts, damaged = asdict(run.facts), asdict(run.facts)
    del facts["robot"]["rest"]
    damaged["robot"]["model"] = damaged["robot"]["model"].replace("1", "9", 1)
    for text in ("{", json.dumps(facts), json.dumps(damaged)):
        (tmp_path / "bad" / "facts.json").write_text(text)
        with pytest.raises(HierarchyError, match=r"facts\.json cannot be read"):
            load_run(tmp_path / "bad")
    (tmp_path / "bad" / "facts.json").unlink()
    with pytest.raises(HierarchyError, match="earlier version"):
        load_run(tmp_path / "bad")
