"""Inverse kinematics of a bare robot, and whole-body dynamics of a humanoid."""

from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scene import FRAME, ROBOT, of_user, resting
from standing import ROBOT as HUMANOID
from standing import WEIGHT, feet, standing_stack
from urdf_text import LIMIT, joint, link, loaded, placed

from hierarchy import Hierarchy, Robot, State, tasks
from hierarchy.avoidance import Barrier
from hierarchy.paths import Still, circle
from solvers import Status, certify, explain, make, solve_ik
from solvers.ik import _of_thread
from solvers.qp.backends import installed
from solvers.reaching import _above

Q = np.array([0.9, -0.9, 0.9, 1.2, 1.0, 1.0, 0.3])
AT = State.at(ROBOT, Q)
ELBOW = ROBOT.frame("joint_4")
TURN = np.array([[-1, -2, 2], [2, 1, 2], [-2, 2, 1]]) / 3.0
HOME, HIGH = tasks.Posture(tuple(Q), gain=2.0), tasks.Posture((0.5,) * 7)


def follow(wanted, ticks, dt=0.01, **settings):
    """Return q and velocities (ticks, n) of a robot that obeys at once."""
    q, memory, v = Q, None, []
    for _ in range(ticks):
        step = solve_ik(ROBOT, q, wanted, dt=dt, memory=memory, **settings)
        assert step.status is Status.SOLVED
        memory, q = step.memory, ROBOT.integrate(q, step.v * dt)
        v.append(step.v)
    return q, np.array(v)


@pytest.mark.parametrize("changed", [
    {}, {"dt": 0.02}, {"damping": 3.0}, {"limits": False}, {"resolver": "tpm"},
    {"tasks": [HOME]}, {"robot": Robot.load("kuka_lwr")}])
def test_what_a_call_has_set_up_serves_the_same_objects_and_changes_no_answer(changed):
    goals = [tasks.Position(FRAME, circle((0.3, 0.5, 0.1), 0.1, rate=2.0)), HOME]
    memory, q = None, Q
    for t in (0.0, 0.01, 0.02, 0.03):
        asked = {"robot": ROBOT, "q": q, "tasks": goals, "t": t, **(changed if t > 0.02 else {})}
        kept = dict(vars(_of_thread).get("kept", {}))
        refused("q[3] (joint_4) is nan", solve_ik, memory=memory,
                **asked | {"q": np.where(Q == 1.2, np.nan, Q)})
        step = solve_ik(**asked, memory=memory)
        assert t == 0.0 or (kept == _of_thread.kept) is (t <= 0.02 or not changed)
        assert len(kept) <= 4
        with ThreadPoolExecutor() as another:
            anew = another.submit(solve_ik, **asked, memory=memory).result()
        np.testing.assert_array_equal(step.v, anew.v)
        memory, q = step.memory, ROBOT.integrate(q, step.v * 0.01)


def test_what_is_kept_serves_one_call_at_a_time_and_tasks_of_its_size():
    """A user's task asks within it, or takes other rows, while its set-up is kept."""
    there, again = resting([0.3, 0.5, 0.1]), []

    def error(state):
        if again and state.q[0] == Q[0]:
            again[0](Q + 0.1)
        return there.error(state)[:changing.dimension]

    changing = of_user("changing", 3, error, lambda state: there.jacobian(state)[
        :changing.dimension], gain=2.0)
    wanted = [changing, tasks.Posture(tuple(Q + 0.05))]
    ask = partial(solve_ik, ROBOT, tasks=wanted)
    plain = [ask(Q).v for _ in range(2)][-1]
    again.append(ask)
    np.testing.assert_array_equal(ask(Q).v, plain)
    again.clear()
    changing.dimension = 2
    np.testing.assert_allclose(changing.jacobian(AT) @ ask(Q).v, 2.0 * changing.error(AT))
    aims = (list(Q), np.asfortranarray(AT.rotation(FRAME)), np.array([1.0, 2.0, 3.0]),
            np.eye(3)[:1].copy(), np.array([0.3, 0.0, 0.0]))
    wanted[:] = (tasks.Along(resting([0.3, 0.5, 0.1], gain=aims[2]), aims[3]),
                 tasks.Posture(aims[0]), tasks.Momentum("linear", aims[4]),
                 tasks.Orientation(FRAME, aims[1]))
    for aim in aims:
        ask(Q)
        aim[:] = np.roll(aim, 1, axis=-1)
        np.testing.assert_array_equal(ask(Q).v, solve_ik(ROBOT, Q, deepcopy(wanted)).v)


