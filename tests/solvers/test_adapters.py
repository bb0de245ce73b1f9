"""Adapters against the packages that they are for."""

import inspect
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
import qpsolvers
from refusals import refused

from benchmark.studies.pink_examples import exact, least_squares
from hierarchy import Hierarchy, Robot, Stack, State
from solvers import make
from solvers.adapters import drop_in
from solvers.adapters.for_pink import solve_ik
from solvers.adapters.from_pink import PinkTask
from solvers.adapters.from_pink import hierarchy as pink_hierarchy
from solvers.qp.programs import level_problem

try:
    import pink
except ImportError:  # its tests are skipped
    pink = None

DT = 0.01
Q = np.array([0.1, 0.5, -0.2, -1.0, 0.3, 0.8, 0.0])
ARM = Path(__file__).parents[1] / "data" / "robots" / "four_joints.xml"
POSE = np.array([0.3, 0.4, 0.5, -0.2])


# --- pink ---------------------------------------------------------------------------------------
@pytest.fixture
def robot():
    pytest.importorskip("pink")
    return Robot.named("kuka_lwr")


@pytest.fixture
def configuration(robot):
    return configured(robot.model, Q)


def configured(model, q):
    return pink.Configuration(model, model.createData(), q)


def frame_task(configuration, frame="end_effector", shift=(0.05, 0.02, -0.03), turn=0.1, gain=0.5,
               position=1.0, orientation=0.5):
    task = pink.tasks.FrameTask(frame, position, orientation, gain=gain)
    here = configuration.get_transform_frame_to_world(frame)
    task.set_target(pin.SE3(here.rotation @ pin.exp3(np.array([turn, 0.0, 0.0])),
                            here.translation + np.array(shift)))
    return task


def posture_task(target, cost=0.1):
    task = pink.tasks.PostureTask(cost=cost)
    task.set_target(np.asarray(target))
    return task


def arm_scene(configuration, lm_damping=0.0, cost=1e-3, **arguments):
    hand = frame_task(configuration)
    hand.lm_damping = lm_damping
    return configuration, [hand, posture_task(Q + 0.3, cost)], arguments


def wall(configuration, room, gain, safe):
    class Backing(pink.barriers.PositionBarrier):
        def compute_safe_displacement(self, configuration):
            return np.linspace(-0.01, 0.01, 7)

    here = configuration.get_transform_frame_to_world("end_effector").translation
    return Backing("end_effector", indices=[0], p_max=here[:1] + room, gain=gain,
                   safe_displacement_gain=safe)


def ball(room=0.718):
    from pink.barriers import BodySphericalBarrier  # its Jacobian has one dimension

    return BodySphericalBarrier(("joint_2", "end_effector"), room, 20.0)


def still():
    """Return a barrier of a frame that no joint moves."""
    return SimpleNamespace(safe_displacement_gain=1.0, compute_qp_inequalities=lambda *_: None,
                           compute_qp_objective=lambda _: (np.full((7, 7), np.inf), np.zeros(7)))


def humanoid_scene(_):
    robot = Robot.named("humanoid")
    configuration = configured(robot.model, robot.rest)
    feet = [frame_task(configuration, foot, (0.0, 0.0, 0.0), 0.0, 1.0, 200.0, 1.0)
            for foot in ("left_foot", "right_foot")]
    com = pink.tasks.ComTask(cost=1.0, lm_damping=1.0)
    com.set_target(pin.centerOfMass(robot.model, robot.model.createData(), robot.rest)
                   + np.array([0.03, 0.0, -0.05]))
    return configuration, [*feet, com, posture_task(robot.rest, cost=1e-2)], {}


SCENES = {
    "limits act": lambda c: arm_scene(c, cost=0.1),
    "limits act, lm_damping": lambda c: arm_scene(c, lm_damping=1.0),
    "damping": lambda c: arm_scene(c, damping=1e-2),
    "no limits, little damping": lambda c: arm_scene(c, lm_damping=50.0, damping=1e-3, limits=[]),
    "barrier": lambda c: arm_scene(c, barriers=[wall(c, 1e-3, 1.0, 0.0)]),
    "barrier with a safe displacement": lambda c: arm_scene(c, barriers=[wall(c, 1e-3, 9.0, 0.7)]),
    "barrier between two frames": lambda c: arm_scene(c, barriers=[ball()]),
    "a barrier alone": lambda c: (c, [], {"barriers": [wall(c, 1.0, 9.0, 0.05)]}),
    "one row": lambda c: (c, [posture_task(Q + 0.1)], {}),
    "humanoid": humanoid_scene}


