"""The repulsion of all control points as one null-space term."""

import numpy as np
import pytest
from scene import ROBOT, place_of, state_at, states

from hierarchy import Stack
from hierarchy.tasks import CumulatedRepulsion, JointDamping, Posture

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


def test_far_from_everything_it_is_the_base():
    task = CumulatedRepulsion(7, ROBOT.control_points, 0.0, JointDamping(7, 2.0))
    q, v = states(1)[0]
    np.testing.assert_array_equal(task.reference_acceleration(state_at(q, v)), -2.0 * v)
