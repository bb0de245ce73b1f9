"""Joints that follow others, and closed chains: rows at the top of every stack."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar

from hierarchy import Robot, Stack, State
from hierarchy.robots.found import Loop
from hierarchy.tasks import Posture
from hierarchy.tasks.mechanism import Mechanism, model_rows
from solvers import make

PERIOD = 0.001  # [s]
TILT = pin.exp3(np.array([0.4, -0.3, 0.2]))


def bar(rigid=False):
    """Four bars whose rocker turns in a ball where it meets the ground: the chain is not planar."""
    return four_bar(rigid, TILT, pin.JointModelSpherical())


ROBOT = bar()


def start(robot=ROBOT):
    return Mechanism(robot).closed(robot.configuration({"crank": -0.8, "finger": 0.3}),
                                   ["crank", "finger"])


@pytest.mark.parametrize("rigid", [False, True])
def test_rows_of_a_mechanism_are_derivatives_of_its_error(rigid):
    robot, h, rng = bar(rigid), 1e-6, np.random.default_rng(2)
    (task,) = model_rows(robot)
    assert task.dimension == (7 if rigid else 4)
    q = robot.integrate(start(), 0.05 * rng.normal(size=robot.n))
    v = rng.normal(size=robot.n)

    def at(step):
        return State.at(robot, robot.integrate(q, step), v)

    rows = slice(0, 4)  # the error of a turn is linear only near zero
    columns = [(task.error(at(-h * e)) - task.error(at(h * e))) / (2 * h) for e in np.eye(robot.n)]
    np.testing.assert_allclose(np.transpose(columns)[rows], task.jacobian(at(0 * v))[rows],
                               atol=1e-8)
    np.testing.assert_allclose(
        task.jacobian_derivative(at(0 * v)),
        (task.jacobian(at(h * v)) - task.jacobian(at(-h * v))) / (2 * h), atol=1e-8)


def planar_bar(rigid, rounding):
    """Four bars whose axes are parallel but for rounding, in a plane that is none of the world."""
    model, rng = pin.Model(), np.random.default_rng(0)
    chain = [("crank", 0, 0.0), ("coupler", 1, 0.2), *[("knee", 2, 0.4)] * rigid,
             ("rocker", 0, 0.5)]
    for name, parent, x in chain:
        tilt = np.eye(3) if parent else TILT
        joint = model.addJoint(parent, pin.JointModelRY(), pin.SE3(
            tilt @ pin.exp3(rounding * rng.normal(size=3)),
            tilt @ np.array([x, 0, 0]) + rounding * rng.normal(size=3)), name)
    ends = [("end", len(chain) - 1, 0.15 if rigid else 0.4, 0.0),
            ("tip", joint, 0.15 if rigid else 0.3, np.pi * rigid)]
    for name, joint, x, turn in ends:
        place = pin.SE3(pin.exp3(np.array([0, turn, 0])), np.array([x, 0, 0]))
        model.addFrame(pin.Frame(name, joint, 0, place, pin.FrameType.OP_FRAME))
    robot = Robot(model, "planar")
    robot.loops = (Loop("pin", ("end", "tip"), rigid),)
    return robot


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("rounding", [0.0, 1e-6])
def test_a_chain_in_a_plane_moves_although_its_file_is_rounded(rigid, rounding):
    """What rounding opens across the plane no motion closes: once the joints were thrown after it.

    The answer depends on neither the resolver nor, much, on the rounding.
    """
    robot, ends = planar_bar(rigid, rounding), []
    begin = Mechanism(robot).closed(robot.configuration({"crank": -0.8}), ["crank"])
    for resolver in ("hcod", "recursive"):
        stack = Stack([*model_rows(robot, PERIOD), Posture({"crank": -0.4}, gain=10.0)],
                      "velocity")
        q, state, solver = begin, State(robot), make(resolver)
        for _ in range(500):
            state.move(0.0, q, np.zeros(robot.n))
            x = solver.solve(stack.hierarchy(state)).x
            assert np.abs(x).max() < 20.0
            q = q + PERIOD * x
        assert Mechanism(robot).gap(q)[0] < 1e-9 + 5.0 * rounding
        ends.append(q)
    exact = planar_bar(rigid, 0.0)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    assert np.abs(ends[0] - begin).max() > 0.1, "it moved"
    assert Mechanism(exact).gap(ends[0])[0] < 1e-8 + 20.0 * rounding
