"""Robots with branches and floating bases, and scenarios whose tasks are listed in order."""

import numpy as np
import pytest
from scene import compiled_rows

from hierarchy import Robot, State
from hierarchy.paths import Ellipse
from hierarchy.tasks import CentreOfMass, Pointing, Pose, Position
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.measure.metrics import measure

pytestmark = pytest.mark.slow

ROBOTS = {name: Robot.named(name) for name in ("humanoid", "dual_arm")}
PATH = Ellipse((0.1, 0.2, 0.8), (0.1, 0.0, 0.1), (0.0, 0.1, 0.0), rate=1.3)
STEP = 1e-6


def tasks(robot):
    hand = robot.frame("left_hand")
    return {"position": Position(hand, PATH), "pose": Pose(hand, PATH, np.eye(3)),
            "pointing": Pointing(hand, (1.0, 0.2, 0.0), 0.3),
            "centre of mass": CentreOfMass(robot, PATH),
            "centre of mass, x and y": CentreOfMass(robot, PATH, (0, 1))}


def some_states(robot, count=5, seed=1):
    rng = np.random.default_rng(seed)
    return [(robot.integrate(robot.rest, 0.3 * rng.normal(size=robot.n)),
             rng.normal(size=robot.n)) for _ in range(count)]


CASES = [(name, task) for name, robot in ROBOTS.items() for task in tasks(robot)]


@pytest.mark.parametrize(("name", "task"), CASES)
def test_jacobian_derivative_and_compiled_rows_are_right_on_a_robot_with_branches(name, task):
    robot = ROBOTS[name]
    task = tasks(robot)[task]
    for q, v in some_states(robot, 2):
        def moved(step, q=q, v=v):
            return State.at(robot, robot.integrate(q, step), v, 0.7)

        state = State.at(robot, q, v, 0.7)
        if task.name != "pose":  # whose rows are the angular velocity, not the error's derivative
            columns = [(task.error(moved(-STEP * e)) - task.error(moved(STEP * e))) / (2 * STEP)
                       for e in np.eye(robot.n)]
            np.testing.assert_allclose(task.jacobian(state), np.transpose(columns), atol=2e-8)
        later, before = moved(STEP * v), moved(-STEP * v)
        difference = (task.jacobian(later) - task.jacobian(before)) / (2 * STEP)
        np.testing.assert_allclose(task.jacobian_derivative(state), difference, atol=2e-8)
        for level in ("velocity", "acceleration"):
            compiled_rows(task, state, level, rtol=1e-10)


@pytest.fixture(scope="module")
def standing():
    return simulate(load("humanoid"))


def test_all_levels_above_the_posture_are_met_and_their_errors_recorded(standing):
    assert standing.fault is None
    found = measure(standing)
    for name in ("left_foot", "right_foot", "centre_of_mass"):
        assert found[f"task_{name}_rms"].value < 1e-5
    for name in ("right_hand", "left_hand"):
        assert found[f"task_{name}_max_settled"].value < 1e-4, "what a period of 5 ms leaves"
        assert found[f"task_{name}_end"].value < 1e-5
    assert found["task_gaze_max_settled"].value < 0.05
    assert found["task_left_foot_turned_rms"].unit == "deg"
    assert found["joint_limit_excess"].value == 0.0
    cell, k = build(standing.scenario), 700
    cell.state.move(standing["t"][k], standing["q"][k], standing["v"][k])
    for task in cell.tasks.listed:
        np.testing.assert_allclose(standing[f"task_error_{task.name.replace(' ', '_')}"][k],
                                   task.error(cell.state), atol=1e-15)