@pytest.mark.usefixtures("robot")
@pytest.mark.parametrize(("lm_damping", "turned"), [(0.0, 0.0), (1e-6, 0.5)])
def test_light_damping_leaves_every_answer_verified(lm_damping, turned):
    """Beside the rows of the tasks, rounding hid those of the damping: one answer in five."""
    robot, frames = Robot.named("humanoid"), ("left_hand", "right_hand", "left_foot")
    for seed in range(20):
        rng = np.random.default_rng(seed)
        q = pin.integrate(robot.model, robot.rest, 0.2 * rng.normal(size=robot.model.nv))
        low, high = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
        q[7:] = np.clip(q[7:], low[7:], high[7:])
        there = configured(robot.model, q)
        tasks = [frame_task(there, frame, 0.1 * rng.normal(size=3), gain=1.0, orientation=turned)
                 for frame in frames]
        for task in tasks:
            task.lm_damping = lm_damping
        for levels in (tasks, [tasks]):
            assert solve_ik(there, levels, DT).any()


@pytest.mark.parametrize("seed", [1, 5, 13])
def test_a_damped_task_out_of_reach_above_others_never_leaves_a_tick_without_an_answer(robot, seed):
    """Its nearly singular rows were to keep their values beside limits that act: it stopped."""
    rng, low, high = np.random.default_rng(seed), robot.lower, robot.upper
    there = configured(robot.model, np.clip(robot.rest + 0.1 * rng.normal(size=7), low, high))
    hand = frame_task(there, shift=0.3 * rng.normal(size=3), turn=0.0, orientation=1.0)
    hand.lm_damping = 1e-6
    posture = posture_task(robot.rest, 1e-3)
    for _ in range(150):
        v = solve_ik(there, [hand, posture], DT)
        first = solve_ik(there, [hand], DT)
        J = hand.compute_jacobian(there)
        np.testing.assert_allclose(J @ v, J @ first, atol=1e-7)
        there.update(np.clip(there.q + DT * v, low, high))