def test_a_call_neither_names_the_pairs_of_links_nor_compares_them(monkeypatch):
    """A thousand pairs cost 1 ms in every call, ten times their rows."""
    apart = tasks.SelfSeparation.of(ROBOT, Barrier(0.02))
    assert isinstance(apart.pairs, tuple)  # which cannot change, as a list can
    solve_ik(ROBOT, Q, wanted := [apart])
    monkeypatch.delattr(tasks.SelfSeparation, "row_names")
    assert solve_ik(ROBOT, Q, wanted).status is Status.SOLVED


def test_a_call_writes_out_no_task_of_a_level_but_sees_another_one_there(monkeypatch):
    """To see whether the list had changed it wrote out all of them: four cost 0.9 ms."""
    level = [tasks.Position(FRAME, Still([0.3, 0.5, 0.1])), tasks.Posture(tuple(Q))]
    ask = partial(solve_ik, ROBOT, Q, [tasks.Together(level)])
    ask()
    monkeypatch.setattr(tasks.Position, "__repr__", None)  # cannot be called
    plain = ask().v
    level[0] = tasks.Position(FRAME, Still([0.3, 0.5, 0.2]))
    np.testing.assert_array_equal(ask().v, solve_ik(ROBOT, Q, [tasks.Together(tuple(level))]).v)
    assert np.abs(ask().v - plain).max() > 0.1


def test_limits_of_the_robot_hold_whatever_is_asked():
    far = tasks.Posture(tuple(ROBOT.upper + 1.0), gain=50.0)
    assert (np.abs(solve_ik(ROBOT, Q, [far]).v) <= ROBOT.velocity_limit + 1e-12).all()
    q, _ = follow([far], 300)
    assert (q <= ROBOT.upper + 1e-9).all()
    np.testing.assert_allclose(q, ROBOT.upper, atol=1e-9)
    assert (np.abs(solve_ik(ROBOT, Q, [far], limits=False).v) > ROBOT.velocity_limit).any()


