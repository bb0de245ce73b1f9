"""A robot in MuJoCo with torque motors or servos: its physics, contacts before they are trusted."""

from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar
from refusals import refused
from standing import IDEAL, ROBOT, accelerations, feet, moving_state
from urdf_text import INERTIAL, LIMIT, joint, link, urdf

from hierarchy import Robot, State
from hierarchy.avoidance import Obstacles
from hierarchy.contacts import Contacts
from scenarios import load
from scenarios.cell.build import build
from scenarios.cell.plants import PhysicsArm
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import ScenarioError
from scenarios.config.sections.plant import PhysicsSection, PushSection, TorqueSection
from scenarios.loop.controller import Controller

pytestmark = pytest.mark.usefixtures("with_mujoco")

CONTACTS = feet()
plant_with = partial(TorqueSection, kind="torque")


def loaded(file, text):
    """A robot that is written to a file and read."""
    file.write_text(text)
    return Robot.load(file)


def alone(robot, *state, period=0.001, **keys):
    """A robot without contacts, at rest where no q or v is given."""
    return TorqueRobot(robot, Contacts(robot, ()), *(state or [robot.rest]), period=period,
                       section=plant_with(**keys))


def driven(plant, torque, seconds):
    for _ in range(round(seconds / 0.001)):
        plant.act(torque)
    return plant


def in_the_air(seed):
    state, higher = moving_state(seed), np.append([0.0, 0.0, 2.0], np.zeros(ROBOT.nq - 3))
    return state.q + higher, state.v, 5.0 * np.random.default_rng(seed + 50).normal(size=30)


@pytest.mark.parametrize("seed", range(2))
def test_without_contact_it_accelerates_as_the_robots_model(seed):
    """Bodies without mass get 1 mg there, and that is the difference."""
    q, v, torques = in_the_air(seed)
    expected = pin.aba(ROBOT.model, ROBOT.model.createData(), q, v, np.r_[np.zeros(6), torques])
    plant = TorqueRobot(ROBOT, CONTACTS, q, v, section=plant_with(**IDEAL))
    assert np.abs(accelerations(plant, torques) - expected).max() < 1e-3 * np.abs(expected).max()


def test_gravity_is_that_of_the_robots_file(tmp_path):
    robot = loaded(
        tmp_path / "moon.xml", '<mujoco><option gravity="0.5 0 -1.62"/><worldbody><body><joint '
        'axis="0 1 0"/><geom size=".1" pos=".3 0 .1"/></body></worldbody></mujoco>')
    plant = alone(robot, np.zeros(1), **IDEAL)
    plant.act(np.zeros(1))
    expected = pin.aba(robot.model, robot.model.createData(), *np.zeros((3, 1)))
    np.testing.assert_allclose(plant.a, expected, rtol=1e-3)


def one_joint(folder, inertial=INERTIAL, limit=LIMIT, kind="revolute"):
    return loaded(folder / "one.urdf", urdf(link("base"), link("arm", inertial), joint(
        "only", kind, "base", "arm", limit)))


def test_an_inertia_that_no_body_has_becomes_its_mean(tmp_path):
    robot = one_joint(tmp_path, INERTIAL.replace("0.4", "1.4"))
    moments = np.linalg.eigvalsh(robot.model.inertias[1].inertia)
    np.testing.assert_allclose(alone(robot).model.body_inertia[1], moments.mean())


def test_a_joint_without_room_between_its_limits_stays_there(tmp_path):
    robot = one_joint(tmp_path, limit=LIMIT.replace("-1", "0").replace('"1"', '"0"'))
    assert abs(driven(alone(robot, np.zeros(1)), np.full(1, 1.0), 0.1).q[0]) < 1e-3


def test_what_has_no_mass_can_follow_a_joint(tmp_path):
    limit = '<limit lower="-1" upper="1" velocity="2" effort="0"/>'
    robot = loaded(tmp_path / "hand.urdf", urdf(
        link("palm"), link("one"), *(link(name, "") for name in ("two", "tip")),
        joint("a", "revolute", "palm", "one"),
        joint("b", "revolute", "one", "two", f'{limit}<mimic joint="a"/>'),
        joint("c", "revolute", "two", "tip", f'{limit}<mimic joint="a"/>')))
    v = driven(alone(robot, np.zeros(3)), np.array([1.0, 0.0, 0.0]), 0.05).v
    assert abs(v[0]) > 0.01
    np.testing.assert_allclose(v, v[0])


def test_a_joint_of_several_axes_is_named():
    bar = four_bar(rocker=pin.JointModelSpherical())
    refused("joint 'rocker' does not turn", alone, bar, error=ScenarioError)


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


def test_a_continuous_joint_has_no_stop_and_an_arm_that_sinks_does_not_fall(tmp_path):
    """The limits of its cosine, 1.01, were those of its angle."""
    robot = one_joint(tmp_path, limit="", kind="continuous")
    plant = alone(robot, robot.rest, np.full(1, 3.0))
    for _ in range(1000):
        plant.act(State.at(robot, plant.q).bias_effort())
    assert robot.vector(plant.q) > 2.9
    assert plant.fault is None


def test_a_robot_that_is_put_on_the_floor_is_carried_from_the_first_tick_on():
    """Rounding decided: the quadruped's knees were at 2.2 rad/s before a contact carried."""
    cell = build(load("crawl"))
    controller = Controller(cell)
    cell.plant.act(controller.command(0.0, cell.plant.q, cell.plant.v))
    assert cell.plant.extra["floor_force"][:, 2].min() > 1.0
    assert np.abs(cell.plant.v[6:]).max() < 0.2


# -- an arm in MuJoCo ------------------------------------------------------------------------------
ARM, Q = Robot.named("kuka_lwr"), np.array([0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0])


def test_inertia_gravity_and_coriolis_forces_are_those_of_the_robots_model():
    import mujoco

    section = PhysicsSection(kind="mujoco", joints={"armature": 0.0})
    plant = PhysicsArm(ARM, Q, np.zeros(7), 0.005, "velocity", Obstacles(()), section)
    model, data = plant.model, plant.data
    rng, M = np.random.default_rng(5), np.zeros((7, 7))
    for _ in range(20):
        q, v = rng.uniform(ARM.lower, ARM.upper), rng.normal(size=7)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        for row, unit in zip(M, np.eye(7), strict=True):
            mujoco.mj_mulM(model, data, row, unit)
        state = State.at(ARM, q, v)
        upper = np.triu(state.mass_matrix())
        np.testing.assert_allclose(M, upper + np.triu(upper, 1).T, rtol=0, atol=1e-9)
        np.testing.assert_allclose(data.qfrc_bias, state.bias_effort(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("far", [0.05, 0.3])
def test_the_servos_of_a_joint_beyond_its_limit_are_led_back_without_a_jump(far, level):
    """The reference once went to the limit at once, and its rate of 20 rad/s was kept."""
    q = Q.copy()
    q[3] = ARM.upper[3] + far
    arm = PhysicsArm(ARM, q, np.zeros(7), 0.005, level)
    command, reference = np.zeros(7), []
    for k in range(100):
        command[3] = -2.0 * (k < 50) if level == "acceleration" else -min(0.01 * k, 0.5)
        arm.act(command)
        reference.append(arm.reference_v[3])
    assert np.abs(np.diff(reference, prepend=0.0)).max() <= 0.01 + 1e-12
    assert arm.q[3] == pytest.approx(arm.reference_q[3], abs=0.01)
    assert arm.q[3] < q[3] - 0.1
