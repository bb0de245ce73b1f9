"""Contacts that slide (`wipe`) and that open and close (`crawl`)."""

import numpy as np
import pytest
from standing import drift_of

from hierarchy import Robot, Stack, State
from hierarchy.contacts import Contact, Contacts
from hierarchy.tasks import ContactMotion, Friction
from scenarios import load, simulate
from scenarios.cell.plants.torque import inside
from scenarios.measure.metrics import measure

ARM = Robot.named("kuka_lwr")
TIP = ARM.frame("end_effector")
Q = np.array([0.0, -0.5, 0.0, 1.5, 0.0, -1.14, 0.0])


def rows_at(v, friction=0.3, faces=4, least=0.0):
    """Friction rows of a sliding tip with the joint velocity v: over the force, and their sides."""
    contacts = Contacts(ARM, [Contact(TIP, friction=friction, slides=True)])
    state = State.at(ARM, Q, v)
    A, lower, upper = Friction(contacts, faces, least).rows(state)
    return A[:, 7:], lower, upper, contacts.jacobian(state) @ v


@pytest.mark.parametrize("faces", [4, 8])
def test_the_force_on_a_sliding_point_is_friction_against_its_velocity(faces):
    v = np.random.default_rng(3).normal(size=7)
    A, lower, upper, moving = rows_at(v, faces=faces)
    along = moving[:2]
    force = np.array([*(-0.3 * 20.0 * along / np.linalg.norm(along)), 20.0])
    equal = lower == upper
    assert equal.sum() == 2
    np.testing.assert_allclose((A @ force)[equal], 0.0, atol=1e-12)
    assert np.linalg.matrix_rank(A[equal][:, :2]) == 2    # no other tangential force does
    assert (lower[-1], upper[-1]) == (0.0, np.inf)        # and it pushes
    assert np.isinf([side[:-1][~equal[:-1]] for side in (lower, upper)]).all()
    assert rows_at(v, least=2.0)[1][-1] == 2.0


def test_a_sliding_contact_is_held_along_its_normal_only():
    normal = np.array([0.6, 0.0, 0.8])
    contacts = Contacts(ARM, [Contact(TIP, normal=tuple(normal), slides=True)])
    state, motion = State.at(ARM, Q, np.ones(7)), ContactMotion(contacts, damping=30.0)
    h = Stack([motion], "torque", contacts=contacts).hierarchy(state)
    J = contacts.jacobian(state)
    np.testing.assert_allclose(h.A[:, :7], normal @ J[None], atol=1e-12)
    expected = -30.0 * normal @ J @ state.v - normal @ drift_of(contacts, state)
    np.testing.assert_allclose(h.lower, expected)
    assert motion.row_names == ("end_effector along its normal",)


@pytest.mark.parametrize("height", [0.111, 0.09])
def test_it_presses_and_wipes_on_a_table_of_unknown_height(height):
    """Friction known: within 1 N of 20 N most of the time, and a few mm of its circle."""
    pytest.importorskip("mujoco")
    run = simulate(load("wipe", {"plant.height": height, "control.duration": 2.4}))
    assert run.fault is None
    after = run["t"] > 1.0
    assert np.median(np.abs(run["floor_force"][after, 0, 2] - 20.0)) < 2.0
    height_kept = run["true_ee_position" if "true_ee_position" in run else "ee_position"][after, 2]
    np.testing.assert_allclose(height_kept, height, atol=3e-3)
    found = measure(run)
    assert found["force_touching_share"].value > 0.85
    assert found["task_path_rms"].value < 6e-3
    assert np.isnan(run["slip"]).any()
    assert not {"slip_max", "stands_at_rest", "com_drop_max"} & {*found}  # it has no feet


def test_a_foot_steps_with_the_weight_over_the_other_three():
    pytest.importorskip("mujoco")
    first, lift, touch = 3, 0.75, 1.15  # the foot that steps first, and when [s]
    first_step = simulate(load("crawl", {
        "control.duration": 1.4, "plant.pushes.0.at": 0.3, "plant.pushes.0.force": 20.0}))
    assert first_step.fault is None
    t, force = first_step["t"], first_step["floor_force"]
    air = (t > lift + 0.01) & (t < touch - 0.01)
    assert (force[air, first] == 0.0).all()
    assert force[air][:, [0, 1, 2], 2].min() > 1.0
    assert first_step["support_margin"][air].min() > 0.03
    moved = first_step["task_position_right_hind_foot"]
    np.testing.assert_allclose(moved[-1] - moved[0], [0.12, 0.0, 0.0], atol=5e-3)
    assert moved[:, 2].max() == pytest.approx(0.06, abs=5e-3)
    step = first_step.scenario.limits.torque_step
    assert measure(first_step)["torque_step_max"].value <= step + 1e-9


@pytest.mark.parametrize(("place", "found"), [
    ((0.5, 0.5), 0.5), ((0.9, 0.4), 0.1), ((1.2, 0.5), -0.2), ((0.0, 0.3), 0.0)])
def test_the_margin_of_support_is_that_from_the_nearest_edge(place, found):
    corners = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.2), (0.0, 0.0)])
    assert inside(corners, np.array(place)) == pytest.approx(found)
    assert np.isnan(inside(corners[:2], np.array(place)))
