"""Drives, stops and touching links of a robot with torque motors, and whether it stands."""

from types import SimpleNamespace

import numpy as np
import pytest

from hierarchy import Robot
from hierarchy.contacts import Contacts
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config.kinds.torque import TorqueSection
from scenarios.measure.forces import standing

pytest.importorskip("mujoco")


def plant(**keys):
    robot = Robot.named("dual_arm")
    q = robot.configuration(np.zeros(robot.n))
    return robot, TorqueRobot(robot, Contacts(robot, ()), q, section=TorqueSection(
        kind="torque", beyond_stop=1e3, fall=1e3, tilt=3.0, **keys))


def driven(one, torque, seconds):
    for _ in range(round(seconds / 0.001)):
        one.act(torque)
    return one


def test_a_joint_stops_at_its_limit_unless_it_has_no_stop():
    robot, with_stops = plant()
    _, without = plant(stops=False)
    torque = np.zeros(robot.n)
    torque[2] = 20.0
    limit = robot.upper[2]
    assert driven(with_stops, torque, 2.0).q[2] < limit + 0.1
    assert driven(without, torque, 2.0).q[2] > limit + 0.5


def test_torques_follow_with_the_bandwidth_of_the_motors():
    robot, slow = plant(bandwidth=5.0)
    asked = np.zeros(robot.n)
    asked[0] = 10.0
    first = slow.data.ctrl[0]
    driven(slow, asked, 1.0 / (2.0 * np.pi * 5.0))
    assert slow.data.ctrl[0] - first == pytest.approx((10.0 - first) * (1.0 - np.exp(-1.0)),
                                                      rel=0.05)


def test_links_that_touch_are_pushed_apart_and_those_that_overlap_at_the_start_are_not():
    _, touching = plant(self_collision=True)
    _, passing = plant()
    assert touching.model.npair > passing.model.npair == 0
    assert touching.data.ncon == 0


def recorded(**changes):
    t = np.arange(0.0, 5.0, 0.01)
    signals = {"t": t, "v": np.zeros((t.size, 2)), "q": np.zeros((t.size, 2)),
               "com": np.tile([0.0, 0.0, 0.8], (t.size, 1)), "support_margin": np.full(t.size, 0.1),
               "joint_lower": np.full(2, -1.0), "joint_upper": np.full(2, 1.0), **changes}
    scenario = SimpleNamespace(control=SimpleNamespace(duration=5.0),
                               plant=SimpleNamespace(pushes=()))

    class Run(dict):
        pass

    run = Run(signals)
    run.scenario, run.ticks, run.fault = scenario, t.size, None
    return run


def test_a_robot_stands_only_at_rest_upright_and_within_its_limits_until_the_end():
    assert standing(recorded())
    late = np.zeros((500, 2))
    late[400] = 0.3
    assert not standing(recorded(v=late))
    assert standing(recorded(v=np.roll(late, -300, axis=0)))
    assert not standing(recorded(q=np.full((500, 2), 1.1)))
    assert not standing(recorded(support_margin=np.full(500, np.nan)))
    sunk = recorded()["com"]
    sunk[300:, 2] -= 0.1
    assert not standing(recorded(com=sunk))
    fallen = recorded()
    fallen.fault = "the robot has fallen"
    assert not standing(fallen)
    short = recorded()
    short.scenario.plant.pushes = (SimpleNamespace(at=2.9, duration=0.2),)
    assert standing(short) is None
