"""Contacts and tasks over their forces, each against an algorithm that shares no code with it."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scene import compiled_rows
from standing import (
    CONTACTS,
    LEFT,
    ROBOT,
    WEIGHT,
    drift_of,
    feet,
    moving_state,
    opening,
    wrenches_of,
    written,
)

from hierarchy import Robot, Stack, State, tasks
from hierarchy.contacts import Contact, Contacts, corners
from hierarchy.task import Rows
from hierarchy.tasks.contacts.friction import _edges

STEP = 1e-6
N = ROBOT.n


def positions(state):
    """World positions (3 p,) of the contact points, from the frames alone."""
    return np.concatenate([state.position(contact.frame)
                           + state.rotation(contact.frame) @ np.array(point)
                           for contact in CONTACTS.contacts for point in contact.points])


def test_contact_jacobian_is_the_derivative_of_the_positions():
    state = moving_state(1)
    J = CONTACTS.jacobian(state)
    for c, e in enumerate(np.eye(N)):
        later, before = (State.at(ROBOT, pin.integrate(ROBOT.model, state.q, s * STEP * e))
                         for s in (1, -1))
        np.testing.assert_allclose(J[:, c], (positions(later) - positions(before)) / (2 * STEP),
                                   atol=1e-8)


def test_base_rows_hold_exactly_where_forward_dynamics_does():
    """aba gives the acceleration that contact forces and joint torques cause."""
    state, rng = moving_state(5), np.random.default_rng(5)
    forces, tau = 50.0 * rng.normal(size=(len(CONTACTS.points.joints), 3)), rng.normal(size=N)
    tau[:6] = 0.0
    a = pin.aba(ROBOT.model, ROBOT.model.createData(), state.q, state.v, tau,
                wrenches_of(state, CONTACTS, forces))
    x = np.concatenate([a, forces.ravel()])
    A, lower, upper = tasks.BaseDynamics(CONTACTS).rows(state)
    np.testing.assert_array_equal(lower, upper)
    np.testing.assert_allclose(A @ x, lower, atol=1e-9)
    np.testing.assert_allclose(CONTACTS.torques(state, x), tau[6:], atol=1e-9)


@pytest.mark.parametrize("faces", [4, 8])
def test_what_friction_rows_allow_is_in_the_cone_and_their_edges_touch_it(faces):
    contact = CONTACTS["left_hand"]
    rows, lower, _ = tasks.Friction(Contacts(ROBOT, [contact]), faces).fixed
    rows = rows[:, ROBOT.n:]
    normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
    rng, allowed = np.random.default_rng(7), []
    for _ in range(2000):
        f = rng.normal(size=3) + normal
        tangential = np.linalg.norm(f - (f @ normal) * normal)
        allowed.append(bool((rows @ f >= lower).all()))
        assert not allowed[-1] or tangential <= contact.friction * (f @ normal) + 1e-12
    assert 0 < sum(allowed) < 2000
    for i in range(faces):  # the force on two neighbouring faces is on the cone
        edge = np.cross(rows[i], rows[(i + 1) % faces])
        edge *= np.sign(edge @ normal)
        tangential = edge - (edge @ normal) * normal
        assert np.linalg.norm(tangential) == pytest.approx(contact.friction * (edge @ normal))


def test_the_centre_of_pressure_rows_change_sides_at_the_margin():
    contacts, margin = feet(), 0.02
    task = tasks.CentreOfPressure(contacts, margin)
    assert task.row_names == tuple(f"{side}_foot edge {i}" for side in ("left", "right")
                                   for i in (1, 2, 3, 4))
    assert tasks.CentreOfPressure(contacts, 0.0).row_names == task.row_names
    sole = np.array(contacts["right_foot"].points)[:, :2]
    rng, seen = np.random.default_rng(8), []
    for _ in range(300):
        normal = rng.exponential(size=4) ** 3
        x, y = sole.T @ normal / normal.sum()
        f = np.zeros((8, 3))
        f[4:, 2] = normal
        value = task.fixed[0][:, ROBOT.n:] @ f.ravel()
        seen.append(-0.03 < x < 0.14 and -0.02 < y < 0.02)
        assert bool((value >= 0.0).all()) == seen[-1]
        distance = sorted([x + 0.05, 0.16 - x, y + 0.04, 0.04 - y])
        np.testing.assert_allclose(sorted(value[4:] / normal.sum()), np.array(distance) - margin,
                                   atol=1e-12)
        assert not value[:4].any()
    assert 0 < sum(seen) < 300


def test_corners_one_above_the_other_are_one_of_the_sole():
    """Along an oblique `up` they differ by rounding, and edges between them had any direction."""
    up = np.array([0.3, -0.4, 0.75**0.5])
    sole = corners((-0.1, 0.1), (-0.05, 0.05), up)
    box = Contact(LEFT.frame, np.vstack([sole, sole + 0.03 * up]).tolist(), up=up.tolist())
    rows, *_ = tasks.CentreOfPressure(Contacts(ROBOT, [box]), 0.01).fixed
    levers = rows[:, ROBOT.n + 2::3]
    np.testing.assert_allclose(np.sort(levers[:, :4], axis=None),
                               np.repeat([-0.01, 0.09, 0.19], [8, 4, 4]), atol=1e-12)
    np.testing.assert_allclose(levers[:, :4], levers[:, 4:], atol=1e-12)


def test_the_edges_of_a_sole_are_those_of_its_hull():
    """Each from corner to corner, past points between them."""
    points = np.array([(0.0, 0.0), (0.0, 2.0), (2.0, 0.0), (2.0, 2.0), (1.0, -1e-12), (1.0, 1.0)])
    assert {(*start, *inward) for start, inward in _edges(points)} == {
        (0, 0, 0, 1), (2, 0, -1, 0), (2, 2, 0, -1), (0, 2, 1, 0)}


@pytest.mark.parametrize("faces", [4, 8])
def test_an_open_contact_has_no_force_and_is_free_to_move(faces):
    contacts, state = opening(), State.at(ROBOT, ROBOT.rest, t=1.5)
    A, lower, upper = tasks.Friction(contacts, faces, largest=50.0).rows(state)
    of_right = slice(4 * (faces + 1), None)
    held = (lower == upper)[of_right]
    assert np.linalg.matrix_rank(A[of_right][held]) == held.sum() == 12
    assert not lower[of_right][held].any()
    assert np.isinf(lower[of_right][~held]).all()
    closed = tasks.Friction(feet(), faces, largest=50.0).rows(state)
    for now, plain in zip((A, lower, upper), closed, strict=True):
        np.testing.assert_array_equal(now[:4 * (faces + 1)], plain[:4 * (faces + 1)])
    A, lower, upper = written(tasks.ContactMotion(contacts), state)
    assert A[:6].any(axis=1).all()
    for rows in (A[6:], lower[6:], upper[6:]):
        assert not rows.any()


@pytest.mark.parametrize("task", [tasks.BaseDynamics(opening()), tasks.TorqueLimits(
    ROBOT, contacts=opening()), tasks.TorqueStep(ROBOT, 1.0, contacts=opening())])
def test_an_open_contact_moves_neither_the_base_nor_a_motor(task):
    """An open foot pushed with 1.5 N to spare motors that were too weak."""
    closed, opened = (task.rows(State.at(ROBOT, ROBOT.rest, t=t)) for t in (0.0, 1.5))
    closed[0][:, opening().blocks["right_foot"]] = 0.0
    for now, plain in zip(opened, closed, strict=True):
        np.testing.assert_array_equal(now, plain)


@pytest.mark.parametrize("largest", [100.0, 1e5, np.inf])
def test_the_load_of_a_sole_falls_in_its_ramp_from_what_it_carried(largest):
    """The last row has all of its normal force."""
    state, rows = State.at(ROBOT, ROBOT.rest), Rows.empty(41, 60)
    task = tasks.Friction(opening(), least=2.0, largest=largest)
    assert task.row_names[::10] == ("left_foot point 1 face 1", "left_foot point 3 face 1",
                                    "right_foot point 1 face 1", "right_foot point 3 face 1",
                                    "right_foot load")
    write = task.writer(state, "torque", rows)
    state.carried = np.array([300.0, 92.0])
    for t, up, least in ((0.5, np.inf, 2.0), (0.79, np.inf, 2.0), (0.9, 46.0, 1.0),
                         (0.99, 4.6, 0.1), (1.5, np.inf, 0.0)):
        state.move(t, state.q, state.v)
        write()
        assert (rows[1][40], rows[2][40]) == (-np.inf, pytest.approx(up))
        np.testing.assert_allclose(rows[1][24:40:5], least, atol=1e-12)  # of each point's normal
    for carried, up, least in ((4e-6, 2e-6, 1.0), (1e-6, np.inf, 0.0)):  # the half of which is none
        state.carried = np.array([300.0, carried])
        state.move(0.9, state.q, state.v)
        write()
        assert (rows[2][40], rows[1][24]) == (pytest.approx(up), pytest.approx(least))
    state.carried = None  # then what the whole robot weighs
    write()
    assert rows[2][40] == pytest.approx(0.5 * WEIGHT)


def test_what_a_contact_carries_is_kept_while_it_ramps_and_forgotten_when_it_is_open():
    contacts, x = opening(), np.zeros(60)
    x[contacts.blocks["right_foot"]][2::3] = [10.0, 20.0, 30.0, 40.0]
    before = contacts.carried(0.5, x, None)
    assert before.tolist() == [0.0, 100.0]
    assert contacts.carried(0.9, 2.0 * x, before).tolist() == [0.0, 100.0]
    assert np.isnan(contacts.carried(0.9, x, None)[1])
    after = contacts.carried(1.5, x, before)
    assert np.isnan([after[1], contacts.carried(2.1, x, after)[1]]).all()
    assert contacts.carried(2.3, x, after)[1] == 100.0


@pytest.mark.parametrize("target", [(20.0,), (1.0, 2.0, 3.0), (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)])
@pytest.mark.parametrize("name", ["left_hand", "right_foot"])
def test_contact_force_rows_are_the_sum_over_the_points(target, name):
    state, x = moving_state(9), np.random.default_rng(9).normal(size=CONTACTS.unknowns)
    task, contact = tasks.ContactForce(CONTACTS, name, target), CONTACTS[name]
    A, lower, upper = task.rows(state)
    forces, R = CONTACTS.forces(x, name), state.rotation(contact.frame)
    moment = sum(np.cross(R @ np.array(point), f)
                 for point, f in zip(contact.points, forces, strict=True))
    wrench = np.concatenate([forces.sum(axis=0), moment])
    normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
    expected = [forces.sum(axis=0) @ normal] if len(target) == 1 else wrench[:len(target)]
    np.testing.assert_allclose(A @ x, expected, atol=1e-12)
    np.testing.assert_array_equal([lower, upper], [target] * 2)
    assert len(task.row_names) == task.dimension


def test_contact_motion_rows_are_the_accelerations_of_contacts_with_baumgartes_terms():
    state, start = moving_state(11), State.at(ROBOT, ROBOT.rest)
    task = tasks.ContactMotion.at(start, CONTACTS, stiffness=100.0, damping=20.0)
    assert task.dimension == len(task.row_names) == 15
    A, lower, upper = written(task, state)
    J, dJ = CONTACTS.jacobian(state)[12:15], drift_of(CONTACTS, state)[12:15]  # of the palm
    gone = (positions(start) - positions(state))[12:15]
    np.testing.assert_allclose(A[6:9], J, atol=1e-12)
    np.testing.assert_allclose(lower[6:9], -dJ - 20.0 * J @ state.v + 100.0 * gone, atol=1e-9)
    np.testing.assert_array_equal(lower, upper)
    assert np.abs(task.error(start)).max() < 1e-12
    for anchors in (np.array(task.anchors), [anchor.copy() for anchor in task.anchors]):
        other = tasks.ContactMotion(CONTACTS, anchors, 100.0)
        np.testing.assert_array_equal(other.error(state), task.error(state))
        assert isinstance(anchors, np.ndarray) or other == task != replace(task, gain=1.0)


@pytest.mark.parametrize("part", ["both", "linear", "angular"])
def test_momentum_rows_are_the_rate_of_the_momentum(part):
    state, a = moving_state(14), np.random.default_rng(14).normal(size=N)
    task = tasks.Momentum(part, damping=4.0)
    of_part = {"both": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}[part]
    A, lower, _ = compiled_rows(task, state, "acceleration")
    data = ROBOT.model.createData()
    pin.computeCentroidalMomentumTimeVariation(ROBOT.model, data, state.q, state.v, a)
    rate, momentum = data.dhg.vector[of_part], data.hg.vector[of_part]
    np.testing.assert_allclose(A @ a - lower, rate + 4.0 * momentum, atol=1e-9)
    assert not written(task, state, "velocity")[1].any()
    assert len(task.row_names) == task.dimension
    target = np.arange(1.0, task.dimension + 1.0)
    aimed = tasks.Momentum(part, tuple(target), 5.0).reference_acceleration(state)
    np.testing.assert_allclose(aimed, 5.0 * (target - task.jacobian(state) @ state.v))


# Contacts that slide.
ARM = Robot.named("kuka_lwr")
TIP = ARM.frame("end_effector")
Q = np.array([0.0, -0.5, 0.0, 1.5, 0.0, -1.14, 0.0])


def rows_at(v, faces=4, least=0.0):
    """Friction rows of a sliding tip with the joint velocity v: over the force, and their sides."""
    contacts = Contacts(ARM, [Contact(TIP, friction=0.3, slides=True)])
    state = State.at(ARM, Q, v)
    A, lower, upper = tasks.Friction(contacts, faces, least).rows(state)
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
    slow = 0.004 / np.linalg.norm(along) * v  # [m/s], in proportion below 0.01
    A, lower, upper, _ = rows_at(slow, faces=faces)
    np.testing.assert_allclose((A @ (force * [0.4, 0.4, 1.0]))[lower == upper], 0.0, atol=1e-12)


def test_a_sliding_contact_is_held_along_its_normal_only():
    normal = np.array([0.6, 0.0, 0.8])
    contacts = Contacts(ARM, [Contact(TIP, normal=tuple(normal), slides=True)])
    state, motion = State.at(ARM, Q, np.ones(7)), tasks.ContactMotion(contacts, damping=30.0)
    h = Stack([motion], "torque", contacts=contacts).hierarchy(state)
    J = contacts.jacobian(state)
    np.testing.assert_allclose(h.A[:, :7], normal @ J[None], atol=1e-12)
    expected = -30.0 * normal @ J @ state.v - normal @ drift_of(contacts, state)
    np.testing.assert_allclose(h.lower, expected)
    assert motion.row_names == ("end_effector along its normal",)
