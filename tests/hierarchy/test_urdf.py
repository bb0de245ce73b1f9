"""URDF files as users have them: what they mean is read, and what is lost is said."""

import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation
from urdf_text import INERTIAL, LIMIT, joint, link, placed, shape

from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.tasks import Mechanism

CENTRE = np.array([0.1, 0.2, 0.3])
INERTIA = np.array([[0.3, 0.01, 0.02], [0.01, 0.4, 0.03], [0.02, 0.03, 0.5]])
ORIGIN = np.array([1.0, 2.0, 3.0]), Rotation.from_euler("xyz", [0.3, -0.4, 0.5])
PLACED, BALL = placed("1 2 3", "0.3 -0.4 0.5"), shape('<sphere radius="0.1"/>', "0.1 0.2 0.3")


@pytest.fixture
def load(tmp_path):
    def write(*parts, name="r.urdf", root='<robot name="r">', **options):
        path = tmp_path / name
        path.write_text(root + "".join(parts) + "</robot>")
        return Robot.load(path, **options)
    return write


def two_joints(kind, axis="0 1 0", inside=LIMIT):
    """A world, a base on a joint of this kind, and an arm on the base."""
    return (link("world", ""), link("base", INERTIAL + BALL), link("arm"),
            joint("first", kind, "world", "base", inside, axis, PLACED),
            joint("second", "revolute", "base", "arm", origin='<origin xyz="0 0 0.5"/>'))


def placement(robot, q, name):
    state, frame = State.at(robot, q), robot.frame(name)
    return state.position(frame), state.rotation(frame)


@pytest.mark.parametrize("base", [None, "floating"])
def test_a_floating_first_joint_is_the_free_base_or_fixed_at_its_place(load, base):
    robot = load(*two_joints("floating"), base=base)
    assert (robot.base, robot.n, robot.joint_names) == ("floating", 7, ("first", "second"))
    p, R = placement(robot, robot.rest, "base")
    np.testing.assert_allclose(p, ORIGIN[0])
    np.testing.assert_allclose(R, ORIGIN[1].as_matrix(), atol=1e-12)
    robot = load(*two_joints("floating"), base="fixed")
    assert (robot.base, robot.joint_names) == ("fixed", ("second",))
    p, R = placement(robot, [0.0], "arm")
    np.testing.assert_allclose(p, ORIGIN[0] + ORIGIN[1].apply([0.0, 0.0, 0.5]))
    np.testing.assert_allclose(R, ORIGIN[1].as_matrix(), atol=1e-12)


def test_a_second_joint_with_the_name_of_a_free_base_is_refused(load):
    parts = link("a"), link("b"), joint("root_joint", "revolute", "a", "b")
    assert load(*parts).n == 1
    refused("root_joint", load, *parts, base="floating", error=RobotError)


def motion_of(robot, q, along):
    """Pose of the base in the frame of the planar joint's origin, with axes `along` of q 1, 2."""
    return along.T @ q[:2], Rotation.from_rotvec(np.arctan2(q[3], q[2]) * np.cross(*along))


