"""Plants: exact or simulated physics, what is measured of them, and what is true."""


import numpy as np
import pytest
from scene import FRAME, ROBOT, place_of

from hierarchy import State
from hierarchy.avoidance import Obstacles
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.cell.plants import Apart, JointSensor, KinematicArm, PhysicsArm
from scenarios.config.sections.plant import MeasurementSection, PhysicsSection
from scenarios.loop.controller import Controller

START = np.array([0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0])
STILL = np.zeros(7)
PERIOD = 0.005  # [s]
SHORT = ["control.duration=0.3", "control.period=0.005"]
PHYSICS = [*SHORT, "plant.kind=mujoco"]
NOISY = ["plant.measurement.position_noise=1e-4", "plant.measurement.velocity_noise=1e-2"]


@pytest.fixture(scope="module")
def mujoco():
    return pytest.importorskip("mujoco")


def test_inertia_gravity_and_coriolis_forces_are_those_of_the_robots_model(mujoco):
    section = PhysicsSection(kind="mujoco", joints={"armature": 0.0})
    plant = PhysicsArm(ROBOT, START, STILL, PERIOD, "velocity", Obstacles(()), section)
    model, data = plant.model, plant.data
    rng, M = np.random.default_rng(5), np.zeros((7, 7))
    for _ in range(20):
        q, v = rng.uniform(ROBOT.lower, ROBOT.upper), rng.normal(size=7)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        for row, unit in zip(M, np.eye(7), strict=True):
            mujoco.mj_mulM(model, data, row, unit)
        state = State.at(ROBOT, q, v)
        upper = np.triu(state.mass_matrix())
        np.testing.assert_allclose(M, upper + np.triu(upper, 1).T, rtol=0, atol=1e-9)
        np.testing.assert_allclose(data.qfrc_bias, state.bias_effort(), rtol=0, atol=1e-9)


