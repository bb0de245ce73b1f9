import numpy as np
import pytest
from pinned import leaves, read, robot_facts

from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.robots import TABLES

ROBOT = Robot.named("kuka_lwr")

D = [0, 0, 0.4, 0, 0.39, 0, 0.078]
ALPHA = np.deg2rad([90, -90, -90, 90, 90, -90, 0])


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


@pytest.mark.parametrize(("robot", "what", "entry", "name"), [
    ("kuka_lwr", "q", 2, "joint_3"), ("kuka_lwr", "v", 1, "joint_2"),
    ("humanoid", "q", 0, "root_joint 1"), ("humanoid", "q", 6, "root_joint 7"),
    ("humanoid", "q", 7, "left_hip_yaw"), ("humanoid", "q", 36, "neck_pitch"),
    ("humanoid", "v", 5, "root_joint 6"), ("humanoid", "v", 10, "left_ankle_pitch")])
def test_an_entry_that_is_not_finite_is_named_by_its_own_joint(robot, what, entry, name):
    robot = Robot.named(robot)
    given = {"q": robot.rest.copy(), "v": np.zeros(robot.n)}
    for value in (np.nan, np.inf):
        given[what][entry] = value
        with pytest.raises(RobotError) as error:
            State.at(robot, **given)
        assert f"{what}[{entry}] ({name}) is {value}" in str(error.value)


@pytest.mark.parametrize("name", TABLES)
def test_a_shipped_robot_is_the_one_that_recorded_runs_were_made_with(name):
    found, expected = leaves(robot_facts(name)), leaves(read("robots")[name])
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
