"""Scenarios with joints of every kind, mimic joints, closed chains and floating bases."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar
from standing import IDEAL, accelerations

from hierarchy import Robot, State, plugins
from hierarchy.contacts import Contacts
from hierarchy.paths import Still
from hierarchy.tasks import JointCoupling, Mechanism, Position, Posture
from scenarios import simulate
from scenarios.cell.build import build
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.config import Scenario
from scenarios.config.sections.plant import TorqueSection
from solvers import solve_ik


@pytest.fixture(autouse=True)
def _four_bar(monkeypatch, tmp_path):
    known = plugins.find
    monkeypatch.setattr(plugins, "find", lambda group, name: four_bar if (
        group, name) == ("robots", "four_bar") else known(group, name))
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there


def posture(joints):
    """A task that brings joints to their values."""
    return {"kind": "posture", "joints": joints, "stiffness": 100.0, "damping": 20.0, "gain": 10.0}


def scenario(level="velocity", resolver="hcod", stack="hierarchical", **more):
    plant = {"kind": "torque", **IDEAL} if level == "torque" else {"kind": "kinematic"}
    asks = {"position": {"offset": [0.05, 0.0, 0.05]}} if stack == "switched" else {
        "tasks": [posture({"crank": -0.3, "finger": 0.5})]}
    return Scenario.model_validate({
        "name": "bar", "robot": {"model": "four_bar"}, "damping": {"value": 5.0},
        "start": {"joints": {"crank": -0.8, "finger": 0.3}}, "plant": plant,
        "control": {"level": level, "stack": stack, "resolver": resolver, "duration": 0.5,
                    "period": 0.002}} | asks | more)


def largest_gap(q):
    """How far the pin is open [m], and the thumb from its polynomial [rad], by pinocchio alone."""
    robot, worst = four_bar(), 0.0
    data = robot.model.createData()
    for row in q:
        pin.framesForwardKinematics(robot.model, data, row)
        end, tip = (data.oMf[robot.model.getFrameId(name)].translation for name in ("end", "tip"))
        finger, thumb = (row[robot.coordinate_names.index(name)] for name in ("finger", "thumb"))
        worst = max(worst, np.linalg.norm(end - tip), abs(thumb - (0.1 - finger + 0.5 * finger**2)))
    return worst


LIMITS = {"limits": {"acceleration": 50.0, "place": "either"}}


@pytest.mark.parametrize("settings", [
    {"level": "velocity"}, {"level": "velocity", "resolver": "tpm", **LIMITS},
    {"level": "velocity", "resolver": "tpm", "stack": "set-based"},
    {"level": "acceleration", "resolver": "recursive"},
    {"level": "acceleration", "resolver": "tpm", "stack": "switched", **LIMITS},
    pytest.param({"level": "torque", **LIMITS}, marks=pytest.mark.slow)])
def test_a_mechanism_stays_closed_in_every_stack_and_plant(settings):
    if settings["level"] == "torque":
        pytest.importorskip("mujoco")
    run = simulate(scenario(**settings))
    assert run.fault is None
    assert largest_gap(run["q"]) < 1e-11
    assert np.ptp(run["q"], axis=0).max() > 0.05, "it moved"


ROBOTS = Path(__file__).parents[1] / "data" / "robots"
CROSS = '<joint name="rod_{0}_1" axis="0 1 0"/><joint name="rod_{0}_2" axis="1 0 0"/>'


def largest_residual(path, q):
    """How far MuJoCo finds the equalities of a file open [m] in configurations q (T, nq)."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(path))
    data, worst = mujoco.MjData(model), 0.0
    for data.qpos[:] in q:
        for i in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL):
            at = model.jnt_qposadr[i]
            data.qpos[at:at + 4] = np.roll(data.qpos[at:at + 4], 1)
        mujoco.mj_forward(model, data)
        worst = max(worst, np.abs(data.efc_pos).max())
    return worst


@pytest.mark.parametrize(("level", "rod"), [("velocity", '<joint name="rod_{0}" type="ball"/>'),
                                            ("acceleration", CROSS), ("torque", CROSS)])