# What is asked of an arm, above a posture: tasks, for so many ticks of a time [s] and other
# settings. Then v changes by less than `most` in a tick, and where the first task is as near as it
# can be, no configuration nearby is better by `better`.
ASKED = {
    "beside it": ([resting([0.9, 0.0, 0.35]), HOME], 500, 0.01, {}, 1e-3, 1e-6),
    "above": ([resting([0.0, 0.1, 5.0])], 500, 0.01, {"limits": False}, 1e-3, 1e-6),
    "in bounds": ([resting([1.5, 0.0, 0.3]), HOME], 500, 0.01, {"resolver": "tpm"}, 1e-3, 1e-6),
    # The bend shrank to rounding, in which the posture moved the arm by 0.7 rad/s, again and again.
    "in bounds, high": ([resting([0.0, 0.0, 3.0]), HIGH], 140, 0.04, {"resolver": "tpm"}, 0.05,
                        np.inf),
    # Joints reversed 1 rad/s in each tick, with status SOLVED: below levels that decide a part of
    # the residual, and about the axis of an arm that is almost straight.
    "turned": ([tasks.Orientation(FRAME, TURN, gain=5.0), resting([1.32, 1.26, 0.04], gain=5.0),
                resting([-0.06, -0.69, -0.03], ELBOW, gain=2.0, name="elbow")],
               1000, 0.01, {}, 1e-3, np.inf),
    "straight": ([resting([0.84, -0.66, 1.09], gain=2.0),
                  resting([-0.11, 0.53, 0.57], ELBOW, gain=5.0, name="elbow"),
                  tasks.Posture((0.96, 0.66, -1.7, -1.2, -1.5, 0.27, 0.3), gain=1.0)],
                 1000, 0.01, {}, 1e-3, np.inf),
    # Rows that vanish where they reach the most: all joints reversed their full speed.
    "height": ([tasks.Along(resting([0.3, 0.5, 2.0], gain=2.0), [(0.0, 0.0, 1.0)]), HIGH],
               600, 0.04, {}, 0.05, 1e-4),
    "direction": ([tasks.Along(resting([-0.3, 1.5, 2.0], ELBOW, gain=2.0), [(0.6, 0.8, 0.0)]),
                   HIGH], 600, 0.04, {}, 0.05, 1e-4),
    "inequality": ([tasks.Manipulability(FRAME, least=0.5), HIGH], 600, 0.04, {}, 0.05, 1e-4),
    # Half of the ticks at rest were INACCURATE: the residual depended on the limits that act.
    **{f"kept by limits {k}": ([resting(there, gain=10.0), HIGH], 400, 0.01, {}, 1e-3, np.inf)
       for k, there in enumerate(([0.08, 0.24, -0.18], [0.22, -0.14, 0.03]))},
    # What the hand leaves of joints that are held is singular where the arm beyond them is
    # stretched: every joint reversed its full speed in each tick, and the hand stayed away.
    **{f"held below, {k}": ([resting(there), tasks.Together([
        tasks.JointCoupling(ROBOT, {f"joint_{i}": 1.0}, Q[i - 1]) for i in (1, 2, 3)])],
        300, 0.01, {}, 1e-3, 1e-9) for k, there in enumerate(([0.3, 0.5, 0.1], [0.5, 0.3, 0.3]))}}


@pytest.mark.parametrize("case", ASKED)
def test_an_arm_asked_for_what_is_out_of_reach_comes_to_rest_as_near_as_it_can(case):
    wanted, ticks, dt, settings, most, better = ASKED[case]
    q, v = follow(wanted, ticks, dt, **settings)
    assert np.abs(np.diff(v[100 - ticks:][-100:], axis=0)).max() < most
    missed = np.linalg.norm(wanted[0].error(State.at(ROBOT, q)))
    for near in q + np.random.default_rng(0).normal(scale=0.03, size=(50, 7)):
        assert np.linalg.norm(wanted[0].error(State.at(ROBOT, near))) > missed - better


@pytest.mark.parametrize("bend", [1e-3, 1e-4])
def test_no_demand_moves_a_nearly_stretched_arm_faster_than_its_curvature_allows(bend):
    """Demands below 1 mm/s were met in full: at 6 rad/s for 0.1 mm/s."""
    q = np.array([0.0, 0.5, 0.0, bend, 0.0, bend, 0.0])
    at = State.at(ROBOT, q).position(FRAME)
    out, sigma, _ = np.linalg.svd(tasks.Position(FRAME, Still(at)).jacobian(State.at(ROBOT, q)))
    for demand in np.geomspace(1e-7, 0.1, 7):
        hand = resting(at + demand * out[:, 2], gain=1.0)
        v = solve_ik(ROBOT, q, [hand], limits=False).v
        assert np.linalg.norm(v) <= 1.01 * sigma[2] / (0.005 * np.linalg.norm(sigma))


class Near(tasks.Along):
    """A height that a user's task knows about Q only."""

    def jacobian(self, state):
        if np.abs(state.q - Q).max() > 0.1:
            raise ValueError("far away")
        return super().jacobian(state).tolist()