@pytest.mark.parametrize("scene", SCENES)
def test_one_level_is_the_exact_minimum_of_pinks_cost_under_its_limits(configuration, scene):
    configuration, tasks, arguments = SCENES[scene](configuration)
    ours = solve_ik(configuration, [tasks], DT, **arguments)
    problem = pink.build_ik(configuration, tasks, DT, **arguments)
    damping, n = arguments.get("damping", 1e-12), len(ours)
    A, b = least_squares(tasks, arguments.get("barriers", ()), configuration, damping)
    np.testing.assert_allclose(A.T @ A, problem.P, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(-A.T @ b, problem.q, rtol=1e-9, atol=1e-9)
    none = np.empty((0, n)), np.empty(0)
    G, h = none if problem.G is None else (problem.G, problem.h)
    np.testing.assert_allclose(ours, exact(A, b, G, h, *none, DT * ours) / DT, atol=1e-7)
    if "limits act" in scene:
        assert (np.abs(np.abs(ours) - configuration.model.velocityLimit) < 1e-9).any()


def limit(*rows):
    """Rows of a limit on seven joints: joint, coefficient, bound of the step [rad]."""
    G = np.zeros((len(rows), 7))
    for i, (joint, coefficient, _) in enumerate(rows):
        G[i, joint] = coefficient
    return SimpleNamespace(compute_qp_inequalities=lambda *_: (G, np.array([r[2] for r in rows])))


def test_limits_that_contradict_each_other_are_no_solution_and_named(configuration):
    slow, hand = pink.limits.VelocityLimit(configuration.model, np.full(7, 0.01)), [
        frame_task(configuration)]
    sums = SimpleNamespace(compute_qp_inequalities=lambda *_: (-np.ones((1, 7)), [-0.01]))
    for tasks, settings, said in (
            (hand, {"limits": [slow, limit((0, 1.0, 3.0), (2, -1.0, -1.0))]}, r"joint joint_3 must "
             r"move by at least 100 \(SimpleNamespace\) and at most 0.01 rad/s or m/s \(Velocity"),
            (hand, {"limits": [slow, sums]}, "limits cannot all hold; at best these are violated: "
             "SimpleNamespace, row 0 by .*joint_1 by"),
            ([posture_task(Q + 0.1)], {"solver": "weighted", "constraints": hand}, "constraints do "
             "not hold with weighted.*, which is not strict; these are violated: .* by")):
        with pytest.raises(pink.exceptions.NoSolutionFound, match=said):
            solve_ik(configuration, tasks, DT, **settings)


def test_rounding_in_a_limit_or_a_level_changes_nothing(configuration):
    """The one froze the torso below a barrier for a frame on its axis; with the other, of two
    frames that no joint moves apart, no answer was verified."""
    fixed = pink.tasks.RelativeFrameTask("end_effector", "joint_7", 1.0, 1.0)
    fixed.set_target(pin.SE3.Random())
    assert 0.0 < np.abs(fixed.compute_jacobian(configuration)).max() < 1e-12
    hand, bound = [frame_task(configuration)], limit((0, 70.0, 0.6))
    faint = limit((2, 1e-15, 0.0), (2, -1e-15, 0.0))
    free = solve_ik(configuration, hand, DT, limits=[bound])
    for tasks, limits in (hand, [faint, bound]), ([fixed, *hand], [bound]):
        np.testing.assert_allclose(solve_ik(configuration, tasks, DT, limits=limits), free,
                                   atol=1e-9)
    assert abs(free[2]) > 1e-3


def test_pinks_arguments_are_taken_in_pinks_order(configuration):
    ours, theirs = ([(one.name, one.name == "solver" or one.default)
                     for one in inspect.signature(solve).parameters.values()
                     if one.kind is one.POSITIONAL_OR_KEYWORD]
                    for solve in (solve_ik, pink.solve_ik))
    assert ours[:len(theirs)] == theirs
    hand = [frame_task(configuration, turn=0.0)]
    given = solve_ik(configuration, hand, DT, "hcod", 1e-12, [], None, None, True)
    np.testing.assert_array_equal(given, solve_ik(configuration, hand, DT, limits=[]))


def test_an_answer_that_holds_is_found_without_a_hierarchy(configuration, monkeypatch):
    hand = [frame_task(configuration)]
    expected = solve_ik(configuration, hand, DT, make("tpm"))
    monkeypatch.setattr(drop_in, "_solved", lambda *_: pytest.fail("a hierarchy is made"))
    np.testing.assert_allclose(solve_ik(configuration, hand, DT, "hcod"), expected, atol=1e-9)


def test_a_solver_of_qpsolvers_is_answered_by_hcod_with_a_note(configuration):
    drop_in._noted.clear()
    hand = [frame_task(configuration)]
    expected = solve_ik(configuration, hand, DT)
    with pytest.warns(UserWarning, match="solver 'proxqp' minimises one cost; the tasks are "
                                         "resolved in strict order by 'hcod'") as said:
        np.testing.assert_array_equal(solve_ik(configuration, hand, DT, "proxqp"), expected)
    assert said[0].filename == __file__
    solve_ik(configuration, hand, DT, "proxqp")  # said once; a second warning would be an error
    with pytest.warns(UserWarning, match="without effect: eps_abs, max_iter"):
        solve_ik(configuration, hand, DT, solver="mosek", max_iter=3, eps_abs=1e-3)
    np.testing.assert_allclose(solve_ik(configuration, hand, DT, solver="hcod", tolerance=1e-9),
                               expected)


def renamed(robot):
    model = robot.model.copy()
    model.names[1] = "other"
    return configured(model, Q)


def rows_at(robot, configuration, level):
    task = PinkTask(posture_task(Q), configuration, DT)
    return Stack([task], level).hierarchy(State.at(robot, Q))


def short_task():
    """Return a task with fewer rows than values, as LowAccelerationTask of a floating base."""
    return SimpleNamespace(compute_jacobian=lambda _: np.eye(7)[1:], cost=1.0, gain=1.0,
                           compute_error=lambda _: np.zeros(7))


@pytest.mark.parametrize(("call", "said"), [
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, solver="proxpq"), "unknown resolver 'proxpq'"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, solver="hcod", guess=1),
     "unknown setting of hcod 'guess'"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, 3), "solver: expected a Resolver, got int 3"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, damping=-1), "damping = -1: expected a"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, tolerance=np.nan), "tolerance = nan"),
    (lambda c, r: solve_ik(c, [posture_task(np.full(7, np.nan))], DT), "PostureTask"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], 0.0), "period [s] = 0: expected"),
    (lambda c, r: solve_ik(c, [posture_task(Q)], DT, limits=[limit((0, np.nan, 1.0))]),
     "SimpleNamespace, row 0"),
    (lambda c, r: solve_ik(c, [], DT, barriers=[still()]), "SimpleNamespace: "
     "safe_displacement_gain / |J|^2 = inf: expected a finite number"),
    (lambda c, r: pink_hierarchy(c, arm_scene(c, lm_damping=1.0)[1], DT),
     "FrameTask of end_effector: lm_damping = 1"),
    (lambda c, r: pink_hierarchy(c, [posture_task(Q)], DT, barriers=[wall(c, 1.0, 1.0, 2.0)]),
     "Backing: safe_displacement_gain = 2"),
    (lambda c, r: pink_hierarchy(c, [[frame_task(c)], [posture_task(Q)]], DT, damping=1.0),
     "FrameTask of end_effector: damped, and not the last level"),
    (lambda c, r: PinkTask(short_task(), c, DT), "SimpleNamespace: (6, 7) rows for (7,) values"),
    (lambda c, r: solve_ik(c, [short_task()], DT), "SimpleNamespace: (6, 7) rows for (7,) values"),
    (lambda c, r: rows_at(r, c, "acceleration"), "pink does not support accelerations"),
    (lambda c, r: rows_at(r, renamed(r), "velocity"), "has the joints other")])
