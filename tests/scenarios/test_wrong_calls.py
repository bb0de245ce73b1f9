"""Wrong arguments to what `scenarios` and `solvers` offer: each with what it says."""

import re

import pytest

from hierarchy import Hierarchy, HierarchyError, Robot
from hierarchy.paths import Still
from hierarchy.tasks import Position
from scenarios import compare, load, save, simulate
from solvers import certify, explain, make, solve_ik

SHORT = load("ellipse", ["control.duration=0.01"])
ROBOT = Robot.load("kuka_lwr")
HAND = Position(ROBOT.frame("end_effector"), Still([0.3, 0.5, 0.1]))
Q = [0.9, -0.85, 0.9, 1.2, 0.97, 1.8, 0.0]
H = Hierarchy.from_levels([([[1.0, 0.0]], [-0.1], [0.1]), ([[1.0, 0.5]], [0.3])])


@pytest.mark.parametrize(("call", "said"), [
    (lambda: load(""), "load: expected a path, got str ''"),
    (lambda: load("ellipse", "control.period=1"), "expected a list of \"key=value\", got str"),
    (lambda: SHORT.with_changes(3), "changes: expected a Mapping, got int 3"),
    (lambda: simulate(SHORT, progress=3), "simulate: progress: expected a function, got int 3"),
    (lambda: simulate("elipse"), "unknown scenario 'elipse'; did you mean 'ellipse'?"),
    (lambda: simulate(None), "simulate: expected a Scenario, got NoneType None"),
    (lambda: compare(3), "compare: expected names, files, or what `load` returns, got int 3"),
    (lambda: compare("ellipse", "hcod"), "resolvers: expected a list of names, got str 'hcod'"),
    (lambda: compare(SHORT, ["tpm"], out=3), "compare: out: expected a path, got int 3"),
    (lambda: save("ellipse", "x"), "save: expected a Recording, got str 'ellipse'"),
    (lambda: solve_ik(ROBOT, Q, [HAND], limits="yes"), "limits: expected True, False or a task"),
    (lambda: certify([], [0.0, 0.0]), "certify: h: expected a Hierarchy, got list"),
    (lambda: certify(H, [0.0, 0.0], tolerance=-1.0), "certify: tolerance"),
    (lambda: explain(H, make("weighted").solve(H)), "hcod"),
    (lambda: explain(H, make("hcod").solve(H), rows="ab"), "rows: expected a list of names"),
    (lambda: Hierarchy.from_levels([([[10**400]], [1.0])]), "level 1"),
])
def test_a_wrong_argument_is_refused_and_named(call, said):
    with pytest.raises(HierarchyError, match=re.escape(said)):
        call()


def test_one_scenario_is_compared_like_a_list_of_one():
    assert [run.spec for run in compare(SHORT, ["tpm"]).runs] == ["tpm"]
