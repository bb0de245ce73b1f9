"""Wrong values given to robots, states, paths, tasks and stacks: each with what it says."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State, Task
from hierarchy.avoidance import Barrier, Capsule, Obstacles, Repulsion, SurveillanceAreas
from hierarchy.limits import Limits
from hierarchy.loop import Loop
from hierarchy.paths import Ellipse, Jittered, Still, Waypoints, line
from hierarchy.tasks import (
    Avoidance,
    BaseDynamics,
    ContactForce,
    DangerBounds,
    Friction,
    JointCoupling,
    JointDamping,
    JointLimits,
    LookAt,
    Manipulability,
    Pointing,
    Pose,
    Position,
    Posture,
    RelativePose,
    SelfSeparation,
    Separation,
    Together,
)

NAN, INF = float("nan"), float("inf")
ROBOT = Robot.load("kuka_lwr")
STATE = State.at(ROBOT, [0.9, -0.85, 0.9, 1.2, 0.97, 1.8, 0.0])
FRAME = ROBOT.frame("end_effector")
THERE = Still([0.3, 0.5, 0.1])


class Own(Task):
    """A task whose methods return what they should not."""

    name, dimension = "own", 2

    def __init__(self, jacobian):
        self._jacobian = jacobian

    def error(self, state):
        return np.zeros(2)

    def jacobian(self, state):
        return self._jacobian

    def jacobian_derivative(self, state):
        return np.zeros((2, 7))


@pytest.mark.parametrize(("make", "said"), [
    (lambda: Still("a"), "must be three finite numbers [m], got"),
    (lambda: Still(None), "got None"),
    (lambda: Ellipse("c", "a", "b"), "centre must be three finite numbers"),
    (lambda: Ellipse([0] * 3, [1] * 3, [2] * 3, rate="x"), "ellipse: rate = 'x'"),
    (lambda: Ellipse([0] * 3, [1] * 3, [2] * 3, rate=NAN), "ellipse: rate"),
    (lambda: Waypoints("ab", "cd"), "times: expected a list, got str 'ab'"),
    (lambda: Waypoints([0, NAN], [[0, 0, 0]] * 2), "times[1]"),
    (lambda: Position(3, THERE), "task 'position': frame: expected a Frame, got int 3"),
    (lambda: Position(FRAME, None), "task 'position': path: expected a Path, got NoneType None"),
    (lambda: Position(FRAME, THERE, name=3), "Position: name: expected a text, got int 3"),
    (lambda: Position(FRAME, THERE, name=""), "Position: name"),
    (lambda: Position(FRAME, THERE, gain=True), "gain = True, expected a number >= 0"),
    (lambda: Position(FRAME, THERE, damping=INF), "damping = inf, expected a number >= 0"),
    (lambda: Posture("abc"), "task 'posture': target: expected finite numbers, got str 'abc'"),
    (lambda: Posture((NAN,) * 7), "task 'posture': target"),
    (lambda: Posture(3), "target: expected finite numbers, got int 3"),
    (lambda: Posture(()), "target: expected finite numbers"),
    (lambda: Posture((1j,) * 7), "target: expected finite numbers"),
    (lambda: JointLimits(ROBOT, "a", 0.01), "acceleration: expected numbers, got str 'a'"),
    (lambda: JointLimits(ROBOT, 10.0, 0.01, margin="x"), "task 'joint limits': margin"),
    (lambda: Pointing(FRAME, "x", half_angle=0.1), "task 'pointing': axis"),
    (lambda: Pointing(FRAME, (1, 0, 0), half_angle="a"), "half_angle [rad] = 'a'"),
    (lambda: Pointing(FRAME, (1, 0, 0), half_angle=0.1, kind="no"), "kind must be 'equality'"),
    (lambda: LookAt(FRAME, "a"), "target must be three finite numbers [m], got 'a'"),
    (lambda: Manipulability(FRAME, "a"), "least = 'a': expected a finite number from 0 on"),
    (lambda: JointCoupling(ROBOT, "joint_1", 0.0), "joints: expected a Mapping"),
    (lambda: JointCoupling(ROBOT, {"joint_1": NAN}, 0.0), "joints.joint_1"),
    (lambda: Pose(FRAME, THERE, np.zeros((3, 3))), "expected a rotation matrix (3, 3)"),
    (lambda: Pose(FRAME, THERE, "x"), "expected a rotation matrix (3, 3), got str 'x'"),
    (lambda: Pose(FRAME, THERE, -np.eye(3)), "expected a rotation matrix"),
    (lambda: Stack([Own("J")]).hierarchy(STATE), "task 'own': jacobian is no array of numbers"),
    (lambda: Stack([Own(np.full((2, 7), NAN))]).hierarchy(STATE), "own"),
    (lambda: Stack([Position(FRAME, THERE)], reference="x"), "reference of a stack"),
    (lambda: Stack([Position(FRAME, THERE)], metric=np.eye(3)).hierarchy(STATE),
     "metric has shape (3, 3), expected (7, 7)"),
    (lambda: Stack().insert(Posture((0.0,) * 7), "0"), "index: expected an int, got str '0'"),
    (lambda: Robot.load("kuka_lwr", base="flying"), "base must be one of"),
    (lambda: ROBOT.control_point("joint_1", "x"), "control point on 'joint_1': offset"),
    (lambda: ROBOT.control_point("joint_1", [NAN, 0, 0]), "offset: expected 3 finite numbers"),
    (lambda: State("kuka_lwr"), "State: robot: expected a Robot, got str 'kuka_lwr'"),
    (lambda: State.at(ROBOT, [0.0] * 7, t="now"), "State.at: t = 'now': expected a finite number"),
    (lambda: State.at(ROBOT, [10**400] * 7), "q"),
    (lambda: STATE.position("nobody"), "unknown frame 'nobody'"),
    (lambda: STATE.position(3), "frame: expected a Frame, got int 3"),
    (lambda: STATE.move(0.0, [0.0] * 7, np.zeros(7)), "State.move: expected arrays q (7,)"),
    (lambda: STATE.move(0.0, np.zeros(9), np.zeros(7)), "State.move: expected arrays q (7,)"),
    (lambda: Robot("x", "y"), "Robot: model: expected a Model, got str 'x'"),
    (lambda: Robot(ROBOT.model, 3), "Robot: name: expected a str, got int 3"),
    (lambda: Robot.named([]), "Robot.named: name: expected a str, got list []"),
    (lambda: Robot.from_file(3), "Robot.from_file: path: expected a path, got int 3"),
    (lambda: ROBOT.integrate("a", 1), "robot 'kuka_lwr': q: expected 7 finite numbers"),
    (lambda: ROBOT.integrate(np.zeros(7), np.zeros(6)), "step: expected 7 finite numbers"),
    (lambda: ROBOT.integrate(np.zeros(7), np.full(7, NAN)), "step: expected 7 finite numbers"),
    (lambda: Hierarchy.from_levels([([[1.0, 0.0]], [1.0])]).violations([0.0, NAN]),
     "x, entry 1: nan is not finite"),
    (lambda: RelativePose(FRAME, "joint_1", (0, 0, 0)), "to is the name 'joint_1'"),
    (lambda: RelativePose(FRAME, FRAME, (0, 0)), "position: expected 3 finite numbers"),
    (lambda: BaseDynamics("x"), "contacts: expected a Contacts, got str 'x'"),
    (lambda: Friction(3), "contacts: expected a Contacts, got int 3"),
    (lambda: ContactForce([NAN], "x", (1.0,)), "contacts: expected a Contacts, got list [nan]"),
    (lambda: JointDamping("x"), "task 'damping': joints: expected an int, got str 'x'"),
    (lambda: Avoidance(["x"]), "control points[0]: expected a ControlPoint, got str 'x'"),
    (lambda: Avoidance(3), "control points: expected a Sequence, got int 3"),
    (lambda: Separation(3, 4), "barrier: expected a Barrier, got int 4"),
    (lambda: SelfSeparation(["x"] * 3, Barrier(0.1)), "capsules[0]: expected a Capsule"),
    (lambda: DangerBounds(3, ROBOT.control_points), "limits: expected a JointLimits, got int 3"),
    (lambda: Together([3]), "tasks[0]: expected a Task, got int 3"),
    (lambda: Barrier("x"), "barrier: distance = 'x'"),
    (lambda: Repulsion(1.0, "x", 1.0), "repulsion reach = 'x'"),
    (lambda: SurveillanceAreas("x", 0.1, 0.1), "surveillance area near = 'x'"),
    (lambda: Capsule("arm", 1, (0, 0, 0), (0, 0, 1), "x"), "capsule 'arm': radius [m] = 'x'"),
    (lambda: Obstacles(["x"]), "obstacles[0]: expected an Obstacle, got str 'x'"),
    (lambda: Limits("x", 1, 1, 1, 1), "limits: lower, upper, velocity and acceleration must be"),
    (lambda: Loop("x"), "loop: period = 'x'"),
    (lambda: Loop(0.1).run(print, print, "x"), "loop: duration = 'x'"),
    (lambda: Jittered(THERE, "x", 1.0, 1), "jitter: amplitude = 'x'"),
    (lambda: Jittered(3, 0.1, 1.0, 1), "jitter: path: expected a Path, got int 3"),
    (lambda: line((0, 0, 0), (1, 0, 0), "x"), "line: duration [s] = 'x'"),
    (lambda: Stack([Posture((0.0,) * 7)]).reorder(3), "order of a stack: expected a Sequence"),
    (lambda: Stack([Posture((0.0,) * 7)]).row_names(3), "order of a stack: expected a Sequence"),
    (lambda: Stack([Posture((0.0,) * 7)]).remove([]), "unknown task []"),
])
def test_a_wrong_value_is_refused_and_named(make, said):
    with pytest.raises(HierarchyError) as error:
        make()
    assert said in str(error.value)


@pytest.mark.parametrize("given", ["state", None, 3, ROBOT])
@pytest.mark.parametrize("task", [Position(FRAME, THERE), Posture((0.0,) * 7), Own(np.eye(2, 7))],
                         ids=lambda task: task.name)
def test_what_takes_a_state_refuses_anything_else(task, given):
    for method in (task.error, task.jacobian, task.jacobian_derivative, task.reference_velocity,
                   task.reference_acceleration):
        with pytest.raises(HierarchyError, match=f"task '{task.name}': state: expected a State"):
            method(given)


def test_a_frame_may_be_given_by_its_name():
    np.testing.assert_array_equal(STATE.position("end_effector"), STATE.position(FRAME))
    np.testing.assert_array_equal(STATE.rotation("end_effector"), STATE.rotation(FRAME))
