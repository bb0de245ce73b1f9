"""Bounds that slow a joint which would move a control point to an obstacle."""

import numpy as np
import pytest
from scene import ROBOT, SENSOR, place_of, state_at, states
from standing import written

from hierarchy import Stack
from hierarchy.tasks import CumulatedRepulsion, JointDamping, JointLimits, Posture
from hierarchy.tasks.danger_bounds import DangerBounds

PERIOD, REACH, SHAPE = 1e-3, 0.5, 6.0
LIMITS = JointLimits(ROBOT, 30.0, PERIOD)
QUICK = JointLimits(ROBOT, 1e6, PERIOD)  # its accelerations limit nothing
V = ROBOT.velocity_limit
STATES = states(40, seed=8)

levels = pytest.mark.parametrize("level", ["velocity", "acceleration"])


def task(limits=LIMITS, **settings):
    return DangerBounds(limits, SENSOR.points, **({"reach": REACH, "shape": SHAPE} | settings))


def danger(distance):
    near = np.exp(-SHAPE)  # so that the danger is 1 at contact
    return (1.0 + near) / (1.0 + near * np.exp(2.0 * max(distance, 0.0) / REACH * SHAPE))


def columns(q, v):
    """r^T J_c (K, n) of all points, by central differences of where they are."""
    seen, step = state_at(q, v).measurement, 1e-6
    there = [[state_at(q + sign * step * e, v).measurement.points.copy() for sign in (1, -1)]
             for e in np.eye(7)]
    J = np.array([(plus - minus) / (2 * step) for plus, minus in there])  # (n, K, 3)
    state_at(q, v)
    return np.einsum("nki,ki->kn", J, seen.direction)


def velocity_sides(q, v):
    """What the greatest danger leaves of each joint's velocities, from the definition."""
    seen = state_at(q, v).measurement
    f = np.array([danger(D) for D in seen.distance])
    toward = columns(q, v)
    forward = np.max(np.where(toward < -1e-8, f[:, None], 0.0), axis=0)
    backward = np.max(np.where(toward > 1e-8, f[:, None], 0.0), axis=0)
    return -V * (1.0 - backward), V * (1.0 - forward)


def test_the_bounds_are_those_of_the_definition_at_velocity_level():
    brought_in = 0
    for q, v in STATES:
        low, up = task(QUICK).box(state_at(q, v), "velocity")
        least, most = QUICK.box(state_at(q, v), "velocity")
        expected = [np.clip(side, least, most) for side in velocity_sides(q, v)]
        np.testing.assert_allclose([low, up], expected, atol=1e-7)
        brought_in += (up < most - 1e-3).sum() + (low > least + 1e-3).sum()
    assert brought_in > 100


@levels
def test_the_box_is_never_empty_lies_in_that_of_the_limits_and_lets_a_joint_brake(level):
    rng = np.random.default_rng(0)
    for q, v in STATES:
        for fast in (0.0, 0.5, 3.0):
            state = state_at(q + rng.normal(size=7), fast * v)
            low, up = task().box(state, level)
            least, most = LIMITS.box(state, level)
            halt = np.clip(-state.v / PERIOD if level == "acceleration" else 0.0, least, most)
            assert (np.diff([least, low, halt, up, most], axis=0) >= 0.0).all()


WITHIN = 0.5


def by_hand(state, acceleration, lever, h=1e-5):
    """The sum, with Jacobians as central differences of places."""
    seen, total = state.measurement, np.zeros(7)
    for k in range(8):
        if seen.distance[k] > WITHIN:
            continue
        r = seen.direction[k].copy()

        def row(q, point=ROBOT.control_points[k], r=r):
            return np.array([r @ (place_of(point, q + s) - place_of(point, q - s)) / (2 * h)
                             for s in h * np.eye(7)])

        J = row(state.q)
        drift = (row(state.q + 1e-4 * state.v) - row(state.q - 1e-4 * state.v)) @ state.v / 2e-4
        asked = seen.magnitude[k] - (drift if acceleration else 0.0)
        total += J * asked / max(J @ J, lever**2)
    return total


@pytest.mark.parametrize("lever", [0.05, 0.6])
def test_it_is_the_sum_of_what_each_near_point_asks_for(lever):
    task, counted = CumulatedRepulsion(7, ROBOT.control_points, WITHIN, lever=lever), 0
    for q, v in states(4, seed=3):
        state = state_at(q, v)
        counted += int((state.measurement.distance[:8] <= WITHIN).sum())
        np.testing.assert_allclose(task.reference_acceleration(state), by_hand(state, True, lever),
                                   rtol=1e-4, atol=1e-4)
        np.testing.assert_allclose(task.reference_velocity(state), by_hand(state, False, lever),
                                   rtol=1e-6, atol=1e-8)
    assert 8 < counted < 32, "some points are near, and some are not"


@levels
def test_the_rows_are_the_identity_with_the_box_as_sides(level):
    for q, v in STATES[:5]:
        state = state_at(q, v)
        A, *sides = written(task(), state, level, 7)
        np.testing.assert_array_equal(sides, task().box(state, level))
        for identity in (A, task().jacobian(state)):
            np.testing.assert_array_equal(identity, np.eye(7))
        assert not task().jacobian_derivative(state).any()
        np.testing.assert_array_equal(task().error(state), LIMITS.error(state))


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("base", [None, JointDamping(7, 3.0), Posture((0.1,) * 7)])
def test_a_stack_has_it_as_its_null_space_term_added_to_the_base(level, base):
    task = CumulatedRepulsion(7, ROBOT.control_points, WITHIN, base)
    stack = Stack([Posture((0.0,) * 7, name="any")], level, task)
    for q, v in states(3):
        state = state_at(q, v)
        for _ in range(2):  # nothing of the tick before is left
            found = stack.hierarchy(state).reference.copy()
        expected = CumulatedRepulsion(7, ROBOT.control_points, WITHIN)
        sides = [getattr(one, f"reference_{level}")(state) for one in (expected, base) if one]
        np.testing.assert_allclose(found, sum(sides), atol=1e-12)
