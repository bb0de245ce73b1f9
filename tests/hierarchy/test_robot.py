import numpy as np
import pytest
from pinned import leaves, read, robot_facts

from hierarchy import Robot, State
from hierarchy.errors import RobotError
from hierarchy.robots import TABLES


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
