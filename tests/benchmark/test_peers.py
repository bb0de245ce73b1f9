"""Other packages: the same robots, known answers of each adapter, fair judgement."""

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from benchmark.packages import PACKAGES, Entrant, MissingError, Package, python_of
from benchmark.peers import reaching, standing
from benchmark.peers.adapters.hierarchy import stand
from benchmark.peers.compare import joined
from benchmark.peers.moving import ENTRANTS, QUESTIONS, START, make_scenes, run
from benchmark.peers.urdf import urdf
from benchmark.process import Field
from benchmark.solve import entrants as solvers_
from benchmark.solve import open as solve
from benchmark.worker import load
from hierarchy import Hierarchy, Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import Pose, Position
from solvers.problems.files import Collection, Head

ROOT = Path(__file__).parents[2]
NOBODY = Entrant("nobody", Package("nobody", "no_such_module", ("nobody==1",)), "a:B")


def fake(name, **options):
    return Entrant(name, Package("numpy", "numpy"), f"fake_peers:{name}", options)


def answered(entrant, questions, *calls):
    """The answers of an entrant, in a process of its own only where it needs another Python."""
    try:
        if python_of(entrant.package) == sys.executable:
            asked = load(questions)(load(entrant.adapter), dict(entrant.options))
            return [getattr(asked, method)(*arguments) for method, *arguments in calls]
    except MissingError as why:
        pytest.skip(f"{entrant.label}: {why}")
    with Field([entrant], questions) as field:
        return [field.running[entrant.label].ask(call, 120.0) for call in calls]


# -- known answers ---------------------------------------------------------------------------------
def each(entrants):
    every = pytest.mark.parametrize("entrant", entrants, ids=[one.label for one in entrants])
    return lambda test: pytest.mark.filterwarnings("ignore")(every(test))  # of packages


def wanted(scene, weight, rows=3):
    """The v that minimises |v - posture's|^2 + weight |J v - position's|^2; strict if infinite.

    The posture acts in the null space of this many rows of the frame's Jacobian.
    """
    robot = Robot.from_file(scene.file, scene.frame)
    state = State.at(robot, scene.start)
    J = Position(robot.frame(scene.frame), Still((0.0, 0.0, 0.0))).jacobian(state)
    x = scene.gain * (np.array(scene.centre) - state.position(robot.frame(scene.frame)))
    v = scene.posture_gain * (np.array(scene.posture) - scene.start)
    if rows == 6:
        whole = Pose(robot.frame(scene.frame), Still((0.0, 0.0, 0.0)), np.eye(3)).jacobian(state)
        v = v - np.linalg.pinv(whole) @ (whole @ v)
    return v + J.T @ np.linalg.solve(J @ J.T + np.eye(3) / weight, x - J @ v)


@each(ENTRANTS)
def test_an_adapter_of_the_arm_gives_the_known_velocity(entrant, tmp_path):
    """With a goal 1 cm and a posture 0.1 rad away, which no limit keeps back."""
    scene, here = make_scenes(tmp_path)["step"], State.at(Robot.named("kuka_lwr"), START)
    goal = np.add(here.position(here.robot.frame("end_effector")), [0.006, -0.008, 0.0])
    posture = np.add(START, [0.1, -0.1, 0.1, 0.1, -0.1, 0.1, -0.1])
    near = replace(scene, centre=tuple(goal.tolist()), posture=tuple(posture.tolist()))
    *_, reply = answered(entrant, QUESTIONS, ("open", asdict(near)), ("turn", 1, 0))
    log = joined([reply])
    assert not log["failed"][0], reply["why"]
    known = wanted(near, np.inf), wanted(near, near.ratio**2), wanted(near, np.inf, 6)
    off = min(abs(log["v"][0] - v).max() for v in known)
    assert off < (2e-2 if entrant.label == "embodiK" else 5e-4)  # it damps; others linearise poses


@each(standing.ENTRANTS)
def test_an_adapter_of_the_humanoid_obeys_the_equations_of_motion(entrant, tmp_path):
    scene = standing.make_scene(tmp_path)
    states = standing.followed(scene, 1)
    asked = {key: values.tolist() for key, values in states.items()}
    log = joined(answered(entrant, standing.QUESTIONS, ("open", asdict(scene), asked),
                          ("turn", 1, 0))[1:])
    assert not log["failed"][0]
    a, torques, wrenches = (log[key][0] for key in ("a", "torques", "wrenches"))
    found = standing.Judge(scene, states).residuals(0, a, torques, wrenches)
    assert max(found[key] for key in ("dynamics", "contact", "torque")) < 1e-6


@each(reaching.ENTRANTS)
def test_an_adapter_of_whole_inverse_kinematics_reaches_a_pose_that_was_taken(entrant, tmp_path):
    robot, file = Robot.named("kuka_lwr"), tmp_path / "arm.urdf"
    file.write_text(urdf(robot))
    read, frames = Robot.from_file(file, robot.end_effector), (robot.end_effector,)
    poses, starts = reaching.problems(read, frames, 1, 0, True)
    (found,) = answered(entrant, reaching.QUESTIONS, (
        "problem", [str(file), frames, reaching.TOLERANCE], poses[0].tolist(), starts[0].tolist()))
    assert found["met"]
    assert reaching.error(read, frames, np.array(found["q"]), poses[0]) < 2.0 * reaching.TOLERANCE