def test_a_row_that_is_known_at_q_only_is_resolved_there():
    height = resting([0.3, 0.5, 0.7], gain=2.0), [(0.0, 0.0, 1.0)]
    np.testing.assert_allclose(solve_ik(ROBOT, Q, [Near(*height)]).v,
                               solve_ik(ROBOT, Q, [tasks.Along(*height)]).v, atol=1e-9)


def test_the_answer_near_a_singularity_is_continuous():
    stretched = np.array([0.2, 0.7, 0.1, 0.0, 0.3, 0.0, 0.1])
    task = [resting(1.3 * State.at(ROBOT, stretched).position(FRAME))]
    bends = np.linspace(-0.02, 0.02, 81)
    v = np.array([solve_ik(ROBOT, stretched + bend * np.eye(7)[3], task).v for bend in bends])
    assert np.abs(np.diff(v, axis=0)).max() < 0.1


def test_limits_of_acceleration_continue_from_the_tick_before():
    limits, far = tasks.JointLimits(ROBOT, 10.0, 0.01), resting([0.3, 0.5, 0.1])
    q, v = Q, np.zeros(7)
    for _ in range(100):
        step = solve_ik(ROBOT, q, [far], limits=limits, v=v)
        assert np.abs(step.v - v).max() <= 0.1 + 1e-9
        q, v = q + step.v * 0.01, step.v
    assert np.linalg.norm(far.error(State.at(ROBOT, q))) < 1e-2


def test_joints_without_a_velocity_limit_are_named_once(tmp_path):
    robot = loaded(tmp_path, *map(link, "ab"), joint("turn", "continuous", "a", "b", ""))
    task = [resting([0, 0, 0], robot.frame("b"))]
    with pytest.warns(UserWarning, match="no velocity limit for turn.*; set robot.velo"):
        solve_ik(robot, robot.rest, task)
    solve_ik(robot, robot.rest, task)


def test_degrees_are_asked_about(tmp_path):
    task = [resting([0.3, 0.5, 0.1])]
    with pytest.warns(UserWarning, match="joint_1 at 51.56.* its limits, -2.967 to 2.967. Are"):
        solve_ik(ROBOT, np.degrees(Q), task)
    slide = two_joints(tmp_path, LIMIT, LIMIT, "prismatic")
    solve_ik(slide, [30.0, 0.0], [tasks.Posture((0.0, 0.0))])  # no angle: pytest raises warnings


def test_poses_of_random_configurations_are_found_within_the_limits():
    rng = np.random.default_rng(3)
    for _ in range(10):
        goal = State.at(ROBOT, rng.uniform(ROBOT.lower, ROBOT.upper))
        pose = tasks.Pose(FRAME, Still(goal.position(FRAME)), goal.rotation(FRAME))
        twice = [tasks.Position(FRAME, pose.path), pose]
        assert solve_ik(ROBOT, Q, twice, until=1e-6).met  # to 1e-17, which beats no other start
        found = solve_ik(ROBOT, Q, [pose], until=1e-6)
        assert (found.met, found.verdict) == (True, "reached")
        assert found.iterations > 0
        assert ((found.q >= ROBOT.lower - 1e-9) & (found.q <= ROBOT.upper + 1e-9)).all()
        here = State.at(ROBOT, found.q)
        np.testing.assert_allclose(here.position(FRAME), goal.position(FRAME), atol=1e-6)
        np.testing.assert_allclose(here.rotation(FRAME), goal.rotation(FRAME), atol=2e-6)


def test_a_configuration_is_within_the_limits_though_the_start_is_not():
    """A target that is met at a start beyond a limit was reached there, as encoders may read it."""
    beyond = np.where(np.arange(7) == 3, ROBOT.upper + 0.05, Q)
    there = resting(State.at(ROBOT, beyond).position(FRAME))
    found = solve_ik(ROBOT, beyond, [there], until=1e-6)
    assert found.met
    assert (found.q <= ROBOT.upper).all()
    np.testing.assert_array_equal(solve_ik(ROBOT, beyond, [there], until=1e-6, limits=False).q,
                                  beyond)