def test_what_cannot_be_resolved_is_named(robot, configuration, call, said):
    refused(said, call, configuration, robot)


def test_tasks_of_pink_serve_in_a_stack_and_their_configuration_follows(robot, configuration):
    hand, posture = frame_task(configuration), posture_task(Q + 0.3)
    stack = Stack([PinkTask(hand, configuration, DT), PinkTask(posture, configuration, DT, "rest")],
                  "velocity")
    h = stack.hierarchy(State.at(robot, Q + 0.1))
    np.testing.assert_array_equal(configuration.q, Q + 0.1)
    assert h.names == ("FrameTask of end_effector", "rest")
    rest, state = stack["rest"], State.at(robot, Q + 0.1)
    np.testing.assert_allclose(rest.jacobian(state), h.A[6:])
    np.testing.assert_allclose(rest.gain * rest.error(state), h.lower[6:])
    expected = pink_hierarchy(configuration, [hand, posture], DT, limits=[])
    np.testing.assert_allclose(h.A, expected.A)
    np.testing.assert_allclose(h.lower, expected.lower)
    np.testing.assert_allclose(make("tpm").solve(h).x, solve_ik(configuration, [hand, posture], DT,
                                                                limits=[]), atol=1e-9)


# --- MuJoCo and mink ----------------------------------------------------------------------------
@pytest.fixture
def arm():
    """MuJoCo, the adapter, and a model with its data at the pose."""
    mujoco = pytest.importorskip("mujoco")
    from solvers.adapters import from_mujoco as adapter

    model = mujoco.MjModel.from_xml_path(str(ARM))
    data = mujoco.MjData(model)
    data.qpos[:] = POSE
    mujoco.mj_forward(model, data)
    return mujoco, adapter, model, data


@pytest.mark.parametrize(("name", "kind"), [("tip", "site"), ("lower", "body"), ("pad", "geom")])
def test_a_jacobian_of_mujoco_is_the_difference_of_its_frames(arm, name, kind):
    mujoco, adapter, model, data = arm
    J, step = adapter.jacobian(model, data, name, kind), 1e-6
    before = adapter.frame(model, data, name, kind)
    for joint in range(model.nv):
        data.qpos[:] = POSE + step * np.eye(4)[joint]
        mujoco.mj_forward(model, data)
        after = adapter.frame(model, data, name, kind)
        turned = (after[1] @ before[1].T - np.eye(3)) / step
        np.testing.assert_allclose((after[0] - before[0]) / step, J[:3, joint], atol=1e-5)
        np.testing.assert_allclose([turned[2, 1], turned[0, 2], turned[1, 0]], J[3:, joint],
                                   atol=1e-5)


