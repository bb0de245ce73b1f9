"""Joints of every kind, those that follow others, closed chains; shipped robots."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar
from refusals import refused
from scene import compiled_rows
from urdf_text import LIMIT, joint, link, loaded, placed, urdf

from hierarchy import Robot, Stack, State
from hierarchy.errors import RobotError, UnknownNameError
from hierarchy.robots.found import Loop
from hierarchy.robots.from_table import from_table
from hierarchy.robots.table import Link, TreeFrame, TreeJoint, TreeTable
from hierarchy.tasks import JointCoupling, JointLimits, Mechanism, Posture, Together, model_rows
from solvers import make, solve_ik

T = 0.01  # [s]
KINDS = {"drive": pin.JointModelPlanar, "wheel": pin.JointModelRUBZ,
         "neck": pin.JointModelSpherical, "arm": pin.JointModelRY, "lift": pin.JointModelPZ}
OF = {"drive": (0, 1, 2), "wheel": 3, "neck": (4, 5, 6), "arm": 7, "lift": 8}  # velocities
THERE = {"drive": (0.5, -0.3, 2.5), "wheel": -3.0, "neck": (0.3, -0.2, 0.9), "arm": 0.7,
         "lift": 0.2}


def mobile(floating=False):
    """A robot with a joint of each kind, one on the other."""
    model, rng = pin.Model(), np.random.default_rng(3)
    free = {"root": pin.JointModelFreeFlyer} if floating else {}
    for parent, (name, kind) in enumerate((free | KINDS).items()):
        place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
        joint = model.addJoint(parent, kind(), place, name)
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    model.addFrame(pin.Frame("tip", joint, 0, pin.SE3(np.eye(3), np.ones(3)),
                             pin.FrameType.OP_FRAME))
    return Robot(model, "mobile")


ROBOT = mobile()
ANYWHERE = {"drive": (1.0, 2.0, 0.4), "wheel": 2.0, "neck": (0.1, 0.2, -0.3), "arm": -0.4}


def test_values_of_joints_are_set_and_read_by_name():
    q = ROBOT.configuration(ANYWHERE)
    found = ROBOT.values(q)
    for name, value in {**ANYWHERE, "lift": 0.0}.items():
        np.testing.assert_allclose(found[name], value, atol=1e-12)
    np.testing.assert_allclose(q[:6], [1.0, 2.0, np.cos(0.4), np.sin(0.4), np.cos(2), np.sin(2)])
    turn = pin.Quaternion(q[6:10].copy()).toRotationMatrix()  # x, y, z, w
    np.testing.assert_allclose(turn, pin.exp3(np.array(ANYWHERE["neck"])), atol=1e-12)
    np.testing.assert_array_equal(ROBOT.configuration(q), q)
    np.testing.assert_allclose(ROBOT.configuration(ROBOT.vector(q)), q, atol=1e-15)


def test_no_joint_is_limited_where_the_model_limits_none():
    """pinocchio limits cosines to 1.01: a run said "joint limits, in 1: kept" of a free wrist."""
    assert np.isinf([ROBOT.lower, ROBOT.upper]).all()


@pytest.mark.parametrize(("values", "said"), [
    ({"neck": (0, 0, 0, 2)}, "joint 'neck': its quaternion (x, y, z, w)"),
    ({"wheel": (1.0, 1.0)}, "joint 'wheel': its (cos, sin) [1.0, 1.0] has length 1.414"),
    ({"neck": 1.0}, "joint 'neck': 1 numbers, expected 3 or 4"),
    ({"arm": np.nan}, "joint 'arm'"), ({"leg": 1.0}, "unknown joint 'leg'"),
    ((0.0, 0.0), "2 values for 9 joint positions or 12 coordinates")])
def test_what_is_no_value_of_a_joint_is_refused_by_name(values, said):
    refused(said, ROBOT.configuration, values)


@pytest.mark.parametrize(("robot", "what", "helps"), [
    (ROBOT, "q", True), (ROBOT, "v", False), (Robot.named("kuka_lwr"), "q", False)])
def test_values_of_joints_are_offered_where_they_make_more_coordinates(robot, what, helps):
    said = refused(f"{what} has shape (1,), expected", State.at, robot,
                   **({"q": robot.rest} | {what: [0.0]}), error=RobotError)
    assert ("robot.configuration makes one" in said) == helps


@pytest.mark.parametrize(("span", "name"), [(slice(2, 4), "drive"), (slice(4, 6), "wheel"),
                                            (slice(6, 10), "neck")])
def test_a_configuration_of_another_length_is_refused_by_the_name_of_its_joint(span, name):
    q = ROBOT.configuration(ANYWHERE)
    state = State.at(ROBOT, q)
    tip = state.position("tip")
    nearly, bad = q.copy(), q.copy()
    nearly[span] *= 1.0 + 5e-4  # as a sensor reads it
    assert state.move(0.0, nearly, state.v)
    np.testing.assert_allclose(state.position("tip"), tip, atol=1e-12)
    bad[span] *= 2.0
    assert not state.move(0.0, bad, state.v)
    np.testing.assert_allclose(state.q, q, atol=1e-15)
    for wrong in (nearly, bad):
        for refuse in (lambda q: State.at(ROBOT, q), lambda q: ROBOT.integrate(q, np.zeros(9)),
                       ROBOT.values, lambda q: solve_ik(ROBOT, q, [Posture(ANYWHERE)])):
            with pytest.raises(RobotError, match=f"joint '{name}': its .* not 1"):
                refuse(wrong)


@pytest.mark.parametrize("name", KINDS)
def test_the_rows_of_a_posture_are_the_derivative_of_its_error(name):
    """Everywhere for a joint of one axis, for others along the way to the target."""
    h, task = 1e-6, Posture(THERE, robot=ROBOT)
    state = State.at(ROBOT, ROBOT.configuration(ANYWHERE))
    along = np.where(np.isin(np.arange(9), OF[name]), task.error(state), 0.0)
    ahead, behind = (task.error(State.at(ROBOT, ROBOT.integrate(state.q, s * h * along)))
                     for s in (1, -1))
    np.testing.assert_allclose((behind - ahead) / (2 * h), task.jacobian(state) @ along, atol=1e-8)


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("floating", [False, True])
def test_compiled_rows_of_a_posture_are_those_of_its_methods(level, floating):
    robot = mobile(floating)
    state, there = State(robot), robot.configuration(THERE)
    named, same = (Posture(q, 3.0, 2.0, 4.0, robot=robot) for q in (THERE, there))
    for values in (ANYWHERE, THERE, {}):
        state.move(0.0, robot.configuration(values), np.arange(robot.n) - 2.0)
        rows = [compiled_rows(task, state, level) for task in (named, same, Together([same]))]
        np.testing.assert_array_equal(rows[0][1], rows[0][2])
        for other in rows[1:]:
            for one, of_names in zip(other, rows[0], strict=True):
                np.testing.assert_array_equal(one, of_names)


@pytest.mark.parametrize(("turn", "values"), [
    ("wheel", {"wheel": -3.0, "arm": 0.2}), ("drive 3", {"drive": (1.0, 2.0, -3.0), "arm": 0.2})])
def test_joints_that_turn_on_are_coupled_by_their_angles(turn, values):
    task, h = JointCoupling(ROBOT, {turn: 1.0, "arm": -1.0}, 3.0), 1e-6
    state = State.at(ROBOT, ROBOT.configuration(values))
    np.testing.assert_allclose(task.error(state), 3.2 - (-3.0) - 2 * np.pi, atol=1e-12)
    ahead, behind = ([task.error(State.at(ROBOT, ROBOT.integrate(state.q, s * h * e)))[0]
                      for e in np.eye(9)] for s in (1, -1))
    np.testing.assert_allclose(np.subtract(behind, ahead) / (2 * h), task.jacobian(state)[0],
                               atol=1e-8)
    refused("'neck' has 3 velocities and cannot be coupled", JointCoupling, ROBOT, {"neck": 1.0})
    refused("cannot be coupled, but for its turn 'drive 3'", JointCoupling, ROBOT, {"drive": 1.0})


@pytest.mark.parametrize("factor", [3.0, -0.02, 1.5, 2.0 / 3.0, 0.6667, -0.3])
def test_coupled_joints_turn_on_without_a_jump(factor):
    """At 1.5 the error was to the nearest whole turn, and the joints jumped by half a turn."""
    task = JointCoupling(ROBOT, {"wheel": 1.0, "drive 3": -factor})
    for angle in np.linspace(0.0, 20.0, 101):
        q = ROBOT.configuration({"wheel": factor * angle, "drive": (0.0, 0.0, angle)})
        assert task.error(State.at(ROBOT, q)) == pytest.approx(0.0, abs=2e-3)


def test_a_mimic_joint_of_pinocchio_is_refused_by_its_kind():
    """It has no velocity of its own, and its columns were missing in every Jacobian."""
    text = urdf(*(link(f"l{i}") for i in range(3)), joint("a", "revolute", "l0", "l1"),
                joint("b", "revolute", "l1", "l2", LIMIT + '<mimic joint="a"/>'))
    try:
        model = pin.buildModelFromXML(text, mimic=True)
    except TypeError:
        pytest.skip("older pinocchio has no such joint")
    refused("0 velocities of the kind Mimic is not known", Robot, model, "it", error=RobotError)


def test_a_joint_within_which_axes_turn_is_refused():
    """Its accelerations were wrong: pinocchio differentiates axes as if the body carried them."""
    composite, model = pin.JointModelComposite(), pin.Model()
    composite.addJoint(pin.JointModelRX())
    composite.addJoint(pin.JointModelRY())
    model.addJoint(0, composite, pin.SE3.Identity(), "both")
    refused("kind Composite axes turn each other", Robot, model, "it", error=RobotError)


def test_a_robot_of_the_same_names_and_other_coordinates_is_another():
    plain, around = pin.Model(), pin.Model()
    plain.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "a")
    around.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "a")
    task = JointCoupling(Robot(around, "around"), {"a": 1.0})  # it would read q[1] of one number
    refused("of robot 'around', not of 'plain'", task.error, State(Robot(plain, "plain")),
            error=RobotError)


def test_a_continuous_joint_is_locked_at_an_angle_and_holds_what_follows_it(tmp_path):
    path = tmp_path / "c.urdf"  # where a link has the name of a joint, as in NAO's
    mimic = '<mimic joint="a" multiplier="-2" offset="0.5"/>'
    path.write_text(urdf(
        *(link(name, "") for name in ("l0", "a", "l2", "l3")),
        joint("a", "continuous", "l0", "a", "", "0 0 1"),
        joint("b", "revolute", "a", "l2", LIMIT, "0 0 1", placed(".3 0 0")),
        joint("c", "continuous", "a", "l3", mimic, "0 0 1")))
    free, locked = Robot.load(path), Robot.load(path, locked={"a": 1.2})
    assert locked.joint_names == ("b", "c")
    assert free.coordinate_names == ["a 1", "a 2", "b", "c 1", "c 2"], "cosine and sine"
    assert free.coordinate_names is free.coordinate_names, "they are made once"
    q, there = locked.configuration({"b": 0.3}), free.configuration({"a": 1.2, "b": 0.3})
    np.testing.assert_allclose(State.at(locked, q).position("l2"),
                               State.at(free, there).position("l2"), atol=1e-12)
    (held,) = locked.coupled
    assert (held.joint, held.other, held.coefficients) == ("c", "", (0.5 - 2.4,))
    assert locked.vector(locked.rest)[1] == pytest.approx(0.5 - 2.4), "it is held at rest"
    assert Robot.load(path, locked={"c": 0.1}).coupled == ()
    assert free.values(free.configuration({"a": 0.2}))["c"] == pytest.approx(0.1)
    assert free.values(free.configuration({"a": 0.2, "c": 0.3}))["c"] == pytest.approx(0.3)
    assert free.values(free.configuration({"b": 0.2}))["c"] == pytest.approx(0.5)
    refused("locked: joint 'a'", Robot.load, path, locked={"a": (1.0, 1.0)}, error=RobotError)
    refused("unknown joint 'd'", free.configuration, {"d": 0.0}, error=UnknownNameError)


def test_joint_limits_cover_a_floating_base_where_it_has_limits():
    robot = Robot.load("humanoid")
    joints = JointLimits(robot, 5.0, T)
    both = JointLimits(robot, np.full(30, 5.0), T, base_speed=(0.1, 0.2))
    assert (joints.dimension, both.dimension) == (30, 36)
    state = State.at(robot, robot.rest, np.append([0.09, 0, 0, 0, 0, -0.19], np.zeros(30)))
    low, up = both.box(state, "acceleration")
    np.testing.assert_allclose([up[0], low[0], low[5]], [1.0, -5.0, -1.0])
    np.testing.assert_array_equal(low[6:], joints.box(state, "acceleration")[0])
    sent = both.clamp(state, "acceleration", np.append([9.0, np.nan], np.zeros(34)))
    np.testing.assert_allclose(sent[:2], [1.0, 0.0])
    sent = joints.clamp(state, "acceleration", np.append([np.nan, 1e6], np.full(34, 1e6)))
    np.testing.assert_allclose(sent[[0, 1, 20]], [0.0, 1e6, 5.0])
    refused("has a fixed base", JointLimits, ROBOT, 5.0, T, base_acceleration=(1.0, 1.0))


@pytest.mark.parametrize("part", [
    {"links": (("x", Link(mass=1.0)),)}, {"control_points": (("x", (0, 0, 0)),)},
    {"frames": (TreeFrame("f", "x", (0, 0, 0)),)}])
def test_a_joint_that_a_table_lacks_is_named(part):
    """It was one beyond the last: a mass on it was written past the end of the model."""
    one = TreeJoint("a", "", (0, 0, 0), "z", (-1, 1), 1.0, 1.0)
    table = TreeTable(**{"name": "t", "joints": (one,), "frames": (), "end_effector": "a"} | part)
    refused("unknown joint of table 't' 'x'", from_table, table, error=UnknownNameError)


def test_joints_that_do_not_come_branch_after_branch_are_refused_by_name():
    """The entry of the left joint and the hand was zero in the inertia matrix."""
    chain = [("left", ""), ("right", ""), ("hand", "left")]
    joints = tuple(TreeJoint(name, parent, (0.3, 0, 0), "z", (-90, 90), 1.0, 1.0,
                             Link((0.3, 0, 0), 0.02, 1.0)) for name, parent in chain)
    found = from_table(TreeTable("t", joints, (), "hand"))
    refused("robot 't': joint 'hand' hangs on 'left', and other branches are between them",
            Robot, found.model, "t", found=found, error=RobotError)
    found = from_table(TreeTable("t", joints[::2] + joints[1:2], (), "hand"))
    state = State.at(Robot(found.model, "t", found=found), (0.1, 0.2, 0.3), (1.0, 2.0, 3.0))
    energy = pin.computeKineticEnergy(found.model, found.model.createData(), state.q, state.v)
    assert state.v @ state.mass_matrix() @ state.v / 2 == pytest.approx(energy)


PERIOD = 0.001  # [s]
TILT = pin.exp3(np.array([0.4, -0.3, 0.2]))


def bar(rigid=False):
    """Four bars whose rocker turns in a ball where it meets the ground: the chain is not planar."""
    return four_bar(rigid, TILT, pin.JointModelSpherical())


@pytest.mark.parametrize("rigid", [False, True])
def test_rows_of_a_mechanism_are_derivatives_of_its_error(rigid):
    robot, h, rng = bar(rigid), 1e-6, np.random.default_rng(2)
    (task,) = model_rows(robot)
    assert task.dimension == (7 if rigid else 4)
    there = {"crank": -0.8, "finger": 0.3}
    start = Mechanism(bar()).closed(robot.configuration(there), there)
    q, v = robot.integrate(start, 0.05 * rng.normal(size=robot.n)), rng.normal(size=robot.n)

    def at(step):
        return State.at(robot, robot.integrate(q, step), v)

    rows = slice(0, 4)  # the error of a turn is linear only near zero
    columns = [(task.error(at(-h * e)) - task.error(at(h * e))) / (2 * h) for e in np.eye(robot.n)]
    np.testing.assert_allclose(np.transpose(columns)[rows], task.jacobian(at(0 * v))[rows],
                               atol=1e-8)
    dJ = (task.jacobian(at(h * v)) - task.jacobian(at(-h * v))) / (2 * h)
    np.testing.assert_allclose(task.jacobian_derivative(at(0 * v)), dJ, atol=1e-8)


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
        stack = Stack([*model_rows(robot, PERIOD), Posture({"crank": -0.4}, gain=10.0)], "velocity")
        q, state, solver = begin, State(robot), make(resolver)
        for _ in range(500):
            state.move(0.0, q, np.zeros(robot.n))
            x = solver.solve(stack.hierarchy(state)).x
            assert np.abs(x).max() < 20.0
            q = q + PERIOD * x
        assert Mechanism(robot).gap(q)[0] < 1e-8 + 5.0 * rounding
        ends.append(q)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    assert np.abs(ends[0] - begin).max() > 0.1, "it moved"
    assert Mechanism(planar_bar(rigid, 0.0)).gap(ends[0])[0] < 1e-8 + 20.0 * rounding


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("factor", [0.5, 2.0, -3.0])
def test_a_joint_stops_before_its_limit_as_what_follows_it_can(tmp_path, level, factor):
    """A joint that another follows twice as fast passed its limit by 0.07 rad, SOLVED."""
    wide = f'<limit lower="-4" upper="4" velocity="2"/><mimic joint="a" multiplier="{factor}"/>'
    robot = loaded(tmp_path, *(link(name, "") for name in ("l0", "l1", "l2")),
                   joint("a", "revolute", "l0", "l1", LIMIT),
                   joint("b", "revolute", "l1", "l2", wide))
    most, q, v = 5.0, np.zeros(2), np.zeros(2)
    stack = Stack([*model_rows(robot, T), JointLimits(robot, most, T), Posture({"a": 3.0})], level)
    state, resolver = State(robot), make("hcod")
    for tick in range(300):
        state.move(tick * T, q, v)
        if level == "velocity":
            state.commanded = v
        x = resolver.solve(stack.hierarchy(state)).x
        w = x if level == "velocity" else v + T * x
        q, before, v = q + T * (w if level == "velocity" else (v + w) / 2.0), v, w
        assert q[0] <= 1.0 + 1e-9
        assert np.abs(v - before).max() <= most * T + 1e-9
    assert q[0] == pytest.approx(1.0, abs=1e-6)