def test_a_configuration_does_not_depend_on_the_gains_of_its_tasks():
    goal = State.at(ROBOT, Q + 0.4)
    found = [solve_ik(ROBOT, Q, [
        resting(goal.position(FRAME), gain=hand),
        resting(goal.position(ELBOW), ELBOW, gain=other, name="elbow")], until=1e-6)
        for hand, other in ((10.0, 10.0), (10.0, 0.1), (0.1, 10.0), (1000.0, 1000.0))]
    assert all(one.met and one.iterations == found[0].iterations for one in found)
    np.testing.assert_allclose([one.q for one in found], [found[0].q] * 4, atol=1e-9)


@pytest.mark.parametrize("make_task", [
    lambda path: tasks.Position(FRAME, path), lambda path: tasks.FrameLog(FRAME, path, np.eye(3)),
    lambda path: tasks.Together([tasks.Position(FRAME, path), tasks.Orientation(FRAME, np.eye(3))]),
    lambda path: tasks.Along(tasks.Position(FRAME, path), ((0.6, 0.0, 0.8), (0.0, 1.0, 0.0)))])
def test_a_target_that_moves_is_reached_where_it_is_at_that_time(make_task):
    found = solve_ik(ROBOT, Q, [make_task(circle([0.3, 0.4, 0.3], 0.1))], until=1e-6, t=0.3)
    assert (found.verdict, found.starts) == ("reached", 1)


@pytest.mark.parametrize("until", [1e-4, 1e-6])
def test_two_hands_on_an_object_take_it_as_near_to_a_target_out_of_reach_as_they_can(until):
    """Each step bent the grip by its square, so the start, where it was exact, won: 0.55 m away."""
    robot = Robot.load("dual_arm")
    home, (right, left) = State.at(robot, robot.rest), map(robot.frame, ("right_hand", "left_hand"))
    R = home.rotation(right).T
    grip = tasks.RelativePose(left, right, R @ (home.position(left) - home.position(right)),
                        R @ home.rotation(left))
    goal = resting(home.position(right) + np.array([0.45, 0.3, 0.1]), right, name="object")
    found = solve_ik(robot, robot.rest, [grip, goal, tasks.Posture(tuple(robot.rest))], until=until)
    assert not found.met
    assert found.errors["relative"] <= until
    assert found.errors["object"] < 0.08


def test_joints_that_do_not_help_stay_though_a_target_is_out_of_reach():
    """The best of the random starts was the answer, by less than rounding."""
    far = tasks.RelativePose(FRAME, ROBOT.frame("joint_3"), (0.0, 0.0, 5.0))
    found = solve_ik(ROBOT, Q, [far], until=1e-6)
    assert not found.met
    np.testing.assert_allclose(found.q[:3], Q[:3], atol=1e-9)


BALL = np.array([0.4, 0.2, 0.4])
IN_BALL = of_user(
    "in ball", 1, lambda state: [np.sum((state.position(FRAME) - BALL)**2) - 0.01],
    lambda state: -2.0 * (state.position(FRAME) - BALL)[None] @ resting([0.0] * 3).jacobian(state),
    kind="inequality", gain=5.0)  # within 0.1 m of its centre


def test_beyond_a_curved_bound_the_nearest_point_on_it_is_found():
    """Whole steps overshot by the bound's curvature, and ended 22 mm beside it."""
    found = solve_ik(ROBOT, Q, [IN_BALL, resting([0.7, 0.2, 0.4])], until=1e-6)
    assert found.errors["position"] == pytest.approx(0.2, abs=1e-4)
    assert found.verdict.endswith("held back by in ball")