OTHERS = [one for one in solvers_.ENTRANTS if not one.adapter.endswith(":Ours")]


@each(OTHERS)
def test_an_adapter_of_a_solver_gives_the_known_answer(entrant, tmp_path):
    """x1 = 1 above x1 + x2 = 3; of limits above, where they can be asked, one acts: x2 <= 1."""
    limits = (np.eye(2), [-9.0, -9.0], [9.0, 1.0])
    tasks = [([[1.0, 0.0]], [1.0]), ([[1.0, 1.0]], [3.0])]
    made = [Hierarchy.from_levels(tasks), Hierarchy.from_levels([limits, *tasks])]
    file = tmp_path / "known.npz"
    Collection(Head("known", "", "fresh", 1), tuple(made)).save(file)
    equal, limited = answered(entrant, solve.QUESTIONS, *(("problem", str(file), p)
                                                          for p in (0, 1)))
    np.testing.assert_allclose(equal["x"], [1.0, 2.0], atol=2e-3)
    if limited.get("refused"):
        assert limited["refused"] == "equalities only"
    elif limited["solved"]:  # a cascade may find a program infeasible, and then says so
        np.testing.assert_allclose(limited["x"], [1.0, 1.0], atol=2e-3)


def test_every_package_has_an_adapter_that_is_tested():
    every = (*ENTRANTS, *standing.ENTRANTS, *reaching.ENTRANTS, *OTHERS)
    assert {one.package for one in every} >= set(PACKAGES)


# -- the scenes and their judges -------------------------------------------------------------------
def test_everybody_is_judged_or_named_with_the_reason(tmp_path, monkeypatch):
    """Of those that the tests bring alone."""
    monkeypatch.setattr("benchmark.packages.folder_of",
                        lambda package: tmp_path / "cache" / package.name)
    monkeypatch.setenv("PYTHONPATH", f"{ROOT / 'tests' / 'helpers'}:{ROOT}")
    found = run([fake("posture"), fake("lost"), fake("ends"), NOBODY], ticks=1100)
    good, lost = found.rows["peers"]
    assert (good["entrant"], lost["entrant"]) == ("posture", "lost")
    assert good["median_us"] <= good["p95_us"] <= good["p99.9_us"]
    assert (good["ticks"], good["fails"], good["excess_rad_s"]) == (1100, "0/0", 0.0)
    assert good["moved_m"] > 1e-4  # a posture with nothing above it moves the end effector
    assert good["nan"] == lost["nan"] == "an answer with NaN"
    assert lost["step_failed"] == 2000
    assert "not finite" in lost["why"]
    assert found.missing["ends"] == "ended with code 7"
    assert "--install" in found.missing["nobody"]
    found.write(tmp_path / "out")
    assert json.loads((tmp_path / "out" / "missing.json").read_text()) == found.missing
    assert (tmp_path / "out" / "peers.csv").is_file()


def test_a_package_without_an_answer_is_in_the_tables_of_stand(monkeypatch, capsys):
    monkeypatch.setattr(standing, "TICKS", 1)
    monkeypatch.setattr(standing, "measure", lambda *_: ([{"entrant": "lost", "failed": 1}], {}))
    standing.run().say()
    assert "lost" in capsys.readouterr().out


def test_a_package_that_ends_at_every_pose_has_a_row_without_numbers():
    row = reaching.judge([{"ended": "crashed"}], Robot.named("kuka_lwr"), ("end_effector",),
                         np.zeros((1, 1, 4, 4)))
    assert row == {"reached %": 0.0}


def test_unreachable_poses_are_beyond_the_arm_however_few_there_are():
    robot = Robot.named("kuka_lwr")
    one, many = (reaching.problems(robot, ("end_effector",), count, 0, False)[0]
                 for count in (1, 1000))
    assert (len(one), len(many)) == (1, 1000)
    np.testing.assert_array_equal(one[0], many[0])


def test_wrong_answers_to_stand_are_found(tmp_path):
    scene = standing.make_scene(tmp_path)
    states = standing.followed(scene, 2)
    (tick, _), judge = stand(scene, "hcod"), standing.Judge(scene, states)
    a, torques, wrenches = tick(0.0, states["q"][0], states["v"][0], None)()
    good = judge.residuals(0, a, torques, wrenches)
    assert max(good[key] for key in ("dynamics", "contact", "torque", "friction")) < 1e-6
    for wrong, key, least in (((a, torques + 1.0, wrenches), "dynamics", 0.99),
                              ((a, 100.0 * torques, wrenches), "torque", 100.0),
                              ((a, torques, wrenches + 1000.0 * np.eye(6)[0]), "friction", 100.0),
                              ((a, torques, wrenches + 100.0 * np.eye(6)[5]), "friction", 10.0),
                              ((2.0 * a, torques, wrenches), "posture", good["posture"])):
        assert judge.residuals(0, *wrong)[key] > least
