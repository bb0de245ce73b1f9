import csv
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from hierarchy import Robot, State
from hierarchy.errors import RobotError
from scenarios.bench.peers import run
from scenarios.bench.peers.compare import make_scenes
from scenarios.bench.peers.entrants import ENTRANTS, PACKAGES, Entrant, Package
from scenarios.bench.peers.environments import MissingError, install, python_of
from scenarios.bench.peers.figure import bars
from scenarios.bench.peers.process import after_nan, stage
from scenarios.bench.peers.scene import read_scenes, write_scenes
from scenarios.bench.peers.stand import compare as stand
from scenarios.bench.peers.stand.judge import Judge
from scenarios.bench.peers.stand.ours import Ours
from scenarios.bench.peers.stand.scene import read_stand
from scenarios.bench.peers.stand.states import make_stand
from scenarios.bench.peers.urdf import roll_pitch_yaw, urdf

ROOT = Path(__file__).parents[2]
NUMPY = Package("numpy", "numpy")


def fake(name, **options):
    return Entrant(name, NUMPY, f"fake_peers:{name}", options)


@pytest.fixture(autouse=True)
def only_what_the_tests_bring(tmp_path, monkeypatch):
    monkeypatch.setattr("scenarios.bench.peers.environments.folder_of",
                        lambda package: tmp_path / "cache" / package.name)
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "tests" / "helpers"))
    monkeypatch.setenv("COLUMNS", "80")


@pytest.fixture
def arm(tmp_path):
    robot = Robot.named("kuka_lwr")
    file = tmp_path / "arm.urdf"
    file.write_text(urdf(robot))
    return robot, Robot.from_file(file, robot.end_effector)


