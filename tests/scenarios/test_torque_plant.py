"""A humanoid in MuJoCo with torque motors: its physics is that of the robot's model."""

import numpy as np
import pinocchio as pin
import pytest
from standing import ROBOT, WEIGHT, feet, standing_stack

from hierarchy import State
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import ScenarioError
from scenarios.config.plant import PushSection, TorqueSection
from solvers import certify, make

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("with_mujoco")]

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


def test_a_period_moves_it_by_its_accelerations():
    q, v, torques = in_the_air(7)
    plant = TorqueRobot(ROBOT, CONTACTS, q, v, period=1e-5)
    a = plant.accelerations(torques)
    plant.act(torques)
    np.testing.assert_allclose(plant.v, v + 1e-5 * a, atol=1e-4 * np.abs(1e-5 * a).max() + 1e-8)
    np.testing.assert_allclose(plant.q, pin.integrate(ROBOT.model, q, 1e-5 * plant.v), atol=1e-8)


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


def test_it_stands_with_the_accelerations_and_forces_that_the_stack_predicts():
    """Contacts of MuJoCo are soft: it stands 1 mm deep, and after 1 s the difference is small."""
    start = State.at(ROBOT, ROBOT.rest)
    plant, stack = TorqueRobot(ROBOT, CONTACTS, ROBOT.rest), standing_stack(start, CONTACTS)
    state, resolver, memory = State(ROBOT), make("hcod"), None
    for tick in range(1000):
        state.move(tick * 1e-3, plant.q, plant.v)
        h = stack.hierarchy(state)
        res = resolver.solve(h, memory)
        memory = res.memory
        torques = CONTACTS.torques(state, res.x)
        plant.act(torques)
    assert certify(h, res.x).certified
    error = plant.accelerations(torques) - CONTACTS.accelerations(res.x)
    assert np.abs(error).max() < 0.02  # [rad/s^2, m/s^2]
    for name, force in zip(CONTACTS.names, plant.extra["floor_force"], strict=True):
        np.testing.assert_allclose(force, CONTACTS.forces(res.x, name).sum(axis=0), atol=0.5)
    assert plant.extra["floor_force"][:, 2].sum() == pytest.approx(WEIGHT, abs=0.5)
    assert np.linalg.norm(state.position(ROBOT.frame("left_foot"))
                          - start.position(ROBOT.frame("left_foot"))) < 2e-3


def test_it_says_where_the_soles_slip_and_how_near_the_edge_the_pressure_is():
    """A push from behind brings the centre of pressure to the toes; the robot then tips over."""
    push = PushSection(joint="trunk_pitch", force=60.0, duration=0.5)
    plant = TorqueRobot(ROBOT, CONTACTS, ROBOT.rest, section=plant_with(pushes=(push,)))
    stack, state = standing_stack(State.at(ROBOT, ROBOT.rest), CONTACTS), State(ROBOT)
    resolver, memory, margins, supported = make("hcod"), None, [], []
    for tick in range(300):
        state.move(tick * 1e-3, plant.q, plant.v)
        res = resolver.solve(stack.hierarchy(state), memory)
        memory = res.memory
        plant.act(CONTACTS.torques(state, res.x))
        margins.append(plant.extra["pressure_margin"].min())
        supported.append(float(plant.extra["support_margin"]))
    assert 0.02 < margins[0] <= 0.04   # half the width of a sole is 0.04 m
    assert min(margins) < 0.005
    at_the_toes = next(k for k, margin in enumerate(margins) if margin < 0.005)
    assert 0.05 < supported[at_the_toes] < 0.105 + 1e-9  # half the length of a sole is 0.105 m
    assert plant.extra["slip"].max() < 0.01
    before = pin.centerOfMass(  # where the step began
        ROBOT.model, ROBOT.model.createData(),
        pin.integrate(ROBOT.model, plant.q, -1e-3 * plant.v))
    np.testing.assert_allclose(plant.extra["com"], before, atol=1e-6)
