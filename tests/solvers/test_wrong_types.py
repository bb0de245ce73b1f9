"""Arguments of a wrong type: each is refused with what was given and expected."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State
from hierarchy.paths import Still
from hierarchy.tasks import CentreOfMass, JointLimits, Pointing, Pose, Position, Posture
from scenarios import compare, simulate
from solvers import Resolver, certify, explain, make
from solvers.batch import solve

A, B = np.eye(2), np.ones(2)
ROBOT = Robot.named("kuka_lwr")
FRAME, HERE = ROBOT.frame("end_effector"), Still([0.1, 0.5, 0.2])


def refused(call):
    with pytest.raises(HierarchyError) as error:
        call()
    return str(error.value)


@pytest.mark.parametrize(("call", "said"), [
    (lambda: Hierarchy.from_levels([(A + 1j, B)]),
     "level 1: A is not an array of real numbers: it is complex"),
    (lambda: Hierarchy.from_levels([([[1 + 1j, 0]], [1])]), "it is complex"),
    (lambda: Hierarchy.from_levels([(A, ["1", "2"])]),
     "level 1: b is not an array of numbers: list ['1', '2']"),
    (lambda: Hierarchy.from_levels([([[1, 2], [3]], B)]), "level 1: A is not an array of numbers"),
    (lambda: Hierarchy.from_levels("A"), "levels: expected a list of (A, b)"),
    (lambda: Hierarchy.from_levels([A]), "level 1: expected (A, b) or (A, lower, upper)"),
    (lambda: Hierarchy.from_levels([(A, B)], names="a"), "names: expected a list of texts"),
    (lambda: Hierarchy.from_levels([(A, B)], names=[1]), "names: expected a list of texts"),
    (lambda: Hierarchy.from_levels([(A, B)] * 2, names=["hand", "hand"]),
     "2 levels are named 'hand'"),
    (lambda: Hierarchy.from_levels([(A, B)]).violations("x"), "x is not an array of numbers: str"),
    (lambda: certify([(A, B)], B), "certify: h: expected a Hierarchy, got list"),
    (lambda: explain([(A, B)], None), "explain: h: expected a Hierarchy, got list"),
    (lambda: make("hcod").can_resolve(3), "unknown kind of rows 3"),
    (lambda: solve(3), "solve: batch: expected a Batch, got int 3"),
    (lambda: make(["hcod"]), "make: expected a str, got list"),
    (lambda: State.at("kuka_lwr", np.zeros(7)), "State.at: robot: expected a Robot, got str"),
    (lambda: State.at(ROBOT, ["a"] * 7), "robot 'kuka_lwr': q is not an array of numbers"),
    (lambda: Position("end_effector", HERE),
     "task 'position': frame is the name 'end_effector'; give robot.frame('end_effector')"),
    (lambda: Pose("end_effector", HERE, np.eye(3)), "give robot.frame('end_effector')"),
    (lambda: Pointing("end_effector", (0, 0, 1), 0.1), "give robot.frame('end_effector')"),
    (lambda: CentreOfMass("kuka_lwr", HERE), "give Robot.load('kuka_lwr')"),
    (lambda: JointLimits("kuka_lwr", 10.0, 0.01), "give Robot.load('kuka_lwr')"),
    (lambda: Position(FRAME, HERE, gain=-1.0), "task 'position': gain = -1.0, expected a number"),
    (lambda: Posture((0.0,) * 7, stiffness=-2.0), "task 'posture': stiffness = -2.0"),
    (lambda: Pointing(FRAME, (0, 0, 1), 0.1, damping=float("nan")), "damping = nan"),
    (lambda: Stack(["position"]), "a stack: expected a Task, got str 'position'"),
    (lambda: Stack(Position(FRAME, HERE)), "tasks of a stack: expected an Iterable"),
    (lambda: Stack([Position(FRAME, HERE)]).hierarchy(ROBOT),
     "Stack.hierarchy: state: expected a State, got Robot"),
    (lambda: simulate(7), "simulate: expected a Scenario, got int 7"),
    (lambda: simulate("elipse"), "unknown scenario 'elipse'; did you mean 'ellipse'?"),
    (lambda: compare([7]), "compare: expected a Scenario, got int 7"),
])
def test_a_wrong_type_is_answered_with_what_was_given_and_expected(call, said):
    assert said in refused(call)


def test_errors_inside_a_resolver_are_not_hidden():
    class Broken(Resolver):  # with a mistake of its own
        name = "broken"

        def solve(self, h, memory=None):
            return h.nonsense

    with pytest.raises(AttributeError, match="nonsense"):
        Broken().solve(Hierarchy.from_levels([(A, B)]))