@pytest.mark.parametrize(("sides", "wanted", "holds"), [
    ((-1.0, 0.0), (1.0, 0.0), True), ((-1.0, 0.0), (-1.0, 0.0), False),
    ((0.0, 1.0), (-3.0, 0.0), True), ((0.0, 1.0), (3.0, 0.0), False),
    ((0.5, 0.5), (1.0, 0.0), True), ((-0.5, -0.5), (-1.0, 0.0), True),
    ((-1.0, 1.0), (1.0, 0.0), False), ((-2e-6, 2e-6), (-1.0, 0.0), False),
    ((-2e-6, 2e-6), (1.0, 0.0), False), ((-1e-7, 1e-7), (-1.0, 0.0), True),
    ((-1e-7, 1e-7), (1.0, 0.0), True), ((-1e-6, 1e-6), (-1.0, 0.0), False),
    ((-1e-6, 1e-6), (1.0, 0.0), False), ((0.0, 0.0), (1e-7, 1.0), False),
    ((0.0, 0.0), (1e-5, 1.0), True), ((0.0, 0.0), (0.0, 0.0), False)])
def test_a_level_above_holds_back_what_would_leave_a_side_without_room(sides, wanted, holds):
    level = ([[2.0, 0.0], [0.0, 0.0]], *np.array([sides, (0.0, 0.0)]).T)
    h = Hierarchy.from_levels([level, level, ([[1.0, 0.0]], [9.0])], names=["own", "box", "hand"])
    own = tasks.Posture(tuple(Q), name="own")
    assert _above(h, 2, np.array(wanted), [own]) == ["box"] * holds
    assert _above(h, 1, np.array(wanted), []) == ["own"] * holds


def test_what_holds_a_target_out_of_reach_back_is_said():
    found = solve_ik(ROBOT, Q, [resting([0.0, 0.0, 3.0])], until=1e-6)
    assert not found.met
    top = State.at(ROBOT, np.zeros(7)).position(FRAME)[2]
    assert found.errors["position"] == pytest.approx(3.0 - top, abs=1e-6)
    assert found.verdict.startswith("unreachable: nearest found, position is missed by")
    assert "no joint moves position along z" in found.verdict
    idle = resting([0.1, 0.5, 0.1], gain=0.0)  # it was as near as the robot comes
    assert solve_ik(ROBOT, Q, [idle], until=1e-3).verdict.endswith(
        ": its rows ask for no velocity, its gain is 0")
    here = State.at(ROBOT, Q).position(FRAME)
    wanted = [tasks.JointCoupling(ROBOT, {"joint_7": 1.0}, Q[6]),  # which holds nothing back
             resting(here), resting(here + 0.1, name="other")]
    assert "other is missed by 0.173, held back by position" in solve_ik(
        ROBOT, Q, wanted, until=1e-6).verdict
    found = solve_ik(ROBOT, Q, [wanted[2], HOME], resolver="augmented", limits=False, until=1e-6)
    assert found.verdict.endswith("augmented is not strict, and may trade it for other tasks")
    here[0] = np.nan  # it raised StopIteration
    refused("its error is not finite: [nan", solve_ik, ROBOT, Q, wanted[1:2], until=1e-6)


CONTACTS = feet()
STANDING = State.at(HUMANOID, HUMANOID.rest)