def test_the_arm_read_from_its_urdf_moves_and_weighs_as_ours(arm):
    ours, read = arm
    rng = np.random.default_rng(0)
    for _ in range(50):
        q, v = rng.uniform(ours.lower, ours.upper), rng.uniform(-1.0, 1.0, ours.n)
        a, b = State.at(ours, q, v), State.at(read, q, v)
        for of in ("J", "dJ"):
            np.testing.assert_allclose(getattr(b, of), getattr(a, of), rtol=0.0, atol=1e-12)
        end, same = ours.frame("end_effector"), read.frame("end_effector")
        np.testing.assert_allclose(b.position(same), a.position(end), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(b.rotation(same), a.rotation(end), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(b.mass_matrix(), a.mass_matrix(), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(b.bias_effort(), a.bias_effort(), rtol=0.0, atol=1e-12)


def test_the_arm_read_from_its_urdf_has_our_joints_and_limits(arm):
    ours, read = arm
    assert read.joint_names == ours.joint_names
    for of in ("lower", "upper", "velocity_limit", "effort_limit"):
        np.testing.assert_array_equal(getattr(read, of), getattr(ours, of))


def test_a_robot_that_came_from_a_file_is_not_written(arm):
    with pytest.raises(RobotError, match="was not made from a table"):
        urdf(arm[1])


@pytest.mark.parametrize("angles", [(0.3, -0.7, 2.0), (np.pi / 2, 0.0, 0.0), (0.0, np.pi / 2, 0.4),
                                    (0.0, -np.pi / 2, -1.0), (0.0, 0.0, np.pi)])
def test_angles_of_a_rotation_make_the_rotation(angles):
    def turned(roll, pitch, yaw):
        (a, b, c), (u, v, w) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
        return np.array([[c * b, c * v * u - w * a, c * v * a + w * u],
                         [w * b, w * v * u + c * a, w * v * a - c * u], [-v, b * u, b * a]])

    R = turned(*angles)
    np.testing.assert_allclose(turned(*roll_pitch_yaw(R)), R, atol=1e-12)


def test_the_humanoid_read_from_its_urdf_weighs_as_ours(tmp_path):
    ours, file = Robot.named("humanoid"), tmp_path / "humanoid.urdf"
    feet = [ours.frame("left_foot"), ours.frame("right_foot")]
    file.write_text(urdf(ours, feet))
    read = Robot.from_file(file, "left_foot", base="floating")
    order = [ours.velocity_names.index(name) for name in read.velocity_names]
    np.testing.assert_array_equal(read.effort_limit[6:], ours.effort_limit[order][6:])
    moved = [*range(7), *(i + 1 for i in order[6:])]
    rng = np.random.default_rng(0)
    for _ in range(10):
        q, v = ours.integrate(ours.rest, rng.normal(size=ours.n)), rng.normal(size=ours.n)
        a, b = State.at(ours, q, v), State.at(read, q[moved], v[order])
        np.testing.assert_allclose(b.mass_matrix(), a.mass_matrix()[np.ix_(order, order)],
                                   rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(b.bias_effort(), a.bias_effort()[order], rtol=0.0, atol=1e-10)
        for foot in feet:
            np.testing.assert_allclose(b.position(read.frame(foot.name)), a.position(foot),
                                       rtol=0.0, atol=1e-12)


def test_mujoco_is_told_to_keep_the_end_effector():
    compiler = ET.fromstring(urdf(Robot.named("kuka_lwr"))).find("mujoco/compiler")
    assert compiler.get("fusestatic") == "false"


def test_scenes_are_read_as_they_were_written(tmp_path):
    scenes = make_scenes(tmp_path)
    write_scenes(scenes, tmp_path / "scenes.json")
    assert read_scenes(tmp_path / "scenes.json") == scenes


def test_the_path_of_the_scene_is_the_path_of_our_stack(tmp_path):
    from hierarchy.paths import Ellipse

    scene = make_scenes(tmp_path)["ellipse"]
    ours = Ellipse(scene.centre, scene.cosine, scene.sine, scene.turning)
    for t in (0.0, 0.7, 5.0):
        np.testing.assert_allclose(scene.target(t), ours(t)[:2], atol=1e-15)


def test_every_entrant_has_its_adapter():
    for entrant in (*ENTRANTS, *stand.ENTRANTS):
        module, _, name = entrant.adapter.partition(":")
        text = (ROOT / f"{module.replace('.', '/')}.py").read_text()
        assert f"\nclass {name}" in text
    assert {entrant.package for entrant in ENTRANTS} >= set(PACKAGES)


def test_another_environment_sees_nothing_of_ours_but_what_it_needs(tmp_path):
    staged = stage(tmp_path / "staged")
    assert [path.name for path in staged.iterdir()] == ["scenarios"]
    assert [path.name for path in (staged / "scenarios").iterdir()] == ["bench"]
    assert (staged / "scenarios" / "bench" / "peers" / "worker.py").is_file()


def test_a_package_that_is_not_there_is_missing_with_what_to_do():
    nobody = Package("nobody", "no_such_module", ("nobody==1",))
    with pytest.raises(MissingError, match=r"not installed; hierarchy bench peers --install"):
        python_of(nobody)


def test_a_package_that_pip_refused_is_missing_with_what_pip_said(monkeypatch):
    nobody = Package("nobody", "no_such_module", ("nobody==1",))
    said = iter(["", "ERROR: No matching distribution found"])
    monkeypatch.setattr("scenarios.bench.peers.environments._said", lambda command: next(said))
    assert install([nobody]) == {"nobody": "ERROR: No matching distribution found"}
    with pytest.raises(MissingError, match="pip failed: ERROR: No matching distribution found"):
        python_of(nobody)


def test_an_environment_that_is_there_is_not_made_again(tmp_path, monkeypatch):
    somebody = Package("somebody", "no_such_module", ("somebody==1",))
    said = iter(["", ""])
    monkeypatch.setattr("scenarios.bench.peers.environments._said", lambda command: next(said))
    assert install([somebody]) == install([somebody]) == {"somebody": ""}
    assert python_of(somebody) == str(tmp_path / "cache" / "somebody" / "bin" / "python")


@pytest.mark.slow
def test_everybody_is_judged_or_named_with_the_reason(tmp_path, capsys):
    nobody = Entrant("nobody", Package("nobody", "no_such_module", ("nobody==1",)), "a:B")
    entrants = [fake("Posture"), fake("Refuses"), fake("Lost"), fake("Ends"), nobody]
    rows = run(tmp_path / "out", entrants, ticks=1100)
    found = {row["entrant"]: row for row in rows}
    assert list(found) == ["Posture", "Refuses", "Lost"]
    good, none, lost = found.values()
    assert good["ticks"] == none["ticks"] == 1100
    assert good["median_us"] <= good["p95_us"] <= good["p99.9_us"]
    assert good["solve_us"] is not None
    assert good["failed"] == good["step_failed"] == 0
    assert good["excess_rad_s"] == 0.0
    assert good["moved_m"] > 1e-4  # a posture with nothing above it moves the end effector
    assert good["nan"] == lost["nan"] == "an answer with NaN"
    assert none["step_failed"] == lost["step_failed"] == 2000
    assert none["median_us"] is None
    assert none["why"] == "ValueError: no answer"
    assert none["nan"] == "raises ValueError"
    assert "not finite" in lost["why"]
    missing = json.loads((tmp_path / "out" / "missing.json").read_text())
    assert missing["Ends"] == "ended with code 7"
    assert "--install" in missing["nobody"]
    with (tmp_path / "out" / "peers.csv").open() as file:
        assert [row["entrant"] for row in csv.DictReader(file)] == list(found)
    said = capsys.readouterr().out
    assert "skipped: nobody (not installed" in said
    assert max(len(line) for line in said.splitlines() if not line.startswith("skipped")) <= 80


@pytest.mark.slow
def test_inverse_dynamics_of_ours_obeys_physics_and_limits_and_is_judged(tmp_path):
    nobody = Entrant("nobody", Package("nobody", "no_such_module", ("nobody==1",)), "a:B")
    (row,) = stand.run(tmp_path / "out", [stand.ENTRANTS[0], nobody], ticks=20)
    assert row["failed"] == 0
    assert row["median_us"] <= row["p95_us"]
    for residual in ("dynamics", "contact", "torque"):
        assert row[f"{residual} max"] < 1e-8
    assert row["friction max"] < 1e-6
    assert row["centre of mass max"] < 1e-8
    missing = json.loads((tmp_path / "out" / "stand-missing.json").read_text())
    assert "--install" in missing["nobody"]


def test_wrong_answers_to_stand_are_found(tmp_path):
    scene, states = make_stand(tmp_path, 2)
    ours, judge = Ours(scene, "hcod"), Judge(scene, states)
    ours.tick(0.0, states["q"][0], states["v"][0], None)
    a, torques, wrenches = ours.answer()
    good = judge.residuals(0, a, torques, wrenches)
    assert max(good[key] for key in ("dynamics", "contact", "torque", "friction")) < 1e-6
    assert judge.residuals(0, a, torques + 1.0, wrenches)["dynamics"] == pytest.approx(1.0)
    assert judge.residuals(0, a, 100.0 * torques, wrenches)["torque"] > 100.0
    sideways = wrenches + 1000.0 * np.eye(6)[0]
    assert judge.residuals(0, a, torques, sideways)["friction"] > 100.0
    twisted = wrenches + 100.0 * np.eye(6)[5]
    assert judge.residuals(0, a, torques, twisted)["friction"] > 10.0
    assert judge.residuals(0, 2.0 * a, torques, wrenches)["posture"] > good["posture"]


def test_the_scene_stand_is_read_as_it_was_written(tmp_path):
    scene, _ = make_stand(tmp_path, 1)
    assert read_stand(tmp_path / "scene.json") == scene


@pytest.mark.slow
def test_a_velocity_beyond_its_limit_is_found(tmp_path):
    (row,) = run(None, [fake("Posture", speed=1.5)], ticks=50)
    assert row["excess_rad_s"] > 0.1


@pytest.mark.slow
def test_who_does_not_survive_a_nan_is_said_to_crash(tmp_path):
    file = tmp_path / "scenes.json"
    write_scenes(make_scenes(tmp_path), file)
    assert after_nan(fake("EndsAfterNan"), file, stage(tmp_path / "staged")) == "crashes, code 7"


@pytest.mark.slow
def test_our_own_stack_is_strict_keeps_limits_and_refuses_a_nan():
    (row,) = run(None, [one for one in ENTRANTS if one.label == "tpm"], ticks=50)
    assert row["moved_m"] < 1e-9
    assert row["excess_rad_s"] < 1e-9
    assert row["failed"] == row["step_failed"] == 0
    assert row["at_limit_ticks"] > 0
    assert row["nan"].startswith("says so")


def test_the_figure_has_a_bar_for_each_that_was_timed():
    row = {"median_us": 5.0, "p95_us": 6.0, "solve_us": None, "moved_m": 1e-17, "step_failed": 0}
    fig = bars([{**row, "entrant": "tpm", "solve_us": 2.0},
                {**row, "entrant": "pink", "moved_m": 1e-6},
                {**row, "entrant": "mink hard", "moved_m": None, "step_failed": 9},
                {**row, "entrant": "tsid", "median_us": None}])
    (ax,) = fig.axes
    assert [label.get_text() for label in ax.get_yticklabels()] == ["tpm", "pink", "mink hard"]
    assert [text.get_text() for text in ax.texts] == [
        "strict", "posture moves it by 1e-06 m a tick", "no answer at the limits"]
