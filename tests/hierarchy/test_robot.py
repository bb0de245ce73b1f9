import numpy as np
import pytest
from pendulum import LIMIT, URDF
from pinned import leaves, read, robot_facts

from hierarchy import HierarchyError, Robot, State
from hierarchy.errors import RobotError, UnknownNameError
from hierarchy.robots import TABLES
from hierarchy.robots.from_table import from_table
from hierarchy.robots.table import Link, TreeJoint, TreeTable

ROBOT = Robot.named("kuka_lwr")

D = [0, 0, 0.4, 0, 0.39, 0, 0.078]
ALPHA = np.deg2rad([90, -90, -90, 90, 90, -90, 0])


def test_a_link_of_a_table_is_what_is_given_of_it():
    """Without anything it has no shape and no mass; with a radius alone it is a ball."""
    bare, ball = (from_table(TreeTable("one joint", (
        TreeJoint("one", "", (0.0, 0.0, 0.0), "z", (-90, 90), 1.0, 1.0, link),), (), "one"))
        for link in (Link(), Link(radius=0.1)))
    assert bare.capsules == ()
    assert bare.model.inertias[1].mass == 0.0
    found = [(capsule.start, capsule.end, capsule.radius) for capsule in ball.capsules]
    assert found == [((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1)]


def from_dh_table(q, joints=7):
    """Placement after so many joints, by multiplying the letter's Denavit-Hartenberg matrices."""
    T = np.eye(4)
    for angle, d, alpha in list(zip(q, D, ALPHA, strict=True))[:joints]:
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        T = T @ [[c, -s * ca, s * sa, 0], [s, c * ca, -c * sa, 0], [0, sa, ca, d], [0, 0, 0, 1]]
    return T


@pytest.mark.slow
def test_kinematics_equal_the_table_multiplied_out():
    frame = ROBOT.frame("end_effector")
    for q in np.random.default_rng(0).uniform(-3, 3, (50, 7)):
        state, T = State.at(ROBOT, q), from_dh_table(q)
        np.testing.assert_allclose(state.position(frame), T[:3, 3], atol=1e-14)
        np.testing.assert_allclose(state.rotation(frame), T[:3, :3], atol=1e-14)


def test_control_points_lie_on_the_upper_arm_and_the_forearm():
    state = State.at(ROBOT, np.linspace(-1, 1, 7))
    elbow, wrist = from_dh_table(state.q, 3)[:3, 3], from_dh_table(state.q, 5)[:3, 3]
    for i, point in enumerate(ROBOT.control_points):
        rotation, translation = state._placement(point.joint)
        here = translation + rotation @ point.offset
        end, other, reach = (elbow, np.zeros(3), 0.2) if i < 4 else (wrist, elbow, 0.39)
        toward = (other - end) / np.linalg.norm(other - end)
        np.testing.assert_allclose(here, end + toward * (i % 4) / 4 * reach, atol=1e-13)


def test_a_state_is_moved_without_making_another():
    state = State.at(ROBOT, np.zeros(7))
    views = [state.J, state.dJ, state.placements]
    state.move(1.0, np.ones(7), np.ones(7))
    fresh = State.at(ROBOT, np.ones(7), np.ones(7))
    for view, name in zip(views, ("J", "dJ", "placements"), strict=True):
        np.testing.assert_array_equal(view, getattr(fresh, name))


@pytest.mark.parametrize(("q", "v", "said"), [
    ([0] * 6, None, "q has shape (6,), expected (7,)"),
    ([0, 0, np.nan, 0, 0, 0, 0], None, "q[2] (joint_3) is nan"),
    ([0] * 7, [0, np.inf, 0, 0, 0, 0, 0], "v[1] (joint_2) is inf"),
])
def test_a_bad_state_is_named(q, v, said):
    with pytest.raises(RobotError) as error:
        State.at(ROBOT, q, v)
    assert said in str(error.value)


@pytest.mark.slow
@pytest.mark.parametrize(("what", "entry", "name"), [
    ("q", 0, "root_joint 1"), ("q", 6, "root_joint 7"), ("q", 7, "left_hip_yaw"),
    ("q", 36, "neck_pitch"), ("v", 5, "root_joint 6"), ("v", 10, "left_ankle_pitch"),
])
def test_an_entry_of_a_floating_robot_is_named_by_its_own_joint(what, entry, name):
    robot = Robot.named("humanoid")
    given = {"q": robot.rest.copy(), "v": np.zeros(robot.n)}
    given[what][entry] = np.nan
    with pytest.raises(RobotError) as error:
        State.at(robot, **given)
    assert f"{what}[{entry}] ({name}) is nan" in str(error.value)


def test_unknown_names_come_with_the_nearest_known():
    with pytest.raises(UnknownNameError, match="did you mean 'kuka_lwr'"):
        Robot.named("kuka_lvr")
    with pytest.raises(UnknownNameError, match="did you mean 'end_effector'"):
        ROBOT.frame("end_efector")
    with pytest.raises(UnknownNameError, match="unknown joint 'elbow'"):
        ROBOT.control_point("elbow", (0, 0, 0))


@pytest.fixture
def pendulum(tmp_path):
    def write(kind="revolute", limit=LIMIT):
        path = tmp_path / f"{kind}.urdf"
        path.write_text(URDF.format(kind=kind, limit=limit))
        return path
    return write


def test_a_urdf_file_is_read_with_its_limits_and_frames(pendulum):
    robot = Robot.from_file(pendulum())
    assert (robot.n, robot.name, robot.joint_names) == (1, "revolute", ("hinge",))
    assert (robot.lower[0], robot.upper[0], robot.velocity_limit[0]) == (-1, 2, 3)
    assert robot.end_effector == "hand"
    p = State.at(robot, [0.5]).position(robot.frame("hand"))
    np.testing.assert_allclose(p, [-np.sin(0.5), 0, -np.cos(0.5)])


def test_bad_robot_files_are_named(tmp_path, pendulum):
    (tmp_path / "broken.urdf").write_text("<robot")
    (tmp_path / "arm.stl").write_text("solid")
    for path, said in [("none.urdf", "does not exist"), ("broken.urdf", "not valid XML"),
                       ("arm.stl", "expected a URDF")]:
        with pytest.raises(HierarchyError, match=said):
            Robot.from_file(tmp_path / path)
    with pytest.raises(HierarchyError, match="unknown frame 'tool'"):
        Robot.from_file(pendulum(), end_effector="tool")


@pytest.mark.parametrize("name", TABLES)
def test_a_shipped_robot_is_the_one_that_recorded_runs_were_made_with(name):
    found, expected = leaves(robot_facts(name)), leaves(read("robots")[name])
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
