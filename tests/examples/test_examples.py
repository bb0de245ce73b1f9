"""The examples run, and print what they promise: strict levels beside how it is done otherwise."""

import sys
from pathlib import Path
from runpy import run_path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from hierarchy import State
from scenarios import load, simulate
from scenarios.cell.build import build

EXAMPLES = Path(__file__).parents[2] / "examples"
# Seconds of the run; at most this with strict levels, and at least that otherwise [mm, deg, ...].
PROMISES = {"humanoid": (1.8, 0.6, 2.5), "iiwa": (1.2, 0.3, 0.9), "mobile": (1.2, 0.5, 1.5),
            "panda": (1.2, 0.1, 0.9), "policy": (1.5, 0.6, 100.0), "quadruped": (1.0, 1.0, 1.5),
            "retarget": (0.1, 0.12, 5.0), "so101": (0.8, 0.1, 4.5),
            "teleop": (1.5, 15.001, 100.0), "wall": (1.6, 0.01, 100.0)}


@pytest.mark.parametrize("name", PROMISES)
def test_an_example_keeps_what_it_promises_where_the_other_way_does_not(name, capsys):
    duration, most, least = PROMISES[name]
    strict, other = run_path(str(EXAMPLES / f"{name}.py"))["main"](duration)
    assert strict <= most
    assert other >= least
    assert len(capsys.readouterr().out.splitlines()) == 1


EQUAL = ["control.resolver=weighted", "control.options.ratio=1", "control.damping=0"]


def test_the_ur5_keeps_clear_of_the_ball_and_of_itself_and_with_equal_weights_does_not():
    strict, equal = (simulate(load(EXAMPLES / "ur5.toml", changes)) for changes in ([], EQUAL))
    assert min(strict["minimal_distance"].min(), strict["ee_distance"].min()) > 0.0499
    cell = build(strict.scenario)
    links = [cell.stack["self-separation"].distances(State.at(cell.robot, q)).min()
             for q in strict["q"][::20]]
    assert 0.0349 < min(links) < 0.036  # and it comes so near
    assert equal["ee_distance"].min() < -0.05


def test_two_hands_hold_their_tray_and_with_equal_weights_do_not():
    strict, equal = (simulate(load(EXAMPLES / "tray.toml", ["control.duration=2", *changes]))
                     for changes in ([], EQUAL))
    apart = [np.linalg.norm(run["task_error_grip"][:, :3], axis=1).max() for run in (strict, equal)]
    assert apart[0] < 0.002
    assert apart[1] > 0.05


class Node:
    """A node of ROS 2 whose parameters are the defaults, but for the robot."""

    def __init__(self, name):
        self.get_logger = self.create_subscription = self.create_timer = MagicMock()
        self.create_publisher, self.get_clock = MagicMock(), MagicMock()

    def declare_parameter(self, name, default):
        given = {"urdf": str(EXAMPLES / "robots" / "iiwa14.urdf"), "end_effector": "tool0"}
        return SimpleNamespace(value=given.get(name, default))


def test_the_ros2_node_sends_zeros_on_bad_readings_and_ignores_bad_goals(monkeypatch):
    for name in ("rclpy", "rclpy.node", "rclpy.qos", "geometry_msgs.msg", "sensor_msgs.msg",
                 "std_msgs.msg"):
        monkeypatch.setitem(sys.modules, name, MagicMock())
    sys.modules["rclpy.node"].Node = Node
    sys.modules["std_msgs.msg"].Float64MultiArray = lambda data: data
    node = run_path(str(EXAMPLES / "ros2_node.py"))["TaskHierarchyNode"]()
    clock, names = node.get_clock.return_value.now, node.robot.joint_names
    clock.return_value.nanoseconds = 0
    clock.return_value.__sub__.return_value.nanoseconds = 0

    def sent(joints, goal=None):
        node.on_joints(SimpleNamespace(name=names, position=[joints] * 7))
        if goal is not None:
            node.on_goal(SimpleNamespace(point=SimpleNamespace(x=goal, y=0.2, z=0.4)))
        node.tick()
        return np.abs(node.commands.publish.call_args[0][0]).max()

    node.on_joints(SimpleNamespace(name=names, position=[np.nan] * 7))
    node.tick()
    node.commands.publish.assert_not_called()
    assert sent(0.2) < 1e-9
    assert sent(0.2, goal=0.5) > 0.01
    assert sent(0.2, goal=np.nan) > 0.01
    assert sent(np.nan) == 0.0
    clock.return_value.__sub__.return_value.nanoseconds = 10**9
    assert sent(0.2) == 0.0
