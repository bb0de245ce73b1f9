"""Distances to obstacles and between capsules, and the rows that keep them."""

from dataclasses import replace

import numpy as np
import pytest
from scene import BODY, ROBOT, TIP, TURN, compiled_rows, states
from scipy.optimize import lsq_linear

from hierarchy import Robot, State
from hierarchy.avoidance import Barrier, Capsule, Obstacle, Obstacles
from hierarchy.avoidance.body import measure_capsules, pack_capsules
from hierarchy.paths import Ellipse
from hierarchy.tasks import SelfSeparation, Separation
from scenarios.cell.robot import on_column
from scenarios.cell.sensors import ExactDistances

ROUND = Ellipse((0.3, 0.5, 0.2), (0.2, 0.1, 0.0), (0.0, 0.1, 0.3), rate=2.0)
SHAPES = [
    Obstacle("point", (0.1, 0.5, 0.1)), Obstacle("sphere", (0, 0, 0), (0.07,), path=ROUND),
    Obstacle("capsule", (-0.1, 0.4, -0.1), (0.02, 0.2), TURN),
    Obstacle("capsule", (0, 0, 0), (0.05, 0.1), TURN, path=ROUND),
    Obstacle("box", (-0.3, 0.3, 0.4), (0.1, 0.3, 0.2), TURN),
    Obstacle("box", (0, 0, 0), (0.02, 0.1, 0.05), TURN, path=ROUND)]
STATES = states(20, seed=6)
SENSOR = ExactDistances(ROBOT, Obstacles(SHAPES), BODY, TIP, pairs=True)


def test_rows_give_the_second_derivative_of_the_distances_to_moving_obstacles():
    """The least d2h/dt2 is 2 rate (w - dh/dt), with w = min(-rate h / 2, slow), exactly."""
    rate, slow = 10.0, 0.2
    task = Separation(SENSOR.points, Barrier(0.0, rate, 5.0, slow, 1e9), len(SHAPES))
    h, rng, checked = 1e-4, np.random.default_rng(0), 0
    for q, v in STATES:
        a, d, facing = rng.normal(size=7), [], []
        for t in (-h, 0.0, h):
            seen = SENSOR.measure(State.at(ROBOT, q + v * t + a * t * t / 2, t=0.7 + t)).pairs
            d.append(seen.distance.ravel().copy())
            facing.append(SENSOR.measurement.pairs.straight.reshape(54, 3).copy())
        state = State.at(ROBOT, q, v, 0.7)
        SENSOR.measure(state)
        A, lower, _ = task.rows(state, "acceleration")
        second, speed = (d[2] - 2 * d[1] + d[0]) / h**2, (d[2] - d[0]) / (2 * h)
        found = A @ a - lower + 2.0 * rate * (np.minimum(-0.5 * rate * d[1], slow) - speed)
        same = (facing[0] == facing[2]).all(axis=1)  # no point passed from a side to an end
        np.testing.assert_allclose(found[same], second[same], atol=3e-5)
        checked += same.sum()
    assert checked >= 54 * len(STATES) - 2
    parts = seen.distance, seen.direction, seen.velocity, seen.acceleration, seen.straight
    np.testing.assert_array_equal(seen.table, np.dstack([*parts, seen.radius]))


# Capsules at odds with the links' own axes, so that every kind of nearest points comes up.
ODD = (Capsule("ball", 1, (0.1, 0.1, 0.1), (0.1, 0.1, 0.1), 0.05),
       Capsule("bar", 3, (-0.3, 0.1, 0.2), (0.3, 0.0, 0.3), 0.02),
       Capsule("rod", 5, (0.1, -0.3, 0.1), (0.0, 0.4, 0.3), 0.03),
       Capsule("hand", 7, (0.0, -0.2, 0.1), (0.0, 0.2, 0.0), 0.0))
ALL_PAIRS = Barrier(0.02, influence=5.0)
TASKS = {"arm": SelfSeparation(on_column(ROBOT, ROBOT.capsules, 0.3105), ALL_PAIRS),
         "odd": SelfSeparation(ODD, ALL_PAIRS, ((0, 1), (0, 2), (3, 1), (1, 2), (2, 3)))}
IDENTITY = np.r_[np.eye(3).ravel(), np.zeros(3)][None]


def segments():
    rng = np.random.default_rng(0)
    for _ in range(300):
        yield rng.normal(size=(2, 3)), rng.normal(size=(2, 3))
    for _ in range(100):  # parallel, nearly parallel, on one line, short, of no length
        a = rng.normal(size=(2, 3))
        shift, stretch = rng.normal(size=3), rng.normal()
        yield a, a + shift
        yield a, a[::-1] * stretch + shift
        yield a, a + shift + 1e-7 * rng.normal(size=(2, 3))
        yield a, a + stretch * (a[1] - a[0])
        yield a, shift + 1e-9 * a
        yield a, np.array([shift, shift])
        yield np.array([shift, shift]), a[[0, 0]]


