"""Every kind of task, constraint and limit that mink has, on a floating robot with two arms."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmark.studies.pink_examples import exact, least_squares
from hierarchy import HierarchyError
from solvers import make
from solvers.adapters import from_mink
from solvers.adapters.for_mink import solve_ik
from solvers.adapters.packing import NO_DAMPING

mink, mujoco = pytest.importorskip("mink"), pytest.importorskip("mujoco")

DT = 0.01


@pytest.fixture
def configuration():
    path = Path(__file__).parents[1] / "data" / "robots" / "two_arms.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    q = mujoco.MjData(model).qpos.copy()
    q[7:] = [0.3, -0.4, 0.6, 0.2, 0.5, 0.7]
    return mink.Configuration(model, q=q)


def tasks_of(configuration):
    """Return a task of each kind, with its target away from where the robot is."""
    model = configuration.model
    hand = mink.FrameTask("left_tip", "site", 1.0, 0.3, gain=0.5, lm_damping=0.1)
    hand.set_target(mink.SE3.from_translation(np.array([0.05, 0.02, -0.1]))
                    @ configuration.get_transform_frame_to_world("left_tip", "site"))
    mass = mink.ComTask(cost=[2.0, 1.0, 0.0])
    mass.set_target(configuration.data.subtree_com[1] + 0.02)
    apart = mink.RelativeFrameTask("right_tip", "site", "trunk", "body", 0.7, 0.1, gain=0.8)
    apart.set_target(mink.SE3.from_translation(np.array([0.3, -0.1, 0.2])))
    posture, still = mink.PostureTask(model, cost=0.1), mink.DampingTask(model, cost=0.05)
    posture.set_target(model.qpos0)
    upright = mink.AxisAlignTask("right_tip", "site", cost=0.6, lm_damping=0.1)
    upright.set_target([0.6, 0.0, 0.8])
    look = mink.LookAtTask("left_tip", "site", axis=(1.0, 0.0, 0.0), cost=0.4, gain=0.7)
    look.set_target([2.0, 1.0, 0.5])
    together = mink.EqualityConstraintTask(model, cost=[0.5, 0.2], gain=0.6, lm_damping=0.1)
    energy = mink.KineticEnergyRegularizationTask(cost=1e-4)
    energy.set_dt(DT)
    return [hand, mass, apart, posture, still, upright, look, together, energy]


@pytest.mark.parametrize("kinds", [(0,), (0, 1), (1, 2, 3), (2, 4), (5,), (5, 6), (7,), (0, 8),
                                   tuple(range(9))])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("damping", [1e-12, 1e-9, 1e-2])
def test_one_level_is_the_minimum_of_minks_cost(configuration, kinds, held, damping):
    model = configuration.model
    tasks = [tasks_of(configuration)[i] for i in kinds]
    slow = {f"{side}_{joint}": 0.8 for side in ("left", "right") for joint in "abc"}
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, slow),
              mink.FreeJointVelocityLimit(model, 0.5, 0.9),
              mink.CollisionAvoidanceLimit(model, [(["left_h"], ["right_h"])])]
    frozen = [mink.DofFreezingTask(model, dof_indices=[0, 5])] if held else []
    ours = solve_ik(configuration, [tasks], DT, "hcod", damping, False, limits, frozen)
    problem = mink.build_ik(configuration, tasks, DT, damping, limits, frozen)
    A, b = least_squares(tasks, (), configuration, damping)
    np.testing.assert_allclose(A.T @ A, problem.P, rtol=1e-9, atol=1e-12)
    if damping <= NO_DAMPING:  # which picks the shortest of equal steps
        A, b = least_squares(tasks, (), configuration, 0.0)
    C, d = (problem.A, problem.b) if held else (np.empty((0, model.nv)), np.empty(0))
    bounded = np.isfinite(problem.h)
    x = exact(A, b, problem.G[bounded], problem.h[bounded], C, d, DT * ours) / DT
    values = np.linalg.svd(A, compute_uv=False)
    least = values[values > 1e-9].min()
    rounding = 2e-16 * (values[0] / least) ** 2  # what doubles can tell of this minimum
    np.testing.assert_allclose(ours, x, atol=1e-7 + 50.0 * rounding)


def test_kinetic_energy_below_a_hand_is_the_least_motion_that_moves_it(configuration):
    hand, *_, energy = tasks_of(configuration)
    hand.lm_damping = 0.0
    h = from_mink.hierarchy(configuration, [hand, energy], DT, limits=[])
    J, M = hand.compute_jacobian(configuration), configuration.get_inertia_matrix()
    by_hand = np.linalg.solve(M, J.T)
    x = by_hand @ np.linalg.solve(J @ by_hand, -hand.gain * hand.compute_error(configuration) / DT)
    np.testing.assert_allclose(make("hcod").solve(h).x, x, atol=1e-9)
    assert h.names == ("FrameTask of left_tip", "KineticEnergyRegularizationTask")
    nothing = mink.KineticEnergyRegularizationTask(0.0)
    nothing.set_dt(DT)
    with pytest.raises(HierarchyError, match="KineticEnergyRegularizationTask: its H is not pos"):
        from_mink.hierarchy(configuration, [nothing], DT)


def test_a_joint_that_cannot_come_back_in_time_is_no_solution_and_named(configuration):
    model = configuration.model
    outside = mink.Configuration(model, q=np.r_[configuration.q[:7], 2.5, configuration.q[8:]])
    limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, {"left_a": 0.8})]
    with pytest.raises(mink.NoSolutionFound, match=r"joint left_a must move by at least .* "
                       r"\(VelocityLimit\) and at most .* \(ConfigurationLimit\)"):
        solve_ik(outside, tasks_of(outside), DT, damping=1e-9, limits=limits)
    up = SimpleNamespace(G=-np.eye(1, model.nv, 2), h=np.array([-0.1]), inactive=False)
    limits = [mink.FreeJointVelocityLimit(model, 0.5, 0.9),
              SimpleNamespace(compute_qp_inequalities=lambda *_: up)]
    with pytest.raises(mink.NoSolutionFound, match=r"joint base 3 must move by at least 10 "):
        solve_ik(configuration, tasks_of(configuration), DT, damping=1e-9, limits=limits)
