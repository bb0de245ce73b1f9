"""Inverse kinematics of a bare robot in one call."""

import numpy as np
import pytest

from hierarchy import HierarchyError, Robot, State
from hierarchy.paths import Still
from hierarchy.tasks import JointLimits, Pose, Position, Posture
from solvers import Status, make, solve_ik

ROBOT = Robot.named("kuka_lwr")
FRAME = ROBOT.frame("end_effector")
Q = np.array([0.9, -0.9, 0.9, 1.2, 1.0, 1.0, 0.3])
pytestmark = pytest.mark.slow


def hand(shift, gain=10.0):
    return Position(FRAME, Still(State.at(ROBOT, Q).position(FRAME) + shift), gain=gain)


def follow(q, tasks, steps, **settings):
    memory = None
    for _ in range(steps):
        step = solve_ik(ROBOT, q, tasks, memory=memory, **settings)
        assert step.status is Status.SOLVED
        memory, q = step.memory, ROBOT.integrate(q, step.v * settings.get("dt", 0.01))
    return q


def test_one_call_gives_velocity_status_and_memory():
    v, status, memory = solve_ik(ROBOT, Q, [hand([0.01, 0.0, 0.0])], dt=0.01)
    assert v.shape == (7,)
    assert status is Status.SOLVED
    assert memory is not None
    J = Position(FRAME, Still([0, 0, 0])).jacobian(State.at(ROBOT, Q))
    np.testing.assert_allclose(J @ v, [0.1, 0.0, 0.0], atol=1e-10)


def test_a_few_steps_reach_the_target_and_keep_the_order():
    rest = Posture(tuple(Q + 0.3), gain=2.0)
    q = follow(Q, [hand([0.05, -0.03, 0.04]), rest], 400)
    np.testing.assert_allclose(hand([0.05, -0.03, 0.04]).error(State.at(ROBOT, q)), 0.0, atol=1e-9)
    assert 0.01 < np.linalg.norm(rest.error(State.at(ROBOT, q))) < np.linalg.norm(np.full(7, 0.3))


def test_limits_of_the_robot_hold_whatever_is_asked():
    far = Posture(tuple(ROBOT.upper + 1.0), gain=50.0)
    step = solve_ik(ROBOT, Q, [far])
    assert (np.abs(step.v) <= ROBOT.velocity_limit + 1e-12).all()
    q = follow(Q, [far], 300)
    assert (q <= ROBOT.upper + 1e-9).all()
    np.testing.assert_allclose(q, ROBOT.upper, atol=1e-9)
    free = solve_ik(ROBOT, Q, [far], limits=False)
    assert (np.abs(free.v) > ROBOT.velocity_limit).any()


def test_beyond_a_limit_a_joint_comes_back_as_fast_as_it_may():
    q = Q.copy()
    q[3] = ROBOT.upper[3] + 0.5
    v = solve_ik(ROBOT, q, [Posture(tuple(q))]).v
    assert v[3] == pytest.approx(-ROBOT.velocity_limit[3])


def test_limits_may_be_a_task_of_their_own():
    slow = JointLimits(ROBOT, acceleration=5.0, period=0.01)
    v = solve_ik(ROBOT, Q, [hand([0.5, 0.0, 0.0])], limits=slow, dt=0.01, v=np.zeros(7)).v
    assert np.abs(v).max() == pytest.approx(0.05)


def test_any_resolver_may_solve_it():
    tasks = [hand([0.01, 0.0, 0.0])]
    reference = solve_ik(ROBOT, Q, tasks).v
    for resolver in ("hqp", "sns", make("tpm", form="staircase")):
        np.testing.assert_allclose(solve_ik(ROBOT, Q, tasks, resolver=resolver).v, reference,
                                   atol=1e-5)
    np.testing.assert_allclose(solve_ik(ROBOT, Q, tasks, resolver="recursive", limits=False).v,
                               reference, atol=1e-9)
    with pytest.raises(HierarchyError, match="limits, row 0: an inequality"):
        solve_ik(ROBOT, Q, tasks, resolver="recursive")


def test_a_floating_base_has_no_limits_of_its_own():
    robot = Robot.named("humanoid")
    frame = robot.frame("right_hand")
    here = State.at(robot, robot.rest)
    task = Pose(frame, Still(here.position(frame) + np.array([0.02, 0, 0])), here.rotation(frame))
    step = solve_ik(robot, robot.rest, [task])
    assert step.status is Status.SOLVED
    np.testing.assert_allclose(task.jacobian(here) @ step.v, [0.2, 0, 0, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(("call", "said"), [
    (lambda: solve_ik("kuka_lwr", Q, []), "solve_ik: robot: expected a Robot, got str 'kuka_lwr'"),
    (lambda: solve_ik(ROBOT, Q[:3], [hand([0, 0, 0])]), "q has shape (3,), expected (7,)"),
    (lambda: solve_ik(ROBOT, Q, hand([0, 0, 0])), "solve_ik: tasks: expected a Sequence"),
    (lambda: solve_ik(ROBOT, Q, ["hand"]), "a stack: expected a Task, got str 'hand'"),
    (lambda: solve_ik(ROBOT, Q, [hand([0, 0, 0])], dt=0.0), "dt = 0.0 s must be positive"),
    (lambda: solve_ik(ROBOT, Q, [hand([0, 0, 0])], resolver="hcodd"), "did you mean 'hcod'"),
    (lambda: solve_ik(ROBOT, Q, [], limits=False), "the stack is empty"),
    (lambda: solve_ik(ROBOT, Q, [hand([0, 0, 0])], memory="last"),
     "solve_ik: memory: expected a Memory, got str 'last'"),
])
def test_wrong_arguments_are_named(call, said):
    with pytest.raises(HierarchyError) as error:
        call()
    assert said in str(error.value)