def test_an_ankle_with_two_pushrods_stays_closed(level, rod, tmp_path):
    pytest.importorskip("mujoco")
    path, text = tmp_path / "ankle.xml", (ROBOTS / "ankle.xml.txt").read_text()
    path.write_text(text.format(left=rod.format("left"), right=rod.format("right")))
    robot, asked = Robot.load(path), {"pitch": -0.35, "roll": 0.15}
    goal = Mechanism(robot).closed(robot.configuration(asked), asked)
    joints = {name: np.atleast_1d(value).tolist() for name, value in robot.values(goal).items()}
    data = {"name": "ankle", "robot": {"model": str(path)}, "control": {
        "level": level, "stack": "hierarchical", "resolver": "hcod", "duration": 1.0,
        "period": 0.002}, "plant": {"kind": "torque" if level == "torque" else "kinematic"},
        "tasks": [posture(joints)]}
    run = simulate(Scenario.model_validate(data))
    assert run.fault is None
    assert largest_residual(path, run["q"]) < 1e-9
    found = robot.values(run["q"][-1])
    assert [found[name] for name in asked] == pytest.approx(list(asked.values()), abs=2e-3)
    toe = robot.frame("toe")
    there = Still(State.at(robot, goal).position(toe))
    reached = solve_ik(robot, robot.rest, [Position(toe, there)], until=1e-9)
    assert reached.met
    q = robot.rest
    for _ in range(20):
        step = solve_ik(robot, q, [Position(toe, there)], dt=0.01, limits=False)
        q = robot.integrate(q, 0.01 * step.v)
    assert largest_residual(path, [reached.q, q]) < 1e-9
    assert np.linalg.norm(q - reached.q) < 0.5 * np.linalg.norm(robot.rest - reached.q)


@pytest.mark.parametrize("added", [0.0, 0.5])
def test_the_torque_plant_has_the_armature_of_the_robots_file(added):
    mujoco = pytest.importorskip("mujoco")
    path = ROBOTS / "falling.xml"
    robot, model = Robot.load(path), mujoco.MjModel.from_xml_path(str(path))
    q, v = np.array([0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8, 0.3, 0.1]), np.zeros(8)
    plant = TorqueRobot(robot, Contacts(robot, []), q, v,
                        section=TorqueSection(kind="torque", armature=added))
    model.dof_armature[6:] += added
    data = mujoco.MjData(model)
    data.qpos[:], data.qfrc_applied[6:] = q[[0, 1, 2, 6, 3, 4, 5, 7, 8]], (3.0, -2.0)
    mujoco.mj_forward(model, data)
    expected = data.qacc.copy()
    expected[:3] = data.xmat[1].reshape(3, 3).T @ expected[:3]
    np.testing.assert_allclose(accelerations(plant, np.array([3.0, -2.0])), expected, rtol=1e-6,
                               atol=1e-12)


def test_a_mechanism_that_nothing_drives_keeps_its_energy():
    """To keep it closed in joint velocities alone gave it 0.6 J of 2.8 J in 3 s."""
    pytest.importorskip("mujoco")
    robot = four_bar()
    mechanism, model = Mechanism(robot), robot.model
    q = mechanism.closed(robot.configuration({"crank": 0.6, "rocker": 1.2}))
    v = mechanism.moving(q, np.array([1.0, -1.0, 2.0, 0.0, 0.5]))
    plant = TorqueRobot(robot, Contacts(robot, []), q, v, section=TorqueSection(
        kind="torque", **IDEAL, stops=False))
    before = pin.computeMechanicalEnergy(model, model.createData(), plant.q, plant.v)
    for _ in range(1000):
        plant.act(np.zeros(5))
    after = pin.computeMechanicalEnergy(model, model.createData(), plant.q, plant.v)
    assert abs(after - before) < 0.04


def test_joints_of_a_mechanism_that_a_posture_names_reach_their_values():
    """The others, at rest, once pulled them back: the crank came to rest at -0.48."""
    asked, robot, memory = {"crank": -0.3, "finger": 0.5}, four_bar(), None
    q = build(scenario()).start[0]
    for _ in range(200):
        step = solve_ik(robot, q, [Posture(asked, gain=10.0, robot=robot)], memory=memory)
        q, memory = robot.integrate(q, 0.01 * step.v), step.memory
    run = simulate(scenario(control={"level": "velocity", "stack": "hierarchical",
                                     "resolver": "hcod", "duration": 2.0, "period": 0.01}))
    for end in (q, run["q"][-1]):
        values = robot.values(end)
        assert {name: values[name] for name in asked} == pytest.approx(asked, abs=1e-6)


@pytest.mark.parametrize("crank", [3.138, 3.1395])
def test_a_chain_that_is_nearly_flat_is_kept_closed_at_moderate_speeds(crank):
    bar = four_bar()
    mechanism, q = Mechanism(bar), bar.integrate(bar.rest, np.full(bar.n, 0.4))
    for angle in np.linspace(0.4, crank, 40):
        q = mechanism.closed(bar.configuration({**bar.values(q), "crank": angle}), ["crank"])
    step = solve_ik(bar, q, [JointCoupling(bar, {"crank": 1.0}, crank + 0.1)], dt=0.02)
    assert np.abs(step.v).max() < 2.0
    assert mechanism.gap(bar.integrate(q, step.v * 0.02))[0] < 1e-6
    bar.loops = ()  # the thumb alone
    step = solve_ik(bar, q, [JointCoupling(bar, {"finger": 1.0}, 0.5)], dt=0.02)
    assert Mechanism(bar).gap(bar.integrate(q, step.v * 0.02))[0] < 1e-12