def test_a_smooth_motion_is_followed_closely(mujoco):
    plant, exact = (make(ROBOT, START, STILL, PERIOD, "acceleration")
                    for make in (PhysicsArm, KinematicArm))
    apart = 0.0
    for k in range(400):
        command = 0.5 * np.sin(2.0 * k * PERIOD + np.arange(7))
        plant.act(command)
        exact.act(command)
        apart = max(apart, np.abs(plant.q - exact.q).max())
        np.testing.assert_allclose(plant.reference_q, exact.q, rtol=0, atol=1e-12)
        np.testing.assert_allclose(plant.reference_v, exact.v, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(plant.a, exact.a)
    assert np.abs(exact.q - START).max() > 0.3
    assert 1e-6 < apart < 2e-3


def told(section, count, level="velocity", command=STILL):
    """q, v as told and as they are, (count, 7) each, of an arm that follows exactly."""
    plant = Apart(KinematicArm(ROBOT, START.copy(), STILL, PERIOD, level),
                  JointSensor(MeasurementSection(**section), PERIOD, ROBOT))
    rows = []
    for _ in range(count):
        q, v = plant.q.copy(), plant.v.copy()
        plant.act(command)
        rows.append((q, v, plant.extra["true_q"].copy(), plant.extra["true_v"].copy()))
    return [np.array(part) for part in zip(*rows, strict=True)]


def test_noise_has_the_size_that_is_asked_for_and_no_memory():
    q, v, true_q, true_v = told({"position_noise": 1e-3, "velocity_noise": 0.02}, 3000)
    for noise, size in ((q - true_q, 1e-3), (v - true_v, 0.02)):
        assert np.std(noise, axis=0) == pytest.approx(np.full(7, size), rel=0.06)
        assert np.abs(noise.mean(axis=0)).max() < 0.1 * size
        along_time = [np.corrcoef(noise[1:, i], noise[:-1, i])[0, 1] for i in range(7)]
        between = np.corrcoef(noise.T) - np.eye(7)
        assert max(np.abs(along_time).max(), np.abs(between).max()) < 0.08
    np.testing.assert_array_equal(true_q, np.tile(START, (3000, 1)))


@pytest.mark.parametrize("periods", [0, 1, 4])
def test_a_delay_is_exact(periods):
    q, v, true_q, true_v = told({"delay": periods * PERIOD}, 30, "acceleration", np.arange(7.0))
    np.testing.assert_array_equal(q[periods:], true_q[:30 - periods])
    np.testing.assert_array_equal(v[periods:], true_v[:30 - periods])
    np.testing.assert_array_equal(q[:periods], np.tile(START, (periods, 1)))


def test_a_filtered_velocity_lags_by_the_time_of_its_filter():
    slope, time = 2.0, 0.02  # [rad/s^2], [s]
    _, v, _, true_v = told({"velocity": "differenced", "filter_time": time}, 200, "acceleration",
                           np.full(7, slope))
    # A difference is the velocity half a period ago.
    np.testing.assert_allclose(true_v[-1] - v[-1], slope * (time + PERIOD / 2), rtol=1e-6)


@pytest.mark.parametrize("changes", [[*SHORT, *NOISY], [*PHYSICS, *NOISY]],
                         ids=["kinematic", "mujoco"])
def test_the_controller_sees_what_is_measured_and_nothing_else(mujoco, changes):
    run = simulate(load("ellipse", changes))
    assert np.std(run["q"] - run["true_q"]) == pytest.approx(1e-4, rel=0.1)
    assert np.std(run["v"] - run["true_v"]) == pytest.approx(1e-2, rel=0.1)
    controller = Controller(build(load("ellipse", SHORT)))  # a plant of its own that nobody moves
    for k in range(run.ticks):
        command = controller.command(run["t"][k], run["q"][k], run["v"][k])
        np.testing.assert_array_equal(command, run["command"][k])


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("far", [0.05, 0.3])
def test_the_servos_of_a_joint_beyond_its_limit_are_led_back_without_a_jump(mujoco, far, level):
    """The reference once went to the limit at once, and its rate of 20 rad/s was kept."""
    q = START.copy()
    q[3] = ROBOT.upper[3] + far
    arm = PhysicsArm(ROBOT, q, np.zeros(7), 0.005, level)
    command, reference = np.zeros(7), []
    for k in range(100):
        command[3] = -2.0 * (k < 50) if level == "acceleration" else -min(0.01 * k, 0.5)
        arm.act(command)
        reference.append(arm.reference_v[3])
    assert np.abs(np.diff(reference, prepend=0.0)).max() <= 0.01 + 1e-12
    assert arm.q[3] == pytest.approx(arm.reference_q[3], abs=0.01)
    assert arm.q[3] < q[3] - 0.1


def sphere(radius, centre):
    return [f"avoidance.obstacles=[{{shape='sphere', radius={radius}, centre={list(centre)}}}]"]


NEAR, BESIDE = (0.1, 0.5, 0.1), (0.1, 0.75, 0.3)


@pytest.mark.parametrize(("name", "changes", "centre", "radius", "q"), [
    ("ellipse", ["control.duration=0.05", *sphere(0.05, NEAR),
                 "plant.measurement.position_noise=0.01"], NEAR, 0.05, "true_q"),
    pytest.param("human-hqp", [
        "control.duration=0.2", "plant.kind=kinematic", "plant.measurement.velocity_noise=0.0",
        "plant.measurement.quantisation=0.0", *sphere(0.06, BESIDE)], BESIDE, 0.06, "q",
        marks=pytest.mark.slow)], ids=["noise of the joints", "camera"])
def test_true_distances_are_on_record_beside_the_measured(name, changes, centre, radius, q):
    run, points = simulate(load(name, changes)), (*ROBOT.control_points, FRAME)
    for k in (0, 7, run.ticks - 1):
        places = np.array([place_of(point, run[q][k]) for point in points])
        wanted = np.linalg.norm(places - centre, axis=1) - radius
        np.testing.assert_allclose(run["true_control_point_distance"][k], wanted[:-1], atol=1e-12)
        assert run["true_ee_distance"][k] == pytest.approx(wanted[-1], abs=1e-12)
        assert run["true_minimal_distance"][k] == pytest.approx(wanted[:-1].min(), abs=1e-12)
    assert np.abs(run["true_ee_distance"] - run["ee_distance"]).max() > 1e-3
