"""Wrong values given to robots, states, paths, tasks and stacks: each with what it says."""

from dataclasses import dataclass, fields, replace
from functools import partial
from operator import methodcaller
from pathlib import Path
from threading import Event
from typing import Annotated, Literal

import numpy as np
import pytest
from refusals import refused
from scene import FRAME, ROBOT, SENSOR, of_user, resting, state_at
from standing import CONTACTS, feet, opening
from standing import ROBOT as HUMANOID

from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State, plugins, tasks
from hierarchy.activation import Activation, activation
from hierarchy.avoidance import (
    Barrier,
    Capsule,
    ControlPoint,
    Measurement,
    Obstacle,
    Obstacles,
    Pairs,
    Repulsion,
    SurveillanceAreas,
    measure_pairs,
    pairs_of_chain,
)
from hierarchy.contacts import Contact, Contacts, corners
from hierarchy.gate import check_rotation
from hierarchy.limits import Limits
from hierarchy.loop import Loop
from hierarchy.measured import Measured
from hierarchy.paths import Blended, Jittered, Shifted, Still, circle, read_bvh
from hierarchy.robot import Frame
from hierarchy.robots import TABLES, Link, TreeFrame, TreeTable
from hierarchy.task import Rows
from hierarchy.tasks.joints.coupling import FollowedJoints
from hierarchy.tasks.joints.joint_limits import StepLimits
from hierarchy.tasks.together import TangentCone
from hierarchy.words import some

NAN, INF = float("nan"), float("inf")
A, B = np.eye(2), np.ones(2)
FOOT, PALM = (HUMANOID.frame(f"left_{name}") for name in ("foot", "hand"))
STATE = State.at(ROBOT, [0.9, -0.85, 0.9, 1.2, 0.97, 1.8, 0.0])
URDF = Path(__file__).parents[2] / "examples/robots/iiwa14.urdf"
BARE, PANDA = (State.at(robot, robot.rest) for robot in (
    Robot.load(URDF.with_stem(name)) for name in ("so101", "panda")))
THERE, HAND = Still([0.3, 0.5, 0.1]), resting([0.3, 0.5, 0.1])
LIMITS, POINTS = tasks.JointLimits(ROBOT, 10.0, 0.01), ROBOT.control_points
ARM, KEPT = ROBOT.capsules, Barrier(0.02)
TIMES, CORNERS = (0.5, 1.2), ((0.0, 0.0, 0.1), (0.3, 0.1, 0.2))


def given(wrong=(0.0, 0.0), rate=(0.0, 0.0), J=None, **more):
    """A task of a user that returns what it is given."""
    return of_user("given", 2, lambda _: wrong,
                   lambda state: np.eye(2, state.n) if J is None else J,
                   desired_velocity=lambda *_: rate, **more)


def kernel(wrong, name="kernel"):
    """The same, of one that is measured."""
    return type("Kernel", (Measured,), {"name": name, "dimension": 1,
                                        "measure": lambda *_: wrong})()


@dataclass(frozen=True)
class Own(tasks.Position):
    """A task of a user, with types that are not text, notes, and a type that is not known here."""

    other: Frame | None = None
    side: Literal["left", "right"] = "left"
    part: "Contacts | None" = None
    more: "Unknown | None" = None  # noqa: F821
    speed: Annotated[float, "m/s"] = 1


def rows_after(commanded, task=None):
    task = task or LIMITS
    state = State.at(task.robot, task.robot.rest)
    state.commanded = commanded
    return task.rows(state)


def ramping(carried):
    state = State.at(HUMANOID, HUMANOID.rest, t=0.9)
    state.carried = carried
    return tasks.Friction(opening()).rows(state)


def grown():
    """A task of more rows than the arrays of its stack, past whose end kernels would write."""
    directions = [(1, 0, 0)]
    stack = Stack([tasks.Along(HAND, directions)], "velocity")
    stack.hierarchy(STATE)
    directions.append((0, 1, 0))
    stack.hierarchy(State.at(ROBOT, STATE.q))


def rows_of(task, level="velocity", state=STATE, **given):
    return Stack([task], level, **given).hierarchy(state)


def slow(speed):
    robot = Robot.named("kuka_lwr")
    robot.velocity_limit[0] = speed
    return robot


def separated(pairs, obstacles):
    state = State.at(ROBOT, STATE.q)
    state.measurement = Measurement(8)
    state.measurement.pairs = pairs
    return tasks.Separation(SENSOR.points, KEPT, obstacles).rows(state)


