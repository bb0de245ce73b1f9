"""Distances, repulsion, Algorithm 1, and bounds that slow a joint near an obstacle."""

from math import inf, nan

import coal
import numpy as np
import pytest
from scene import BODY, OBSTACLES, ROBOT, SENSOR, TIP, TURN, distance, place_of, state_at, states
from standing import written

from hierarchy import State
from hierarchy.allocation import allocate
from hierarchy.avoidance import Obstacle, Obstacles, Repulsion, SurveillanceAreas
from hierarchy.paths import Waypoints
from hierarchy.tasks import CumulatedRepulsion, DangerBounds, JointLimits

SHAPES = {shape: Obstacle(shape, (0.1, -0.2, 0.3), *size) for shape, *size in (
    ["point"], ["sphere", (0.15,)], ["capsule", (0.1, 0.25), TURN], ["box", (0.2, 0.1, 0.3), TURN])}


def by_coal(obstacle, point):
    """The signed distance that coal has to the same body."""
    body = {"point": lambda: coal.Sphere(1e-10), "sphere": coal.Sphere,
            "capsule": lambda radius, half: coal.Capsule(radius, 2 * half),
            "box": lambda *half: coal.Box(2 * np.array(half))}[obstacle.shape](*obstacle.size)
    places = [coal.Transform3s(np.array(turn), np.array(place)) for turn, place in (
        (obstacle.rotation, obstacle.centre), (np.eye(3), point))]
    return coal.distance(body, places[0], coal.Sphere(1e-10), places[1], coal.DistanceRequest(),
                         coal.DistanceResult())


@pytest.mark.parametrize("shape", SHAPES)
def test_distance_is_that_of_coal_with_a_gradient_of_one(shape):
    obstacle, h = SHAPES[shape], 1e-6
    for point in np.random.default_rng(2).uniform(-0.6, 0.6, (80, 3)):
        D, away = distance(obstacle, point)
        assert D == pytest.approx(by_coal(obstacle, point), abs=1e-9)
        gradient = [(distance(obstacle, point + h * e)[0] - distance(obstacle, point - h * e)[0])
                    / (2 * h) for e in np.eye(3)]
        np.testing.assert_allclose(away, gradient, atol=1e-7)
        assert np.linalg.norm(away) == pytest.approx(1)
        assert distance(obstacle, point - D * away)[0] == pytest.approx(0, abs=1e-12)


def test_an_obstacle_follows_its_path_and_keeps_the_offset_that_it_was_shifted_by():
    path = Waypoints((0.5, 2.5), ((0, 0, 0), (1, 0, 0)))
    obstacles = Obstacles([Obstacle("sphere", (9, 9, 9), (0.1,), path=path), SHAPES["box"]])
    np.testing.assert_array_equal(obstacles.centres[0], 0.0)
    np.testing.assert_allclose(obstacles.at(1.5)[:, 4:7], [[0.5, 0, 0], [0.1, -0.2, 0.3]])
    for offset in ((0.0, 0.0, 0.5), (0.0, 0.1, 0.0)):  # not one on top of the other
        for which in (0, 1):
            obstacles.shift(which, offset)
    np.testing.assert_allclose(obstacles.at(3.0)[:, 4:7], [[1, 0.1, 0], [0.1, -0.1, 0.3]])
    np.testing.assert_allclose(obstacles.centres[1], [0.1, -0.1, 0.3])


def test_magnitude_reaches_its_maximum_at_contact_and_vanishes_at_the_reach():
    """Equation (24), which the letter's (23) as printed contradicts."""
    law = Repulsion(maximum=2.0, reach=0.15, shape=20.0)
    assert law(0.0) == pytest.approx(2.0, rel=1e-8)
    assert (law(0.15), law(0.075)) == (pytest.approx(0.0, abs=1e-8), pytest.approx(1.0))
    assert (np.diff([law(D) for D in np.linspace(0, 1, 50)]) <= 0).all()
    assert law(1e6) == 0.0


def test_the_active_point_is_the_nearest_one_without_the_end_effector():
    for q, v in states(30, seed=4):
        seen = SENSOR.measure(State.at(ROBOT, q, v))
        for k, point in enumerate(SENSOR.points):
            np.testing.assert_allclose(seen.points[k], place_of(point, q), atol=1e-14)
            each = [distance(o, seen.points[k])[0] for o in OBSTACLES.obstacles]
            assert seen.distance[k] == pytest.approx(min(each))
            assert seen.nearest[k] == int(np.argmin(each))
            law = TIP if k == 8 else BODY
            assert seen.magnitude[k] == pytest.approx(law(max(min(each), 0.0)))
        assert seen.active == int(np.argmin(seen.distance[:8]))
        assert seen.minimal_distance == seen.distance[:8].min()
        assert seen.end_effector_distance == seen.distance[8]