def physical(stack, fraction=1.0):
    """The hierarchy of a stack where the robot stands, and its certified answer.

    Newton and Euler hold, the feet rest, torques and forces are within their limits.
    """
    state, h = STANDING, stack.hierarchy(STANDING)
    res = make("hcod").solve(h)
    assert res.status is Status.SOLVED
    assert certify(h, res.x).certified, certify(h, res.x)
    assert h.violations(res.x)[:2].max() < 1e-7
    forces, torques = CONTACTS.forces(res.x), CONTACTS.torques(state, res.x)
    com = pin.centerOfMass(HUMANOID.model, HUMANOID.model.createData(), state.q)
    arms = np.concatenate([[state.position(c.frame) + state.rotation(c.frame) @ np.array(point)
                            for point in c.points] for c in CONTACTS.contacts]) - com
    A, dA = state.momentum
    rate = A @ CONTACTS.accelerations(res.x) + dA @ state.v
    np.testing.assert_allclose(rate[:3], forces.sum(axis=0) - [0.0, 0.0, WEIGHT], atol=1e-6)
    np.testing.assert_allclose(rate[3:], np.cross(arms, forces).sum(axis=0), atol=1e-6)
    assert (np.abs(torques) <= fraction * HUMANOID.effort_limit[6:] + 1e-7).all()
    assert (np.linalg.norm(forces[:, :2], axis=1) <= 0.7 * forces[:, 2] + 1e-7).all()
    return h, res


@pytest.mark.parametrize("faces", [4, 8])
@pytest.mark.parametrize("shift", [  # all but the first out of reach
    (0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 1.0), (-2.0, 1.0, -1.0)])
def test_hcod_is_certified_and_agrees_with_a_cascade_of_programs(shift, faces):
    h, res = physical(standing_stack(STANDING, CONTACTS, shift, faces=faces))
    others = [make("hqp", backend=backend).solve(h) for backend in filter(
        installed, ("clarabel", "piqp", "proxqp", "quadprog"))]
    solved = [other for other in others if other.status is Status.SOLVED]
    assert len(solved) + 1 >= len(others)  # one may be INACCURATE: that depends on the processor
    for other in solved:
        assert np.abs(other.x - res.x).max() <= 1e-8 * (1.0 + np.abs(res.x).max())


def test_torques_that_cannot_hold_the_weight_stay_within_limits_and_the_knees_are_named():
    """The body sinks: the stack says which torques hold the centre of mass back."""
    weak = 0.1
    stack = standing_stack(STANDING, CONTACTS, fraction=weak)
    h, res = physical(stack, weak)
    assert (STANDING.momentum.A @ CONTACTS.accelerations(res.x))[2] < -1.0
    said = explain(h, res, rows=stack.row_names()).splitlines()[2]
    assert said.startswith("centre of mass is missed by")
    assert "torque limits left_knee at its" in said


def test_an_arm_with_a_motor_before_a_gear_moves_as_one_without(tmp_path):
    """By the speed of the motor it was damped to a hundredth of its own."""
    arm = (*map(link, "abc"), joint("only", "revolute", "a", "b"),
           joint("end", "fixed", "b", "c", "", "", placed("0.5 0 0")))
    turns = LIMIT.replace("1", "1e3") + '<mimic joint="only" multiplier="100"/>'
    speeds = []
    for parts in ((), (link("m"), joint("motor", "revolute", "a", "m", turns))):
        robot = loaded(tmp_path, *arm, *parts, end_effector="c")
        task = resting([0.4, 0.0, -0.3], robot.frame("c"))
        step = solve_ik(robot, robot.rest, [task], limits=False)
        speeds.append(step.v[robot.velocity_names.index("only")])
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-3)
    assert tasks.model_rows(robot)[0].straight  # as scenarios ask, whose stack has these rows


def two_joints(folder, first, second, kind="revolute"):
    """An arm of two joints; what follows the axes of each in its file is given."""
    along = placed("0.5 0 0")
    return loaded(folder, *map(link, "abcd"), joint("first", kind, "a", "b", first),
                  joint("second", "revolute", "b", "c", second, origin=along),
                  joint("end", "fixed", "c", "d", "", "", along))


def test_a_search_does_not_end_where_joints_that_follow_others_do_not(tmp_path):
    """By less than `until`: it ended at once as unreachable, its mechanism open."""
    robot = two_joints(tmp_path, LIMIT, LIMIT + '<mimic joint="first"/>')
    tip = robot.frame("d")
    there = resting(State.at(robot, [0.3, 0.3]).position(tip), tip)
    found = solve_ik(robot, [0.3, 0.305], [there], until=1e-2)
    assert (found.met, found.verdict) == (True, "reached")
    assert found.q[0] == pytest.approx(found.q[1], abs=1e-9)