def limits(**settings):
    return tasks.JointLimits(**({"robot": ROBOT, "acceleration": 10.0, "period": 1e-3} | settings))


@pytest.mark.parametrize(("make", "said"), [
    (lambda: tasks.Position(FRAME, THERE, damping=INF), "damping = inf, expected a number >= 0"),
    (lambda: ROBOT.integrate(np.zeros(7), np.zeros(6)), "step: expected 7 finite numbers"),
    (lambda: tasks.Avoidance(["x"]), "control points[0]: expected a ControlPoint, got str 'x'"),
    (lambda: Hierarchy.from_levels([(A, ["1", "2"])]), "b is not an array of numbers: list ['1'"),
    (lambda: Hierarchy.from_levels([(A, np.ma.masked_less([1, 2], 2))]), "of numbers: MaskedArray"),
    (lambda: Hierarchy.from_levels("A"), "levels: expected a list of (A, b)"),
    (lambda: Hierarchy.from_levels([(A, B)] * 2, names=["a"] * 2), "2 levels are named 'a'"),
    (lambda: State.at("kuka_lwr", np.zeros(7)), "State.at: robot: expected a Robot, got str"),
    (lambda: tasks.Position("hand", THERE), "'position': frame is the name 'hand'; give"),
    (lambda: Own(FRAME, THERE, other="hand"), "'position': other is the name 'hand'; give"),
    (lambda: Own(FRAME, THERE, side="up"), "side = 'up': expected one of 'left', 'right'"),
    (lambda: Own(FRAME, THERE, part="foot"), "part: expected a Contacts, got str 'foot'"),
    (lambda: Own(FRAME, THERE, speed="fast"), "'position': speed = 'fast': expected a number"),
    (lambda: tasks.JointLimits("kuka_lwr", 10.0, 0.01), "give Robot.load('kuka_lwr')"),
    (lambda: Stack(["position"]), "a stack: expected a Task, got str 'position'"),
    (lambda: rows_of(HAND, state=ROBOT), "state: expected a State, got Rob"),
    (lambda: STATE.position(PALM), "frame 'left_hand' is on joint 22, and robot 'kuka_lwr' has 7"),
    (lambda: tasks.Position(PALM, THERE).error(STATE), "task 'position': frame is on joint"),
    (lambda: rows_of(tasks.Position(PALM, THERE)), "has 7 joints: it is of ano"),
    (lambda: rows_of(tasks.CentreOfMass(HUMANOID, THERE)), "'centre of mass': robot is of robot '"),
    (lambda: tasks.Avoidance(HUMANOID.control_points).jacobian(STATE), "points is on joint"),
    (lambda: tasks.Friction(CONTACTS).rows(STATE), "contacts is of robot 'humanoid'"),
    (lambda: Contacts(ROBOT, [Contact(PALM)]), "contact 'left_hand' is on joint"),
    (lambda: CONTACTS.jacobian(STATE), "contacts: state is of robot"),
    (lambda: CONTACTS.torques(STATE, np.zeros(CONTACTS.unknowns)), "contacts: state is of robot"),
    *((lambda ask=ask: ask(resting([0.3, 0.5, 0.1], gain=[1.0, 2.0])),
       "task 'position': gain has the shape (2,), expected a number or (3,)")
      for ask in (rows_of, *(methodcaller(name, STATE) for name in (
          "error", "jacobian", "reference_velocity")))),
    (lambda: tasks.SelfSeparation(ARM, KEPT, [0, 1]), "pairs have the shape (2,), not (m, 2)"),
    (lambda: tasks.model_rows(ROBOT, 0.0), "period [s] = 0: expected a number > 0"),
    (lambda: Stack([HAND], A), "level must be 'velocity'"),
    (lambda: Stack([HAND], give=0.1), "give of a stack: expected a Mapping, got float 0.1"),
    (lambda: Hierarchy.from_levels([(A, B)], names=np.array(1.0)), "expected a list of texts, got"),
    (lambda: Hierarchy.from_levels([(A, B)], give=0.1), "give: expected a Sized, got float 0.1"),
    (lambda: Hierarchy.from_levels([(A, B)]).relaxed(0, B), "no level of the hierarchy gives"),
    (lambda: Hierarchy.from_levels([(A, B)], give=[0.1]).relaxed(1, B), "relaxed: level = 1: expe"),
    (lambda: Hierarchy.from_levels([(A, B)]).upper_part(2), "2: expected a whole number fr"),
    (lambda: Hierarchy.from_levels([(A, B)]).upper_part(1, (B, B[:1])), "sides has shape (1,), e"),
    *((partial(setattr, Robot.named("kuka_lwr"), name, value), f"robot 'kuka_lwr': {name}{said}")
      for name in ("lower", "upper", "velocity_limit", "effort_limit", "rest") for value, said in (
          (1.0, " has shape (), expected (7,)"), ([1.0], " has shape (1,), expected (7,)"),
          (None, " is not an array of numbers: NoneType"), ([0.0] * 6 + [NAN], "[6] is nan"))),
    (lambda: Robot.load("kuka_lwr", locked=B), "Robot: locked: expected a Mapping, got ndarray"),
    (lambda: Robot.load("kuka_lwr", root=B), "Robot: root: expected a Sequence, got ndarray"),
    (lambda: ROBOT.difference(np.zeros(7), B), "q: expected 7 finite numbers, got ndarray"),
    (lambda: ROBOT.joint(B), "unknown joint"),
    (lambda: ROBOT.frame(B), "unknown frame"),
    (lambda: Robot.load("kuka_lwr", base=B), "base must be one of"),
    (lambda: Robot.named("kuka_lwr", base=B), "robot 'kuka_lwr': base must be one of"),
    (lambda: Robot.from_file(URDF, base="flying"), "iiwa14.urdf': base must be one of"),
    (lambda: Robot.from_file(URDF, None, None, {"j": 0.1}), "shapes: expected a bool, got dict"),
    (lambda: Robot.from_file(URDF, end_effector=B), "unknown end_effector frame array("),
    (lambda: Blended(np.array(1.0), CORNERS, 0.1), "times: expected a list, got ndarray array(1.)"),
    (lambda: Contact(FRAME, open=1.0), "open 1.0, expected pairs of times"),
    (lambda: Contacts(ROBOT, ["foot"]), "contacts[0]: expected a Contact, got str 'foot'"),
    (lambda: Contact(FOOT, friction=0.0), "'left_foot': friction = 0: expected a number > 0"),
    (lambda: Contact(FOOT, normal=np.ma.masked_less([-1, 0, 1], 0)), "3 finite numbers, got Mask"),
    (lambda: Contact(FOOT, [(0, 0)]), "are not (k, 3) numbers"),
    (lambda: tasks.Friction(CONTACTS, 6), "faces = 6: expected one of 4, 8"),
    (lambda: tasks.Friction(CONTACTS, least=5.0, largest=5.0), "largest 5.0 N"),
    (lambda: tasks.CentreOfPressure(Contacts(HUMANOID, [Contact(FOOT)])), "no contact is a surfa"),
    (lambda: Contact.rectangle(FOOT, 0.1, (0.0, 0.1)), "sole: x [m]: expected 2 finite numbers"),
    (lambda: Contact(FOOT, np.eye(3), slides=True), "3 points that slide; only a contact of one"),
    (lambda: tasks.Along(HAND, ((1, 0, 0), (1, 1, 0))), "'along': directions ((1, 0, 0), (1, 1"),
    (lambda: setattr(STATE, "q", np.zeros(7)), "State.q cannot be set; state.move(t, q, v)"),
    (lambda: setattr(SENSOR, "obstacles", []), "ExactDistances: obstacles cannot be set, as tasks"),
    (lambda: State.at(ROBOT, [1j] * 7), "'kuka_lwr': q is not an array of real numbers: it is co"),
    (lambda: tasks.model_rows("kuka_lwr"), "model_rows: robot: expected a Robot, got str"),
    (lambda: tasks.JointDamping(10**30), "joints = 1000000000000000000000000000000: expected a"),
    (lambda: tasks.JointDamping(7, 10**400), "damping = inf: expected a finite number from 0 on"),
    (lambda: Loop(0.1, priority="high"), "loop: priority = 'high': expected a whole number"),
    (lambda: tasks.ContactForce(CONTACTS, "left_foot", (1.0, 2.0)), "is not 1, 3 or 6"),
    (lambda: tasks.ContactMotion(CONTACTS, [np.eye(3)] * 3), "anchors are not (4, 3) for each of"),
    (lambda: tasks.ContactMotion(opening(), [np.eye(4, 3)] * 2, 9.0), "opens, so its stiffness mu"),
    (lambda: tasks.Momentum("all"), "part = 'all': expected one of 'both', 'linear', 'angular'"),
    (lambda: tasks.Together([]), "there are no tasks in it"),
    (lambda: Stack(level="torque"), "level 'torque' needs contacts, Contacts(robot) for none"),
    (lambda: Stack(contacts=CONTACTS), "contacts need the level 'torque', not 'acceleration'"),
    (lambda: Stack([tasks.Friction(CONTACTS)]), "task 'friction': contact forces need the level"),
    (lambda: Stack([tasks.Friction(feet())], "torque", contacts=CONTACTS), "not those of the st"),
    (lambda: read_bvh(None), "read_bvh: file: expected a path, got NoneType"),
    *((lambda name=name: read_bvh(name), "read_bvh: file: no file can be called 'a")
      for name in ("a" * 5000, "a\0b", "a\ud800")),
    # values out of their range
    (lambda: Obstacle("cone", (0, 0, 0)), "unknown obstacle shape 'cone'"),
    (lambda: Repulsion(0.0, 1.0, 1.0), "maximum"),
    (lambda: SurveillanceAreas(0.2, 0.1, 0.1), "near"),
    (lambda: Barrier(0.1, influence=0.1), "influence = 0.1 m must be more"),
    (lambda: tasks.Separation([ControlPoint("x", np.int64(99), (0, 0, 0))], KEPT).rows(STATE),
     "points is on joint 99"),  # of another robot, past the end of its arrays
    (lambda: Capsule("x", 1, (0, 0, 0), (0, 0, 1), -1.0), "capsule 'x': radius [m] = -1"),
    *((lambda ask=ask: ask(STATE), "on joint")  # of a larger robot, past the end of arrays
      for ask in (tasks.SelfSeparation.of(HUMANOID, KEPT).error,
                  tasks.Pointing(PALM, (0, 0, 1), 0.1).follow_cone_error)),
    (lambda: SENSOR.measure(PANDA), "ExactDistances: state is of robot 'panda', not of 'kuka_lwr'"),
    (lambda: setattr(Measurement(8), "active", 8), "active = 8: expected a whole number from -1"),
    *((lambda size=size: measure_pairs(Pairs(*size), np.zeros((1, 3)), Obstacles()), said)
      for size, said in (((2, 0), "points has shape (1, 3), expected (2, 3)"),
                         ((1, 3), "0 obstacles, and pairs of 3"))),
    (lambda: tasks.SelfSeparation(ARM[:2], KEPT), "'self-separation': no pair among 2"),
    (lambda: tasks.Separation((), KEPT), "'separation': points: expected at least one control"),
    (lambda: tasks.CumulatedRepulsion(7, POINTS, 0.1, lever=0.0), "lever [m] = 0: ex"),
    (lambda: tasks.CumulatedRepulsion(7, POINTS, 0.1, tasks.Posture(B)), "has 2 rows, expected 7"),
    (lambda: tasks.CumulatedRepulsion(7, POINTS, 0.1).reference_velocity(STATE), "no measurement"),
    (lambda: tasks.DangerBounds(LIMITS, POINTS, reach=0.0), "reach [m] = 0: expected a number"),
    (lambda: tasks.Pointing(FRAME, (0.0, 0.0, 0.0), 0.1), "axis"),
    (lambda: tasks.Avoidance(POINTS, 2), "rows = 2: expected one of 1, 3"),
    (lambda: tasks.Avoidance(POINTS, 1).jacobian(STATE), "no measurement"),
    (lambda: tasks.Separation(POINTS, KEPT).rows(STATE), "carries no measurement of pairs"),
    *((lambda pairs=pairs, of=of: separated(pairs, of), said) for pairs, of, said in (
        (None, 1, "'separation': the state carries no measurement of pairs"),
        (Pairs(9, 2), 1, "9 points are measured against 2 obstacles, expected 9 against 1"),
        (Pairs(8, 1), 1, "8 points are measured against 1 obstacles, expected 9"),
        (Pairs(9, 0), None, "against 0 obstacles, expected 9 against one at least"))),
    *((lambda task=task: task.jacobian(state_at(STATE.q, STATE.v)), f"{len(task.points)} control "
       "points, and distances of 9")  # beyond the end of an array
      for task in (tasks.Avoidance(POINTS[:2]), tasks.CumulatedRepulsion(7, POINTS * 2, 0.1))),
    *((lambda asked=asked: asked(PANDA), "on joint 'joint_7', which is 'panda_joint7' of robot "
       "'panda': it is of another robot") for asked in (
           HAND.error, Stack([HAND]).hierarchy, methodcaller("position", FRAME))),
    (lambda: BARE.momentum, "robot 'so101' has no masses"),
    (lambda: rows_of(tasks.Momentum(name="spin"), state=BARE), "task 'spin': robot 'so101' has no"),
    (lambda: rows_of(tasks.Posture([0.0] * 5), state=BARE, metric="mass"), "metric 'mass': robot"),
    *((lambda span=span: Blended((0.0, span), CORNERS, span), "too near or too far apart, got 0.0")
      for span in (1e-300, 1e300)),
    (lambda: tasks.Manipulability(BARE.robot.frame("gripper"), 0.1, "pose").error(BARE),
     "robot 'so101' has 5 joints, so the manipulability of 6 rows is 0 everywhere"),
    (lambda: tasks.CentreOfMass(ROBOT, THERE, (1, 0)), "in this order"),
    (lambda: tasks.CentreOfMass(ROBOT, THERE, (0, 3)), "must be some of 0, 1, 2"),
    (lambda: tasks.JointCoupling(ROBOT, {"joint_1": 0.0}), "no factor other than zero"),
    (lambda: tasks.Manipulability(FRAME, -0.1), "least = -0.1"),
    (lambda: limits(acceleration=1e-300), "limits[0]: acceleration times period 0.001 s squared "),
    (lambda: limits(period=1e100, acceleration=1.0), "acceleration times period 1e+100 s squared"),
    (lambda: limits(acceleration=0.0), "limits[0]: acceleration must be positive and finite, got"),
    (lambda: limits(acceleration=[1.0, 2.0]), "has shape (2,), expected a number or (7,)"),
    (lambda: limits(margin=2.2), "margin 2.2 leaves joint_2 no room between -2.094 and 2.094"),
    (lambda: Limits([0], [NAN], [1], [1], 1e-3), "limits[0]: no position lies between lower and u"),
    (lambda: Limits([0], [1], [0], [1], 1e-3), "limits[0]: velocity must be positive, got 0.0"),
    (lambda: rows_of(tasks.TorqueLimits(ROBOT)), "for the level acceleration or torque, not 'vel"),
    *((lambda fraction=fraction: tasks.TorqueLimits(ROBOT, fraction),
       f"fraction = {fraction:g}: expected a number > 0, at most 1")
      for fraction in (-1.0, 0.0, 80.0)),
    (lambda: Blended(TIMES, CORNERS, 1e-300), "blend 1e-300 s must be at least 1e-100 s"),
    (lambda: Blended(TIMES[:1], CORNERS, 0.1), "1 times for 2 points"),
    *((lambda bad=bad: Jittered(THERE, **{"amplitude": 0.1, "rate": 1.0, "seed": 0} | bad),
       f"jitter: {next(iter(bad))}")
      for bad in ({"amplitude": -1.0}, {"rate": 0.0}, {"seed": -1})),
    (lambda: circle((0, 0, 0), -0.1), "circle: radius [m] = -0.1"),
    (lambda: circle((0, 0, 0), 0.1, (0, 0, 0)), "normal: tuple (0, 0, 0) is no direction"),
    (lambda: corners((0, 1), (0, 1), (0, 0, 0)), "sole: up: tuple (0, 0, 0) is no direction"),
    (lambda: Loop(0.0), "loop: period [s] = 0: expected"), (lambda: Loop(0.1, behind=0), "behind"),
    (lambda: Loop(0.1, overrun="skipp"), "did you mean 'skip'"),
    (lambda: Loop(0.25, watchdog=0.1), "watchdog 0.1 s must be longer than the period 0.25 s"),
    (lambda: Loop(0.1).run(print, None, 1.0), "safe_stop: expected a function, got NoneType None"),
    (lambda: Loop(1e-3).run(lambda t: A[0], Event, 1.0, record=3),
     "loop: record = 3, and the command is ndarray array([1., 0.])"),
    (lambda: Loop(1e-3).run(lambda t: {}, Event, 1.0, record=3), "and the command is dict {}"),
    (lambda: Loop(1e-3).run(print, Event, 1e15), "loop: a log of 1e+18 ticks: "),
    (lambda: Loop(0.1).run(print, print, 1.0, record=-1), "loop: record = -1: expected a whole"),
    (lambda: Stack(metric="inertia"), "'mass' or None, got 'inertia'"),
    (lambda: ROBOT.limit_base(1.0, 1.0), "its base is fixed"),
    (lambda: HUMANOID.limit_base(0.0, 1.0), "linear speed of the base = 0"),
    (lambda: tasks.Posture((0.0,) * 4).error(STATE), "'posture': 4 values for 7 joint positions"),
    (lambda: tasks.Posture({"leg": 0.0}, robot=ROBOT), "'posture': unknown joint 'leg'"),
    (lambda: tasks.Posture({"arm": 0.0}).dimension, "give Posture(..., robot=robot)"),
    (lambda: tasks.DangerBounds(LIMITS, POINTS).box(STATE, "velocity"), "carries no measurement"),
    (lambda: tasks.TorqueLimits(HUMANOID), "torques depend on contact forces, so give the contac"),
    (lambda: tasks.TorqueStep(HUMANOID, 1.0), "contact forces"),
    (lambda: tasks.TorqueStep(ROBOT, 0.0), "step = 0: expected a number > 0"),
    (lambda: rows_of(tasks.TorqueStep(ROBOT, 1.0), "acceleration"), "level torque, not 'acceler"),
    (lambda: tasks.DangerBounds(tasks.JointLimits(HUMANOID, 5.0, 0.01), HUMANOID.control_points),
     "floating base"),
    *((lambda sent=sent: rows_after(sent), f"'joint limits': state.commanded = {said}")
      for sent, said in ((np.zeros(6), "ndarray array([0."), ([0.0] * 7, "list [0.0"),
                          (np.full(7, NAN), "ndarray array([nan"))),
    (lambda: rows_after(np.zeros(6), tasks.TorqueStep(HUMANOID, 1.0, contacts=CONTACTS)),
     "'torque step': state.commanded has shape (6,), expected (30,)"),
    (lambda: CONTACTS.forces(""), "contacts: x is not an array of numbers: str ''"),
    (lambda: STATE.move(0.0, [], np.zeros(7)), "State.move: expected arrays q (7,) and v (7,), g"),
    (lambda: Stack([HAND]).hierarchy(STATE, [HAND]), "unknown task Position"),
    (lambda: opening().carried(0.9, np.zeros(60), np.zeros(1)), "carried has shape (1,), expected"),
    (lambda: ramping([3.0]), "contacts: state.carried has shape (1,), expected (2,)"),
    (lambda: LIMITS.limits.box(np.zeros(6), np.zeros(7), "velocity"), "7 finite numbers each"),
    (lambda: LIMITS.limits.clamp(np.zeros(7), np.zeros(7), "velocity", np.zeros(8)),
     "7 positions, 7 velocities and a command of shape (8,) for 7 joints"),
    *((lambda task=task: rows_of(HAND, reference=task),
       f"{task.name!r}: the reference of a stack has a row for each joint")
      for task in (HAND, LIMITS)),
    *((lambda wrong=wrong: given(wrong).error_reader(STATE)(), f"task 'given': error {said}")
      for wrong, said in ((None, "is not an array of numbers"), ("x", "is not an array of numb"),
                          ([1.0], "has shape (1,), expected (2,)"))),
    (lambda: Stack([kernel(abs, None)]), "Kernel: name: expected a str, got NoneType None"),
    *((lambda wrong=wrong: rows_of(given(**wrong)), said)
      for wrong, said in (({"wrong": [1.0, 2.0, 3.0]}, "'given': error has shape (3,), expec"),
                          ({"wrong": [0.0, NAN]}, "task 'given', row 1: lower is nan"),
                          ({"J": np.eye(7)}, "jacobian has shape (7, 7), expected (2, 7)"),
                          ({"J": NAN * np.eye(2, 7)}, "task 'given', row 0: A[0, 0] is nan"),
                          ({"wrong": "a"}, "'given': error is not an array of numbers"),
                          ({"rate": [0.0]}, "'given': desired_velocity has shape (1,)"))),
    (lambda: rows_of(given(kind="Equality")), "task 'given': kind"),
    *((lambda wrong=wrong: kernel(wrong).error(STATE), f"'kernel': measure returned {said}")
      for wrong, said in ((abs, "builtin"), ((abs, ()), "tuple"), (None, "NoneType"))),
    (lambda: Activation(None, (), {"wall": 0.0}), "task 'wall': buffer = 0: expected"),
    (lambda: check_rotation("R", np.diag([1.0, 1.0, -1.0])), "a reflection, of determinant -1"),
    *((lambda off=off: check_rotation("R", np.eye(3) + off * np.eye(3, k=1)),
       f"is {off:g} from the identity, at most 1e-06 is allowed{mend}; got list")
      for off, mend in ((1e-5, ": write it with 8 digits"), (0.1, ""))),
    (lambda: check_rotation("R", "turn"), "R: expected a rotation matrix (3, 3), got str 'turn'"),
    (lambda: tasks.Along(HAND, ((1, 0, 0), (1,))), "'along': directions ((1, 0, 0), (1,)) are not"),
    (lambda: Stack([tasks.Position(FRAME, THERE, gain=[[1.0], [1.0, 2.0]])]),
     "gain = [[1.0], [1.0, 2.0]], expected a number >= 0"),
    *((lambda wrong=wrong: StepLimits(slow(wrong), 0.01), f"velocity_limit[0] is {wrong:g}")
      for wrong in (-1.0, NAN)),
    (grown, "task 'along': its rows are (2, 7), and arrays of (1, 7) were made; make another"),
    (lambda: LIMITS.writer(STATE, "velocity", Rows.empty(7, 3)), "of (7, 3) were made; make"),
    (lambda: StepLimits(ROBOT, 0.01, 0.0), "gain [1/s] = 0: expected a number > 0"),
    (lambda: Obstacles([Obstacle("point", (0, 0, 0))]).shift(0, (NAN, 0, 0)), "shift: offset [m]"),
    *((lambda h=h: Obstacles([Obstacle("point", (0, 0, 0))]).shift(h, (0, 0, 1)),
       f"shift: h = {h!r}: expected a whole number from 0 to 0") for h in (-1, 1, None)),
    *((lambda t=t: THERE(t), f"path: t [s] = {t!r}: expected a finite number")
      for t in (NAN, INF, None)),
    (lambda: Robot.load(TABLES["kuka_lwr"]), "model: expected a name or a file, got DHTable"),
    (lambda: Robot.load("a." * 5000), "unknown robot 'a.a."),
    (lambda: replace(TABLES["kuka_lwr"], a=(0.0,)), "'kuka_lwr': a has 1 entries, and d 7, one"),
    (lambda: replace(TABLES["kuka_lwr"], effort=(-1.0,) * 7), "effort[0] = -1: expected a number"),
    *((lambda points=points: replace(TABLES["kuka_lwr"], control_points=points), said)
      for points, said in (("x", "control_points[0]: expected a pair, got str 'x'; give (joint, o"),
                           ([("a", [1, 2])], "control_points[0]: expected 3 finite numbers, got"))),
    *((lambda kind=kind, wrong=wrong: kind(**wrong), said) for kind, wrong, said in (
        (Link, {"mass": -1.0}, "link: mass = -1: expected a finite number from 0 on"),
        (TreeFrame, {"name": "f", "joint": "", "offset": (0, 0, 0), "z_axis": (0, 0, 0)},
         "frame 'f': z_axis: tuple (0, 0, 0) is no direction"),
        (TreeTable, {"name": "t", "joints": ("a",), "frames": (), "end_effector": "a"},
         "table 't': joints[0]: expected a TreeJoint, got str 'a'"),
        (TreeTable, {"name": "t", "joints": (), "frames": (), "end_effector": "a",
                     "links": [("", 9)]}, "'t': links[0]: expected a Link, got int 9"))),
    (lambda: replace(TABLES["quadruped"].joints[0], axis="w"), "axis = 'w': expected one of 'x', "),
    (lambda: replace(TABLES["quadruped"].joints[0], range=(1, -1)), "range: expected (lower, upp"),
    *((lambda ask=ask: ask(LIMITS), said) for ask, said in (
        (lambda task: task.box(None, "velocity"), "'joint limits': state: expected a State, got"),
        (lambda task: task.clamp(3, "velocity", A[0]), "'joint limits': state: expected a State"),
        (lambda task: task.rows("x"), "'joint limits': state: expected a State, got str 'x'"),
        (lambda task: task.box(STATE, "speed"), "level = 'speed': expected one of 'velocity', 'ac"),
        (lambda task: task.clamp(STATE, "speed", A[0]), "level = 'speed': expected one of"),
        (lambda task: task.clamp(STATE, "velocity", "x"), "x is not an array of numbers: str 'x'"),
        (lambda task: task.clamp(STATE, "velocity", A), "a command of shape (2, 2) for 7 joi"))),
    (lambda: plugins.find("tasks", []), "plugins.find: name: expected a str, got list []"),
    (lambda: plugins.known("task"), "unknown group 'task'; did you mean 'tasks'?"),
    (lambda: Pairs(-1, 2), "pairs: points = -1: expected a whole number from 0 on"),
    (lambda: measure_pairs(None, B, Obstacles()), "measure_pairs: pairs: expected a Pairs, got No"),
    (lambda: measure_pairs(Pairs(1, 0), B, []), "obstacles: expected an Obstacles, got list []"),
    (lambda: pairs_of_chain(3), "capsules: expected a Sequence, got int 3"),
    *((lambda width=width: activation(B, width), f"activation: buffer = {width}: expected")
      for width in (0, -1, NAN)),
    (lambda: activation("x", 0.1), "activation: error is not an array of numbers: str 'x'"),
    (lambda: Activation(STATE, "x", {}), "activation: tasks[0]: expected a Task, got str 'x'"),
    (lambda: Activation(STATE, [HAND], [0.1]), "buffers: expected a Mapping, got list [0.1]"),
    (lambda: Activation(STATE, [HAND], {"positon": 0.1}), "did you mean 'position'"),
    (lambda: TangentCone("x"), "set-based task: expected a Task, got str 'x'"),
    (lambda: FollowedJoints(ROBOT, ()), "task 'couplings': no joints are coupled"),
    (lambda: FollowedJoints(ROBOT, ["x"]), "coupled[0]: expected a Coupled, got str 'x'"),
    (lambda: tasks.Along(HAND, 10**400), "are not of length one and orthogonal"),
    (lambda: Robot.load("nowhere.SDF"), "does not exist"),
    (lambda: Robot.load("/"), "is a folder")])