def test_capsules_of_an_arm_on_a_moving_base_are_of_the_joints_behind_it():
    moved = Robot.named("kuka_lwr", "floating").capsules
    assert moved == tuple(replace(one, joint=one.joint + 1) for one in ROBOT.capsules)


def test_distance_of_segments_is_the_least_there_is():
    """That of the best shares of both, between 0 and 1; of capsules without radius, at rest."""
    for a, b in segments():
        (p, q), (r, s) = a, b = np.round(a, 12), np.round(b, 12)
        joints, table = pack_capsules([Capsule("a", 0, *a, 0.0), Capsule("b", 0, *b, 0.0)])
        seen = measure_capsules(IDENTITY, joints, table, np.array([[0, 1]]))[0]
        best = lsq_linear(np.c_[q - p, r - s], r - p, (0.0, 1.0), "bvls", tol=1e-15)
        assert seen[0] == pytest.approx(np.sqrt(2.0 * best.cost), abs=2e-8)
        assert 0.0 <= seen[4:].min() <= seen[4:].max() <= 1.0
        on_a, on_b = [np.add(p, share * np.subtract(q, p))
                      for (p, q), share in zip((a, b), seen[4:], strict=True)]
        assert np.linalg.norm(seen[1:4]) == pytest.approx(1)
        if seen[0] > 1e-6:
            np.testing.assert_allclose(seen[0] * seen[1:4], on_a - on_b, atol=1e-9)


def test_a_robot_with_arms_keeps_the_pairs_apart_that_can_be():
    """Of its capsules as one chain, some overlap always: the shoulders with the chest."""
    humanoid = Robot.load("humanoid")
    at_rest, kept = State.at(humanoid, humanoid.rest), Barrier(0.02)
    assert SelfSeparation(humanoid.capsules, kept).distances(at_rest).min() < -0.1
    assert SelfSeparation.of(humanoid, kept).distances(at_rest).min() > 0.03


def test_rows_give_the_second_derivative_with_nearest_points_that_slide():
    rate, kept, slow = 10.0, 0.02, 0.2
    task = replace(TASKS["odd"], barrier=Barrier(kept, rate, 5.0, slow, limit=1e9))
    h, rng, kinds = 5e-5, np.random.default_rng(0), set()
    for q, v in states(40, seed=3):
        a, d, free = rng.normal(size=7), [], []
        for t in (-h, 0.0, h):
            state = State.at(ROBOT, q + v * t + a * t * t / 2)
            d.append(task.distances(state))
            seen = measure_capsules(state.placements, *pack_capsules(task.capsules), task.indices)
            free.append((seen[:, 4:] > 0) & (seen[:, 4:] < 1))
        state = State.at(ROBOT, q, v)
        A, lower, _ = task.rows(state, "acceleration")
        second, speed = (d[2] - 2 * d[1] + d[0]) / h**2, (d[2] - d[0]) / (2 * h)
        toward = np.minimum(-0.5 * rate * (d[1] - kept), slow)
        same = (free[0] == free[2]).all(axis=1)  # no nearest point came to an end in between
        calm = same & (np.abs(second) < 100.0)
        np.testing.assert_allclose((A @ a - lower + 2.0 * rate * (toward - speed))[calm],
                                   second[calm], atol=2e-3)
        assert calm.sum() >= 4
        kinds |= {tuple(pair) for pair in free[1][calm].tolist()}
    assert len(kinds) == 4


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("differences", [None, 1e-3])
@pytest.mark.parametrize("task", [
    *(Separation(SENSOR.points, Barrier(0.05, influence=0.6), of) for of in (len(SHAPES), None)),
    *(SelfSeparation(kind.capsules, Barrier(0.02, influence=0.4), kind.pairs)
      for kind in TASKS.values())], ids=["6 shapes", "any", *TASKS])
def test_compiled_rows_equal_those_of_the_plain_methods(task, level, differences):
    sided = 0
    for q, v in STATES[:8]:
        state = State.at(ROBOT, q, v, 0.7, differences)
        state.move(0.701, q + 1e-3 * v, v)
        SENSOR.measure(state)
        _, lower, _ = compiled_rows(task, state, level, rtol=1e-11)
        sided += np.isfinite(lower).sum()
    assert 0 < sided < 8 * task.dimension
