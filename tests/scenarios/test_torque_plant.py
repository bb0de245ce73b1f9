"""A humanoid in MuJoCo with torque motors: its physics is that of the robot's model."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from standing import ROBOT, feet

from hierarchy import Robot, State
from hierarchy.contacts import Contacts
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import ScenarioError
from scenarios.config.plant import PushSection, TorqueSection
from scenarios.measure.forces import standing

pytestmark = pytest.mark.usefixtures("with_mujoco")

CONTACTS = feet()


def plant_with(**section):
    return TorqueSection(kind="torque", **section)


def in_the_air(seed):
    rng = np.random.default_rng(seed)
    q = pin.integrate(ROBOT.model, ROBOT.rest, 0.3 * rng.normal(size=ROBOT.n))
    q[2] += 2.0
    return q, rng.normal(size=ROBOT.n), 5.0 * rng.normal(size=30)


@pytest.mark.parametrize("seed", range(2))
def test_without_contact_it_accelerates_as_the_robots_model(seed):
    """Bodies without mass get 1 mg there, and that is the difference."""
    q, v, torques = in_the_air(seed)
    expected = pin.aba(ROBOT.model, ROBOT.model.createData(), q, v,
                       np.concatenate([np.zeros(6), torques]))
    found = TorqueRobot(ROBOT, CONTACTS, q, v).accelerations(torques)
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def test_torques_arrive_late_by_the_delay_and_are_cut_off_at_their_limits():
    q, v, _ = in_the_air(8)
    plant = TorqueRobot(ROBOT, CONTACTS, q, v, section=plant_with(delay=0.002))
    holding = State.at(ROBOT, q).bias_effort()[6:]
    asked = np.full(30, 1e4)
    sent = []
    for _ in range(4):
        plant.act(asked)
        sent.append(plant.data.actuator_force.copy())
    np.testing.assert_allclose(sent[0], np.clip(holding, -ROBOT.effort_limit[6:],
                                                ROBOT.effort_limit[6:]))
    np.testing.assert_array_equal(sent[0], sent[1])
    np.testing.assert_allclose(sent[2], ROBOT.effort_limit[6:])
    with pytest.raises(ScenarioError, match=r"plant.delay = 0.0015 s is not a whole number"):
        TorqueRobot(ROBOT, CONTACTS, q, section=plant_with(delay=0.0015))


def test_a_push_gives_the_whole_robot_its_momentum():
    q, _, _ = in_the_air(9)
    push = PushSection(joint="trunk_pitch", force=100.0, direction=90.0, at=0.005, duration=0.01)
    pushed, free = (TorqueRobot(ROBOT, CONTACTS, q, section=plant_with(pushes=pushes))
                    for pushes in ((push,), ()))
    seen = []
    for _ in range(20):
        pushed.act(np.zeros(30))
        free.act(np.zeros(30))
        seen.append(pushed.extra["push"].copy())
    moved, fallen = (State.at(ROBOT, one.q, one.v).momentum.A @ one.v for one in (pushed, free))
    np.testing.assert_allclose((moved - fallen)[:3], [0.0, 1.0, 0.0], atol=0.02)
    np.testing.assert_allclose(np.sum(seen, axis=0), [0.0, 1000.0, 0.0], atol=1e-9)
    with pytest.raises(ScenarioError, match=r"plant.pushes: .*trunk_pich"):
        TorqueRobot(ROBOT, CONTACTS, q, section=plant_with(pushes=(
            PushSection(joint="trunk_pich", force=1.0),)))


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


def recorded(fault=None, pushes=(), **changes):
    """A run of 5 s in which a robot stands still, but for what is changed."""
    t = np.arange(0.0, 5.0, 0.01)
    run = type("Run", (dict,), {"ticks": t.size, "fault": fault, "scenario": SimpleNamespace(
        control=SimpleNamespace(duration=5.0), plant=SimpleNamespace(pushes=pushes))})
    return run({"t": t, "v": np.zeros((t.size, 2)), "q": np.zeros((t.size, 2)),
                "com": np.tile([0.0, 0.0, 0.8], (t.size, 1)),
                "support_margin": np.full(t.size, 0.1), "joint_lower": np.full(2, -1.0),
                "joint_upper": np.full(2, 1.0), **changes})


def from_tick(tick, value, shape=(500, 2)):
    values = np.zeros(shape)
    values[tick:] = value
    return values


@pytest.mark.parametrize(("changes", "stands"), [
    ({}, True), ({"v": from_tick(100, 0.3) - from_tick(101, 0.3)}, True),
    ({"v": from_tick(400, 0.3) - from_tick(401, 0.3)}, False),
    ({"q": from_tick(0, 1.1)}, False), ({"support_margin": from_tick(0, np.nan, 500)}, False),
    ({"com": from_tick(0, [0.0, 0.0, 0.8], (500, 3)) - from_tick(300, [0, 0, 0.1], (500, 3))},
     False), ({"fault": "the robot has fallen"}, False),
    ({"pushes": (SimpleNamespace(at=2.9, duration=0.2),)}, None)])
def test_a_robot_stands_only_at_rest_upright_and_within_its_limits_until_the_end(changes, stands):
    assert standing(recorded(**changes)) is stands