def test_a_wrong_value_is_refused_and_named(make, said):
    refused(said, make)


@pytest.mark.parametrize("record", [
    HAND, LIMITS, tasks.Along(HAND, [(1, 0, 0)]), tasks.Pointing(FRAME, (0, 0, 1), 0.1),
    tasks.RelativePose(FRAME, FRAME, (0, 0, 0)), tasks.Manipulability(FRAME, 0.1),
    tasks.CentreOfMass(ROBOT, THERE), tasks.Momentum(), tasks.JointDamping(7),
    tasks.JointCoupling(ROBOT, {"joint_1": 1.0}), tasks.CumulatedRepulsion(7, POINTS, 0.1),
    tasks.TorqueLimits(ROBOT), tasks.TorqueStep(ROBOT, 1.0), tasks.DangerBounds(LIMITS, POINTS),
    tasks.Friction(CONTACTS), tasks.ContactMotion(CONTACTS), FRAME, POINTS[0], ARM[0], KEPT,
    CONTACTS.contacts[0], Obstacle("point", (0, 0, 0), path=THERE), Repulsion(1.0, 1.0, 1.0),
    Shifted(THERE, (0, 0, 1)), Jittered(THERE, 0.1, 1.0, 0), Link(), TABLES["kuka_lwr"],
    TABLES["quadruped"], TABLES["quadruped"].joints[0]], ids=lambda record: type(record).__name__)