# Algorithm 1.
AREAS = SurveillanceAreas(near=0.05, far=0.15, end_effector=0.1)
A, P, C = "avoidance", "position", "pointing"


@pytest.mark.parametrize(("body", "end", "cone", "order", "repulsion"), [
    # far from everything
    (0.20, 0.20, -1, (P,), False),
    (0.20, 0.20, +1, (P, C), False),
    (inf, inf, +1, (P, C), False),
    # the outer area: avoidance last
    (0.10, 0.20, -1, (P, A), False),
    (0.10, 0.20, +1, (P, C, A), False),
    (0.10, 0.08, +1, (P, C, A), True),
    # the inner area, the body nearer than the end effector: avoidance first
    (0.04, 0.20, -1, (A, P), False),
    (0.04, 0.20, +1, (A, P, C), False),
    (0.04, 0.08, +1, (A, P, C), True),
    # the inner area, the end effector nearer: avoidance second
    (0.04, 0.03, -1, (P, A), True),
    (0.04, 0.03, +1, (P, A, C), True),
    # ties
    (0.05, 0.20, -1, (A, P), False),       # D_minimal = eps_1 is near
    (0.15, 0.20, +1, (P, C, A), False),    # D_minimal = eps_2 is in the outer area
    (0.04, 0.04, -1, (P, A), True),        # equal distances: the end effector wins
    (0.20, 0.10, -1, (P,), True),          # D_ee = eps_ee repels
    (0.20, 0.20, 0.0, (P,), False),        # on the cone: not asked for
    (0.1500001, 0.1000001, -1, (P,), False),
    (0.0, 0.0, +1, (P, A, C), True),
    (0.20, 0.20, nan, (P,), False)])       # no pointing task
def test_every_branch_and_tie_of_algorithm_1(body, end, cone, order, repulsion):
    assert allocate(body, end, cone, AREAS) == (order, repulsion)


PERIOD, REACH, SHAPE = 1e-3, 0.5, 6.0
LIMITS = JointLimits(ROBOT, 30.0, PERIOD)
QUICK = JointLimits(ROBOT, 1e6, PERIOD)  # its accelerations limit nothing
V = ROBOT.velocity_limit
STATES = states(40, seed=8)
levels = pytest.mark.parametrize("level", ["velocity", "acceleration"])


def task(limits=LIMITS, **settings):
    return DangerBounds(limits, SENSOR.points, **({"reach": REACH, "shape": SHAPE} | settings))


def toward(q, directions, h=1e-5):
    """r^T J_c (K, n) of all points, by central differences of where they are."""
    places = [[np.array([place_of(point, q + step) for point in SENSOR.points])
               for step in (h * e, -h * e)] for e in np.eye(7)]
    return np.einsum("nki,ki->kn", [ahead - behind for ahead, behind in places],
                     directions) / (2 * h)


def velocity_sides(q, v):
    """What the greatest danger leaves of each joint's velocities, from the definition."""
    seen, near = state_at(q, v).measurement, np.exp(-SHAPE)
    along = toward(q, seen.direction)
    f = (1.0 + near) / (1.0 + near * np.exp(2.0 * np.maximum(seen.distance, 0.0) / REACH * SHAPE))
    forward, backward = (np.max(np.where(away < -1e-8, f[:, None], 0.0), axis=0)
                         for away in (along, -along))  # danger 1 at contact
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
        A, *sides = written(task(), state, level, 7)
        np.testing.assert_array_equal(sides, (low, up))
        for identity in (A, task().jacobian(state)):
            np.testing.assert_array_equal(identity, np.eye(7))
        assert not task().jacobian_derivative(state).any()
        np.testing.assert_array_equal(task().error(state), LIMITS.error(state))


WITHIN = 0.5


def by_hand(state, acceleration, lever):
    """The sum over the points of the body that are near, their rows by central differences."""
    seen, r = state.measurement, state.measurement.direction
    J, later, before = (toward(state.q + step * state.v, r) for step in (0.0, 1e-4, -1e-4))
    asked = seen.magnitude - acceleration * (later - before) @ state.v / 2e-4
    near = seen.distance[:8] <= WITHIN
    return (asked / np.maximum(np.sum(J * J, axis=1), lever**2))[:8][near] @ J[:8][near]


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