def test_a_configuration_is_found_though_the_joints_are_slow():
    """Of 0.05 rad/s: it was missed by 0.1 after 4400 steps; a joint that cannot move stays."""
    robot = Robot.load("kuka_lwr")
    robot.velocity_limit[:] = [0.05, 0.05, 0.0, 0.05, 0.05, 0.05, 0.05]
    goal = State.at(robot, Q + np.array([1.0, 0.6, 0.0, -1.5, 0.8, -0.9, 0.0])).position(FRAME)
    found = solve_ik(robot, Q, [resting(goal)], until=1e-6)
    assert (found.met, found.starts, found.q[2]) == (True, 1, Q[2])
    assert found.iterations < 50


@pytest.mark.parametrize(("lower", "upper"), [(5.0, np.inf), (-np.inf, -5.0)])
def test_a_slide_with_one_limit_starts_again_within_it(tmp_path, lower, upper):
    robot = two_joints(tmp_path, LIMIT, LIMIT, "prismatic")
    robot.lower[0], robot.upper[0] = lower, upper
    tip = robot.frame("d")
    height = tasks.Along(resting([0.0] * 3, tip), [(0.0, 0.0, 1.0)])
    assert solve_ik(robot, [9.0, 0.0], [height]).status is Status.SOLVED
    found = solve_ik(robot, robot.rest, [resting([0.0, 1.0, 0.0], tip)], until=1e-6)
    assert (found.met, found.starts) == (False, 20)
    assert lower - 1e-9 <= found.q[0] <= upper + 1e-9


@pytest.mark.parametrize("far", [0.5, 70.0, 5000.0])
def test_a_base_that_floats_goes_as_far_as_it_is_asked_to(far):
    """Steps of 0.2 m did not take it 70 m, which was said to be unreachable."""
    robot = Robot.named("quadruped")
    tip = robot.frame(robot.end_effector)
    there = State.at(robot, robot.rest).position(tip) + np.array([far, -far, 0.0])
    found = solve_ik(robot, robot.rest, [resting(there, tip)], until=1e-6)
    assert (found.verdict, found.starts) == ("reached", 1)
    np.testing.assert_allclose(State.at(robot, found.q).position(tip), there, atol=1e-6)


@pytest.mark.parametrize("far", [1e200, 1e308])
def test_a_target_beyond_all_numbers_is_unreachable(far):
    hand = resting([far, far, 0.0])
    assert solve_ik(ROBOT, Q, [hand, tasks.Posture(tuple(Q))]).status is Status.NUMERICAL_FAILURE
    with np.errstate(all="ignore"):
        found = solve_ik(ROBOT, Q, [hand, tasks.Posture(tuple(Q))], until=1e-6)
    assert (found.met, "no joint moves" in found.verdict) == (False, False)


@pytest.mark.parametrize(("multiplier", "offset", "most"), [(1.0, 0.5, 0.5), (-1.0, 0.0, 0.0)])
def test_what_is_unreachable_is_missed_within_limits_and_couplings(tmp_path, multiplier, offset,
                                                                   most):
    limit = LIMIT.replace("-1", "0")
    mimic = f'<mimic joint="first" multiplier="{multiplier}" offset="{offset}"/>'
    robot = two_joints(tmp_path, limit, limit + mimic)
    tip = robot.frame("d")
    beyond = State.at(robot, [0.8, 0.8 * multiplier + offset]).position(tip)
    found = solve_ik(robot, robot.rest, [resting(beyond, tip)], until=1e-6)
    assert not found.met
    np.testing.assert_allclose(found.q, [most, multiplier * most + offset], atol=1e-6)
