"""A humanoid in MuJoCo with torque motors: its physics is that of the robot's model."""

import numpy as np
import pinocchio as pin
import pytest
from stand_push import CONTENDERS, in_words, main, pushes, run, weighted
from standing import ROBOT, WEIGHT, feet, standing_stack

from hierarchy import Robot, State
from hierarchy.contacts import Contact, Contacts
from scenarios.cell.plants.ground import Floor
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import ScenarioError
from solvers import certify, make

pytestmark = pytest.mark.slow

CONTACTS = feet()


@pytest.fixture(autouse=True)
def _with_mujoco(tmp_path, monkeypatch):
    """MuJoCo writes a log into the folder in which it warns of a run that diverges."""
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)


def in_the_air(seed):
    rng = np.random.default_rng(seed)
    q = pin.integrate(ROBOT.model, ROBOT.rest, 0.3 * rng.normal(size=ROBOT.n))
    q[2] += 2.0
    return q, rng.normal(size=ROBOT.n), 5.0 * rng.normal(size=30)


@pytest.mark.parametrize("seed", range(5))
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
    plant = TorqueRobot(ROBOT, CONTACTS, q, v, delay=2)
    asked = np.full(30, 1e4)
    sent = []
    for _ in range(4):
        plant.act(asked)
        sent.append(plant.data.actuator_force.copy())
    np.testing.assert_array_equal(sent[0], 0.0)
    np.testing.assert_array_equal(sent[1], 0.0)
    np.testing.assert_allclose(sent[2], ROBOT.effort_limit[6:])


def test_a_push_gives_the_whole_robot_its_momentum():
    q, _, _ = in_the_air(9)
    pushed, free = (TorqueRobot(ROBOT, CONTACTS, q) for _ in range(2))
    for _ in range(10):
        pushed.act(np.zeros(30), ("trunk_pitch", np.array([100.0, 0.0, 0.0])))
        free.act(np.zeros(30))
    moved, fallen = (State.at(ROBOT, one.q, one.v).momentum.A @ one.v for one in (pushed, free))
    np.testing.assert_allclose((moved - fallen)[:3], [1.0, 0.0, 0.0], atol=0.02)


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
    for name, force in plant.forces().items():
        np.testing.assert_allclose(force, CONTACTS.forces(res.x, name).sum(axis=0), atol=0.5)
    assert sum(plant.forces().values())[2] == pytest.approx(WEIGHT, abs=0.5)
    assert np.linalg.norm(state.position(ROBOT.frame("left_foot"))
                          - start.position(ROBOT.frame("left_foot"))) < 2e-3


def test_soles_slide_on_a_floor_without_friction():
    """The legs are spread by a torque at both hips."""
    torques = np.zeros(30)
    torques[[1, 7]] = 8.0, -8.0
    slid = []
    for friction in (0.01, 1.0):
        plant = TorqueRobot(ROBOT, CONTACTS, ROBOT.rest, floor=Floor(friction))
        for _ in range(60):
            plant.act(torques)
        state = State.at(ROBOT, plant.q)
        feet_at = [state.position(ROBOT.frame(f"{side}_foot"))[1] for side in ("left", "right")]
        slid.append(feet_at[0] - feet_at[1])
    assert slid[0] > slid[1] + 1e-3


def test_what_it_cannot_simulate_is_named():
    arm = Robot.named("kuka_lwr")
    with pytest.raises(ScenarioError, match="'kuka_lwr': a robot on a floor has a floating base"):
        TorqueRobot(arm, Contacts(arm, [Contact(arm.frame("end_effector"))]), np.zeros(7))


# The study


def test_weighted_tasks_are_one_level_below_physics_and_limits():
    state = State.at(ROBOT, ROBOT.rest)
    h = standing_stack(state, CONTACTS, (0.01, 0.0, 0.0)).hierarchy(state)
    merged = weighted(h)
    assert merged.names == ("physics", "limits", "tasks")
    assert merged.sizes.tolist() == [*h.sizes[:2], h.sizes[2:].sum()]
    x = make("hcod").solve(merged).x
    assert h.violations(x)[:2].max() < 1e-9 < h.violations(x)[2]


def test_a_small_push_is_stood_and_a_large_one_is_not():
    strict = CONTENDERS[0]
    assert not run(strict, np.array([30.0, 0.0, 0.0]), 0.7, Floor()).fell
    assert run(strict, np.array([-600.0, 0.0, 0.0]), 0.7, Floor()).fell


def test_the_study_prints_what_became_of_each_contender(monkeypatch, capsys):
    monkeypatch.setattr("stand_push.DURATION", 0.02)
    monkeypatch.setattr("sys.argv", ["stand_push.py", "--count", "3"])
    main()
    printed = capsys.readouterr().out
    assert printed.count("stands after 3 of 3 (44 to 100 %)") == 4
    assert in_words(0, 3) == "0 of 3 (0 to 56 %)"
    size = np.linalg.norm(pushes(50, 1), axis=1)
    assert ((size >= 40.0) & (size <= 280.0)).all()