@pytest.mark.parametrize("axis", ["1 0 0", "0 1 0", "0 0 1", "0 0 -1", "1 -2 3", ""])
def test_a_planar_joint_moves_in_the_plane_normal_to_its_axis(load, axis):
    robot = load(*two_joints("planar", axis, ""))
    normal = np.array((axis or "1 0 0").split(), dtype=float)
    normal /= np.linalg.norm(normal)
    home = placement(robot, [0.0, 0.0, 1.0, 0.0, 0.0], "base")
    np.testing.assert_allclose(home[0], ORIGIN[0])
    np.testing.assert_allclose(home[1], ORIGIN[1].as_matrix(), atol=1e-12)
    along = np.array([ORIGIN[1].inv().apply(placement(robot, [*e, 1, 0, 0], "base")[0] - ORIGIN[0])
                      for e in np.eye(2)])
    np.testing.assert_allclose(along @ along.T, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(np.cross(*along), normal, atol=1e-12)
    q = np.array([0.4, -0.7, np.cos(0.6), np.sin(0.6), 0.2])
    p, turned = motion_of(robot, q, along)
    second = turned * Rotation.from_rotvec([0.0, 0.2, 0.0])
    held = load(*two_joints("planar", axis, ""), locked={"first": q[:4]})
    for name, place, R in (("base", p, turned), ("first", p, turned),
                           ("arm", p + turned.apply([0.0, 0.0, 0.5]), second)):
        for found in (placement(robot, q, name), placement(held, q[4:], name)):
            np.testing.assert_allclose(found[0], ORIGIN[0] + ORIGIN[1].apply(place), atol=1e-12)
            np.testing.assert_allclose(found[1], (ORIGIN[1] * R).as_matrix(), atol=1e-12)


def test_masses_and_shapes_on_a_planar_joint_are_where_the_file_has_them(load):
    robot, h = load(*two_joints("planar", "1 -2 3", "")), 1e-6
    along = np.array([ORIGIN[1].inv().apply(placement(robot, [*e, 1, 0, 0], "base")[0] - ORIGIN[0])
                      for e in np.eye(2)])
    q, v = robot.integrate([0, 0, 1, 0, 0], [0.4, -0.7, 0.6, 0.2]), np.array([0.3, 0.5, -0.8, 0.9])

    def bodies(q):
        p, R = motion_of(robot, q, along)
        arm = R * Rotation.from_rotvec([0.0, q[4], 0.0])
        return ((p + R.apply(CENTRE), R), (p + R.apply([0.0, 0.0, 0.5]) + arm.apply(CENTRE), arm))

    energy = 0.0
    for (later, R2), (before, R1) in zip(bodies(robot.integrate(q, h * v)),
                                         bodies(robot.integrate(q, -h * v)), strict=True):
        speed, turning = (later - before) / (2 * h), (R1.inv() * R2).as_rotvec() / (2 * h)
        energy += speed @ speed + turning @ INERTIA @ turning / 2  # of 2 kg
    state = State.at(robot, q, v)
    assert v @ state.dynamics.M @ v / 2 == pytest.approx(energy, rel=1e-8)
    ball = robot.capsules[0]
    R, p = state._placement(ball.joint)
    np.testing.assert_allclose(p + R @ ball.start,
                               ORIGIN[0] + ORIGIN[1].apply(bodies(q)[0][0]), atol=1e-12)


@pytest.mark.parametrize(("changed", "said"), [
    ({"arm": INERTIAL.replace("0.4", "1.4")}, "inertias of arm: a principal moment is larger than"),
    ({"limit": LIMIT + '<dynamics damping="0" friction="0.1"/>'},
     "friction of joints: not in the equations of motion"),
    ({"arm": '<collision><geometry><sphere/></geometry></collision>'},
     "collision of arm cannot be read: Sphere shape must have a radius"),
    ({"arm": INERTIAL.replace("0.4", "${x}")}, "the macros ${x} stand for is not in the robot"),
    ({"more": '<xacro:gripper side="left"/>'}, "the macros <xacro:gripper> stand for"),
    ({"more": '<x:gripper xmlns:y="" side="left"/>', "root": ' xmlns:x="http://wiki.ros.org/xacro"'},
     "the macros <x:gripper> stand for"),
    ({"limit": '<limit lower="-1" upper="1" velocity="2"/>'}, "effort limits of only:"),
    ({"limit": '<limit velocity="2" effort="3"/>'}, "joints only do not move"),
    ({"limit": LIMIT.replace("-1", "0") + '<mimic joint="last" multiplier="-1"/>',
      "more": link("tip") + joint("last", "revolute", "arm", "tip", LIMIT.replace("-1", "0"))},
     "joints last do not move"),
    ({"more": '<gazebo><joint name="x" type="revolute"/></gazebo><loop_joint name="y"/>'},
     "joints of Gazebo, or that close a loop, x, y: left out"),
    ({"limit": LIMIT + '<safety_controller soft_upper_limit="0.5"/>'}, "soft limits of only:"),
    ({"kind": "continuous"}, "position limits of only: a continuous joint has none"),
    ({"more": link("tip", "") + joint("last", "continuous", "arm", "tip", "")},
     "masses beyond last: none, so torques do not hold these joints"),
    ({"more": link("only") + joint("x", "fixed", "base", "only", "", "")}, "frames called only:")])
def test_what_a_robot_is_without_is_said(load, changed, said):
    given = {"arm": INERTIAL, "more": "", "root": "", "limit": LIMIT, "kind": "revolute",
             "axis": "0 1 0", **changed}
    robot = load(link("base"), link("arm", given["arm"]),
                 joint("only", given["kind"], "base", "arm", given["limit"], given["axis"]),
                 given["more"], root=f'<robot name="r"{given["root"]}>')
    assert [sentence for sentence in robot.missing if said in sentence], robot.missing


def test_threads_that_read_files_leave_the_standard_error_where_it_was(load):
    before, parts = os.fstat(2), (link("a"), link("b"), joint("j", "revolute", "a", "b"))
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(lambda i: load(*parts, name=f"{i}.urdf").missing, range(200)))
    assert os.path.samestat(os.fstat(2), before)
    assert found == 200 * [()]


