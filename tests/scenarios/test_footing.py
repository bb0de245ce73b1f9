"""What a first tick says of a robot with contacts whose run may fall, or prove nothing."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from urdf_text import INERTIAL, LIMIT, joint, link, placed, shape, urdf

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.cli.check import checked
from scenarios.loop.controller import Controller
from scenarios.loop.footing import footing
from scenarios.scene.drawn import scene

DATA = Path(__file__).parents[1] / "data"
pytestmark = pytest.mark.usefixtures("with_mujoco")


def said(scenario, change=lambda robot: None):
    cell = build(scenario)
    change(cell.robot)
    controller = Controller(scenario, cell)
    controller.command(0.0, cell.plant.q, cell.plant.v)
    return list(footing(controller))


def of_strong_drives(robot):
    robot.effort_limit[robot.actuated:] *= 1000.0


def of_a_thin_shank(robot):
    knee = robot.joint("left_knee")
    robot.model.inertias[knee] = pin.Inertia(3.0, np.zeros(3), np.diag([0.03, 0.01, 0.01]))


def of_a_motor_without_limit(robot):
    robot.effort_limit[robot.velocity_names.index("left_knee")] = np.inf


LEFT = {"frame": "left_foot", "x": [-0.05, 0.16], "y": [-0.04, 0.04]}
CASES = {
    "no effort limit": (of_a_motor_without_limit, "does not limit left_knee"),
    "effort limits that say nothing": (of_strong_drives, "it holds the robot, whatever"),
    "an inertia that no body has": (of_a_thin_shank, "no body has the inertia that moves with "
                                    "left_knee")}


@pytest.mark.parametrize("case", CASES)
def test_what_a_robot_lacks_that_may_make_a_run_fall_or_prove_nothing_is_said(case):
    change, words = CASES[case]
    assert words in " ".join(said(load("stand-push"), change))


def test_without_gravity_nothing_has_to_stand():
    scenario = load("stand-push").with_changes({"contacts": [LEFT]})
    assert "stand" not in " ".join(said(
        scenario, lambda robot: setattr(robot.model.gravity, "linear", np.zeros(3))))


def a_biped(folder):
    """Keys of a scenario with two legs of five joints, bent."""
    file = folder / "biped.xml"
    file.write_text((DATA / "robots" / "biped.xml.txt").read_text())
    bent = {f"{side}_{name}": value for side in "lr"
            for name, value in (("pitch", -0.4), ("knee", 0.8), ("foot", -0.4))}
    contacts = [{"frame": f"{side}_foot", "x": [-0.1, 0.1], "y": [-0.05, 0.05]} for side in "lr"]
    return {"robot": {"model": str(file)}, "contacts": contacts,
            "start": {"on_floor": True, "joints": bent}, "plant.pushes": [],
            "tasks": [{"kind": "com"}, {"kind": "posture"}, {"kind": "least-force"}]}


def test_feet_that_hold_each_other_in_a_symmetric_pose_are_said(tmp_path):
    keys = a_biped(tmp_path)
    words = "1 of 18 rows that hold the contacts depend on the others"
    for place in ("stack", "bounds"):
        changed = {**keys, "limits.place": place}
        assert words in " ".join(said(load("stand-push").with_changes(changed)))
    keys["start"]["joints"] |= {"l_yaw": 0.2, "r_yaw": -0.2}
    assert words not in " ".join(said(load("stand-push").with_changes(keys)))


def test_a_robot_that_is_put_on_the_floor_is_carried_from_the_first_tick_on():
    """Rounding decided: the quadruped's knees were at 2.2 rad/s before a contact carried."""
    cell = build(load("crawl"))
    controller = Controller(cell.scenario, cell)
    cell.plant.act(controller.command(0.0, cell.plant.q, cell.plant.v))
    assert cell.plant.extra["floor_force"][:, 2].min() > 1.0
    assert np.abs(cell.plant.v[6:]).max() < 0.2


def test_a_body_without_joints_stands_too(tmp_path):
    (tmp_path / "brick.urdf").write_text(urdf(link("trunk")))
    sole = {"frame": "trunk", "x": [-0.4, 0.4], "y": [-0.4, 0.4], "offset": [0.0, 0.0, -0.1]}
    scenario = load("stand-push", {
        "robot": {"model": str(tmp_path / "brick.urdf"), "base": "floating"}, "contacts": [sole],
        "start": {"on_floor": True}, "tasks": [{"kind": "com"}], "plant.pushes": [],
        "control.duration": 0.005})
    assert not said(scenario)
    (torque,) = (one.value for one in scene(simulate(scenario)).series if "torque" in one.name)
    assert (torque == 0.0).all()


FOLDED = LIMIT.replace('"-1"', '"-2.7"').replace('"1"', '"-0.9"')  # its middle turns a knee down


def test_a_robot_stands_on_the_ends_of_its_legs_not_on_its_knees(tmp_path):
    legs = [part for side in "lr" for part in (
        link(f"{side}_thigh"), joint(f"{side}_hip", "revolute", "trunk", f"{side}_thigh"),
        link(f"{side}_shank"), joint(f"{side}_knee", "revolute", f"{side}_thigh", f"{side}_shank",
                                     FOLDED, origin=placed("0 0 -0.2")),
        link(f"{side}_foot", ""), joint(f"{side}_end", "fixed", f"{side}_shank", f"{side}_foot", "",
                                        "", placed("0 0 -0.2")))]
    (tmp_path / "legs.urdf").write_text(urdf(link("trunk"), *legs))
    found, _ = checked(str(tmp_path / "legs.urdf"), ["robot.base=floating"])
    assert found["lowest_frames"] == ["l_foot", "r_foot"]


def test_a_base_that_is_lower_than_what_it_carries_stands_itself(tmp_path):
    ball = INERTIAL + shape('<sphere radius="0.1"/>')
    (tmp_path / "arm.urdf").write_text(urdf(link("base", ball), link("arm", ball), joint(
        "turn", "revolute", "base", "arm", origin=placed("0 0 1"))))
    found, _ = checked(str(tmp_path / "arm.urdf"), ["robot.base=floating"])
    assert found["lowest_frames"] == ["base"]
    assert [one["joint"] for one in found["capsules"]] == [None, "turn"]