def test_a_field_of_another_type_or_nan_is_refused_by_name(record):
    for field in fields(record):
        if field.init and field.name not in ("base_speed", "base_acceleration"):  # it has no base
            for wrong in (object(), NAN):
                with pytest.raises(HierarchyError, match=field.name.replace("_", "[ _]")):
                    replace(record, **{field.name: wrong})


def test_what_would_be_said_of_a_wrong_measure_is_not_written_for_a_right_one(monkeypatch):
    """It took most of the time of a task of one's own that asks another for its Jacobian."""
    monkeypatch.setattr("hierarchy.measured.brief", lambda value: pytest.fail("written"))
    assert HAND.jacobian(STATE).shape == (3, 7)


@pytest.mark.parametrize("wrong", ["state", None, 3, ROBOT])
@pytest.mark.parametrize("task", [HAND, tasks.Posture((0.0,) * 7), given()],
                         ids=lambda task: task.name)
def test_what_takes_a_state_refuses_anything_else(task, wrong):
    for method in (task.error, task.jacobian, task.jacobian_derivative, task.reference_velocity,
                   task.reference_acceleration):
        refused(f"task '{task.name}': state: expected a State", method, wrong)


def test_of_many_names_the_first_are_told_and_never_that_there_is_one_more():
    assert [some("abcd"[:count], 2) for count in (1, 2, 3, 4)] == [
        "a", "a, b", "a, b, c", "a, b and 2 more"]