@pytest.mark.skipif(not hasattr(os, "memfd_create"), reason="a temporary file takes its place")
def test_a_file_is_read_without_a_folder_to_write_to_and_without_a_standard_error(
        load, monkeypatch):
    """In a read-only container, and with `2>&-`, both raised errors of Python."""
    monkeypatch.setattr(tempfile, "tempdir", "/nowhere")
    monkeypatch.setattr(sys, "stderr", None)
    assert load(*two_joints("revolute")).n == 2


def test_what_the_parser_refuses_and_can_only_mean_one_thing_is_read(load):
    given = INERTIAL.replace('iyy="0.4"', 'iyy="0.4\n"').replace(' ixy="0.01"', "")
    seen = "<visual><geometry><blob/></geometry></visual>"
    robot = load(link("base"), link("arm", given + seen + BALL),
                 joint("only", "revolute", "base", "arm",
                       '<limit upper="1"/><dynamics friction="0"/>'),
                 2 * '<material name="grey"><color rgba="1 1 1 1"/></material>')
    np.testing.assert_allclose(robot.bodies()[0].inertia,
                               INERTIA - [[0.0, 0.01, 0.0], [0.01, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert (robot.lower, robot.upper, len(robot.capsules)) == (0.0, 1.0, 1)
    assert np.isinf([*robot.velocity_limit, *robot.effort_limit]).all()
    assert not [sentence for sentence in robot.missing if "cannot be read" in sentence]


@pytest.mark.parametrize(("most", "rest"), [(2, 0.0), (1, -0.55), (-1, 0.0)])
def test_what_follows_a_joint_does_so_at_rest_within_its_limits_if_it_can(most, rest, load):
    at = "<limit lower='{}' upper='{}' velocity='1' effort='1'/><mimic joint='{}' offset='0.7'/>"
    robot = load(*map(link, "abcd"),
                 joint("third", "revolute", "a", "b", at.format(-2, most, "second")),
                 joint("second", "revolute", "b", "c", at.format(0, 2, "first")),
                 joint("first", "revolute", "c", "d"))
    assert robot.values(robot.rest) == pytest.approx(
        {"first": rest, "second": rest + 0.7, "third": rest + 1.4})
    np.testing.assert_allclose(Mechanism(robot).closed(robot.rest), robot.rest)


def test_a_name_at_two_places_is_refused_where_it_is_asked_for(load):
    parts = (*map(link, ("base", "wrist", "tool")), joint("mount", "revolute", "wrist", "tool"),
             joint("tool", "fixed", "base", "wrist", "", "", PLACED))
    robot = load(*parts)
    refused("2 frames are called 'tool', a fixed joint fixed to the world and a link on the body of"
            " joint 'mount'", robot.frame, "tool", error=RobotError)
    assert "tool" not in robot.frame_names
    assert robot.end_effector == "mount", "not the tool, which is two"
    parts = (*map(link, ("base", "gripper", "last")), joint("far", "revolute", "gripper", "last"),
             joint("tool", "revolute", "base", "gripper"))
    assert load(*parts).end_effector == "gripper", "neither a joint nor the last link"