def test_levels_out_of_mujoco_move_the_tip_within_the_ranges(arm):
    mujoco, adapter, model, data = arm
    start, turn = adapter.frame(model, data, "tip", "site")
    goal, wanted = start + np.array([0.03, -0.05, 0.02]), turn
    _, lower, upper = adapter.limit_level(model, data, 0.5, 4.8)
    rates = (model.jnt_range.T - POSE) / 0.5
    np.testing.assert_allclose([lower, upper], np.clip(rates, -4.8, 4.8))
    assert {*np.abs(np.r_[lower, upper])} > {4.8}  # some by their velocity
    for _ in range(60):
        levels = [adapter.limit_level(model, data, 0.01, 3.0),
                  adapter.position_level(model, data, "tip", goal, 20.0, "site"),
                  adapter.orientation_level(model, data, "tip", wanted, 5.0, "site"),
                  adapter.posture_level(model, data, POSE, 1.0)]
        x = make("hcod").solve(Hierarchy.from_levels(levels)).x
        mujoco.mj_integratePos(model, data.qpos, x, 0.01)
        mujoco.mj_forward(model, data)
    assert np.abs(adapter.frame(model, data, "tip", "site")[0] - goal).max() < 1e-6
    assert (np.abs(data.qpos) <= 2.0).all()


@pytest.mark.parametrize(("level", "settings", "said"), [
    ("position", {"target": "abc"}, "target [m]: expected 3 finite numbers, got str 'abc'"),
    ("position", {"target": [0, 0, 1], "velocity": (0, 0)}, "velocity [m/s]: expected 3 finite"),
    ("orientation", {"target": 2.0 * np.eye(3)}, "target: expected a rotation matrix (3, 3), but"),
    ("posture", {"target": np.zeros(4), "gain": np.nan}, "gain [1/s] = nan: expected a finite"),
    ("limit", {"period": 0.01, "velocity": [1.0, 2.0]}, "expected a number > 0, or 4 of them"),
    ("limit", {"period": None}, "limits: period [s] = None: expected a finite number"),
    ("position", {"name": None, "target": [0, 0, 1]}, "unknown body None")])
def test_a_wrong_argument_of_a_level_out_of_mujoco_is_named(arm, level, settings, said):
    _, adapter, model, data = arm
    own = {"position": {"name": "lower", "gain": 1.0}, "posture": {"gain": 1.0}, "limit": {},
           "orientation": {"name": "lower", "gain": 1.0}}[level]
    refused(said, getattr(adapter, f"{level}_level"), model, data, **own | settings)


# --- qpsolvers ----------------------------------------------------------------------------------
def made_hierarchy(seed):
    """Seven joints in their box, then equalities, inequalities that contradict each other, more."""
    rng = np.random.default_rng(seed)
    wanted, row = 4.0 * rng.normal(size=3), rng.normal(size=(1, 7))
    return Hierarchy.from_levels([
        (np.eye(7), np.full(7, -2.0), np.full(7, 2.0)), (rng.normal(size=(3, 7)), 0.4 * wanted),
        (np.vstack([row, row]), [-np.inf, 1.0], [-1.0, np.inf]),
        (rng.normal(size=(2, 7)), [-np.inf, 0.1], [0.2, np.inf]),
        (rng.normal(size=(3, 7)), wanted)], reference=rng.normal(size=7))


@pytest.mark.parametrize("seed", range(8))
def test_level_after_level_as_quadratic_programs_is_what_hcod_finds(seed):
    pytest.importorskip("clarabel")
    h, x = made_hierarchy(seed), None
    for level in range(len(h.sizes) + 1):
        solution = qpsolvers.solve_problem(level_problem(h, level, x, sparse=True),
                                           "clarabel", tol_gap_abs=1e-11, tol_gap_rel=1e-11,
                                           tol_feas=1e-11)
        assert solution.found
        x = solution.x[:h.n]
    np.testing.assert_allclose(x, make("hcod").solve(h).x, atol=1e-6)


def test_a_problem_needs_a_level_that_is_there_and_what_the_levels_above_reach():
    h = made_hierarchy(0)
    for asked, said in (([9], "level 9: the hierarchy has levels 0 to 4"),
                        ([None], "level_problem: level = None: expected a whole number"),
                        ([2, "x"], "above is not an array of numbers: str 'x'"),
                        ([2], "level 2: above must be the x (7,) of the levels"),
                        ([2, np.full(7, np.nan)], "level 2: above must be")):
        refused(said, level_problem, h, *asked)
    h.A[0, 0] = np.nan
    refused("rows are not finite", level_problem, h, 2, np.zeros(7))
