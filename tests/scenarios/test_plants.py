"""An arm in MuJoCo: its physics, and its servos."""

import numpy as np
import pytest
from scene import ROBOT

from hierarchy import State
from hierarchy.avoidance import Obstacles
from scenarios.cell.plants import PhysicsArm
from scenarios.config.sections.plant import PhysicsSection

mujoco = pytest.importorskip("mujoco")
START = np.array([0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0])
PERIOD = 0.005  # [s]


def test_inertia_gravity_and_coriolis_forces_are_those_of_the_robots_model():
    section = PhysicsSection(kind="mujoco", joints={"armature": 0.0})
    plant = PhysicsArm(ROBOT, START, np.zeros(7), PERIOD, "velocity", Obstacles(()), section)
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


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("far", [0.05, 0.3])
def test_the_servos_of_a_joint_beyond_its_limit_are_led_back_without_a_jump(far, level):
    """The reference once went to the limit at once, and its rate of 20 rad/s was kept."""
    q = START.copy()
    q[3] = ROBOT.upper[3] + far
    arm = PhysicsArm(ROBOT, q, np.zeros(7), PERIOD, level)
    command, reference = np.zeros(7), []
    for k in range(100):
        command[3] = -2.0 * (k < 50) if level == "acceleration" else -min(0.01 * k, 0.5)
        arm.act(command)
        reference.append(arm.reference_v[3])
    assert np.abs(np.diff(reference, prepend=0.0)).max() <= 0.01 + 1e-12
    assert arm.q[3] == pytest.approx(arm.reference_q[3], abs=0.01)
    assert arm.q[3] < q[3] - 0.1
