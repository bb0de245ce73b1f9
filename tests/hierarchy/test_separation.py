import numpy as np
import pytest
from scene import BODY, ROBOT, TIP, compiled_rows, states

from hierarchy import HierarchyError, State
from hierarchy.avoidance import Barrier, Measurement, Obstacle, Obstacles, Pairs
from hierarchy.paths import Ellipse
from hierarchy.tasks import Separation
from scenarios.cell.sensors import ExactDistances

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
ROUND = Ellipse((0.3, 0.5, 0.2), (0.2, 0.1, 0.0), (0.0, 0.1, 0.3), rate=2.0)
SHAPES = [
    Obstacle("point", (0.1, 0.5, 0.1)),
    Obstacle("sphere", (0, 0, 0), (0.07,), path=ROUND),
    Obstacle("capsule", (-0.1, 0.4, -0.1), (0.02, 0.2), TURN),
    Obstacle("capsule", (0, 0, 0), (0.05, 0.1), TURN, path=ROUND),
    Obstacle("box", (-0.3, 0.3, 0.4), (0.1, 0.3, 0.2), TURN),
    Obstacle("box", (0, 0, 0), (0.02, 0.1, 0.05), TURN, path=ROUND),
]
STATES = states(20, seed=6)
LEVELS = ["velocity", "acceleration"]
START = np.array([0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0])


def sensor_of(obstacles):
    return ExactDistances(ROBOT, Obstacles(obstacles), BODY, TIP, pairs=True)


SENSOR = sensor_of(SHAPES)
EVERYWHERE = Barrier(0.05, influence=5.0)


def seen_at(q, v, t=0.7, differences=None):
    state = State.at(ROBOT, q, v, t, differences)
    SENSOR.measure(state)
    return state


def distances(q, t):
    return SENSOR.measure(State.at(ROBOT, q, t=t)).pairs.distance.ravel().copy()


def rows(count, n=7):
    return np.full((count, n), 5.0), np.full(count, 5.0), np.full(count, 5.0)


def test_rows_give_the_second_derivative_of_the_distances_to_moving_obstacles():
    """The least d2h/dt2 is 2 rate (w - dh/dt), with w = min(-rate h / 2, slow), exactly."""
    rate, slow = 10.0, 0.2
    task = Separation(SENSOR.points, Barrier(0.0, rate, 5.0, slow, 1e9), len(SHAPES))
    h, rng, checked = 1e-4, np.random.default_rng(0), 0
    for q, v in STATES:
        a, d, facing = rng.normal(size=7), [], []
        for t in (-h, 0.0, h):
            d.append(distances(q + v * t + a * t * t / 2, 0.7 + t))
            facing.append(SENSOR.measurement.pairs.straight.reshape(54, 3).copy())
        state = seen_at(q, v)
        A, lower, _ = task.rows(state, "acceleration")
        second, speed = (d[2] - 2 * d[1] + d[0]) / h**2, (d[2] - d[0]) / (2 * h)
        toward = np.minimum(-0.5 * rate * d[1], slow)
        found = A @ a - lower + 2.0 * rate * (toward - speed)
        same = (facing[0] == facing[2]).all(axis=1)  # no point passed from a side to an end
        np.testing.assert_allclose(found[same], second[same], atol=3e-5)
        checked += same.sum()
    assert checked >= 54 * len(STATES) - 2


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("differences", [None, 1e-3])
@pytest.mark.parametrize("obstacles", [len(SHAPES), None])
def test_compiled_rows_equal_those_of_the_plain_methods(level, differences, obstacles):
    task = Separation(SENSOR.points, Barrier(0.05, influence=0.6), obstacles)
    sided = 0
    for q, v in STATES[:5]:
        state = State.at(ROBOT, q, v, 0.7, differences)
        state.move(0.701, q + 1e-3 * v, v)
        SENSOR.measure(state)
        _, lower, _ = compiled_rows(task, state, level)
        sided += np.isfinite(lower).sum()
    assert 0 < sided < 5 * task.dimension


@pytest.mark.parametrize(("pairs", "obstacles", "said"), [
    (None, 1, "'separation': the state carries no measurement of pairs"),
    (Pairs(9, 2), 1, "9 points are measured against 2 obstacles, expected 9 against 1"),
    (Pairs(8, 1), 1, "8 points .* expected 9"),
    (Pairs(9, 0), None, "9 points are measured against 0 obstacles, .* one at least")])
def test_a_measurement_that_does_not_fit_is_named(pairs, obstacles, said):
    state = State.at(ROBOT, START)
    task = Separation(SENSOR.points, EVERYWHERE, obstacles)
    with pytest.raises(HierarchyError, match="measurement of pairs"):
        task.writer(state, "velocity", *rows(18), row=0)()
    state.measurement = Measurement(8)
    state.measurement.pairs = pairs
    with pytest.raises(HierarchyError, match=said):
        task.writer(state, "velocity", *rows(18), row=0)()
