"""The cascade of quadratic programs: inequalities at any level, through each backend."""

import dataclasses
import os

import numpy as np
import pytest
from rank_cases import family, generic

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make

BACKENDS = [make("hqp", backend=name) for name in ("proxqp", "osqp")]
PROBLEMS = 10 if os.environ.get("NUMBA_DISABLE_JIT") == "1" else 50

every_backend = pytest.mark.parametrize("hqp", BACKENDS, ids=lambda r: r.backend)


def assert_close(hqp, x, expected):
    expected = np.asarray(expected)
    assert np.abs(x - expected).max() <= hqp.accuracy * (1.0 + np.abs(expected).max())


@every_backend
def test_an_arm_with_limits_gets_the_certified_answer(hqp):
    for h, x, norms in list(family("INEQ7"))[:PROBLEMS]:
        res = hqp.solve(h)
        assert res.status is Status.SOLVED
        assert_close(hqp, res.x, x)
        assert_close(hqp, h.violations(res.x), norms)


@every_backend
def test_a_humanoid_gets_the_certified_answer_or_is_told_that_it_did_not(hqp):
    """A failed program ends the cascade, and the levels above it keep what they have."""
    for h, _, norms in list(family("HUM38"))[:12]:
        res = hqp.solve(h)
        if res.status is Status.SOLVED:
            assert_close(hqp, h.violations(res.x), norms)
        assert h.violations(res.x)[0] <= norms[0] + 1e-6


@every_backend
def test_an_inequality_above_is_not_given_up_for_an_equality_below(hqp):
    h = Hierarchy.from_levels([(np.eye(2), [-1.0, -1.0], [1.0, 1.0]), ([[1.0, 1.0]], [5.0])])
    res = hqp.solve(h)
    assert_close(hqp, res.x, [1.0, 1.0])
    assert_close(hqp, h.violations(res.x), [0.0, 3.0])


@every_backend
def test_an_inequality_below_takes_what_an_equality_above_leaves(hqp):
    h = Hierarchy.from_levels([([[1.0, 0.0]], [2.0]), (np.eye(2), [-1.0, 3.0], [1.0, 4.0])])
    assert_close(hqp, hqp.solve(h).x, [2.0, 3.0])


@every_backend
def test_inequalities_that_cannot_all_hold_share_the_violation_and_then_stay_put(hqp):
    h = Hierarchy.from_levels([([[1.0, 0.0], [1.0, 0.0]], [-np.inf, 1.0], [0.0, np.inf]),
                               ([[1.0, 1.0]], [9.0])])
    assert_close(hqp, hqp.solve(h).x, [0.5, 8.5])


@every_backend
def test_an_equality_between_inequalities_is_met_inside_them(hqp):
    h = Hierarchy.from_levels([([[1.0, 0.0, 0.0]], [-1.0], [1.0]), ([[1.0, 1.0, 0.0]], [3.0]),
                               ([[0.0, 1.0, 0.0]], [-np.inf], [1.5]), ([[0.0, 0.0, 1.0]], [2.0])])
    x = hqp.solve(h).x
    assert_close(hqp, h.violations(x), [0.0, 0.0, 0.5, 0.0])
    assert_close(hqp, x, [1.0, 2.0, 2.0])


@every_backend
def test_a_lower_level_changes_no_violation_above_it(hqp):
    for h, _, _ in list(family("INEQ7"))[:5]:
        full = h.violations(hqp.solve(h).x)
        for count in range(1, len(h.sizes)):
            upper = Hierarchy.from_levels(list(h.levels())[:count])
            assert_close(hqp, full[:count], upper.violations(hqp.solve(upper).x))


@every_backend
def test_the_answer_is_the_one_nearest_to_the_reference(hqp):
    limits = (np.eye(3), [-1.0] * 3, [1.0] * 3)
    h = Hierarchy.from_levels([limits, ([[1.0, 1.0, 0.0]], [0.5])], reference=[3.0, 0.0, -5.0])
    assert_close(hqp, hqp.solve(h).x, [1.0, -0.5, -1.0])


@every_backend
def test_a_row_with_no_side_asks_for_nothing(hqp):
    h = Hierarchy.from_levels([([[1.0, 0.0]], [-np.inf], [np.inf]), ([[0.0, 1.0]], [2.0])])
    assert_close(hqp, hqp.solve(h).x, [0.0, 2.0])


@every_backend
def test_equalities_alone_need_no_program(hqp):
    assert hqp.solve(Hierarchy.from_levels(generic())).iterations == 0
    satisfied = [(np.eye(7), [-1.0] * 7, [1.0] * 7)]
    assert hqp.solve(Hierarchy.from_levels(satisfied)).iterations <= 1


@every_backend
def test_damping_bounds_the_step_of_a_level_among_inequalities(hqp):
    rows = [[1.0, 0.0, 0.0], [1.0, 1e-6, 0.0]]
    h = Hierarchy.from_levels([([[0.0, 0.0, 1.0]], [0.0], [1.0]), (rows, [0.0, 1.0])])
    damped = dataclasses.replace(hqp, damping=0.05)
    assert np.abs(damped.solve(h).x).max() < 10.0


def test_a_backend_that_is_not_installed_is_named():
    with pytest.raises(HierarchyError, match=r"backend 'gurobi' is not installed; .*osqp"):
        make("hqp", backend="gurobi")


def test_a_failing_backend_leaves_the_levels_that_were_finished(monkeypatch):
    monkeypatch.setattr("solvers.hqp._call", lambda *_: (np.full(9, 0.1), False))
    monkeypatch.setattr("solvers.hqp.refined", lambda *_: None)
    h = Hierarchy.from_levels([([[1.0, 0.0]], [2.0]), (np.eye(2), [-1.0, 3.0], [1.0, 4.0])])
    res = make("hqp").solve(h)
    assert res.status is Status.BACKEND_FAILURE
    assert_close(make("hqp"), res.x, [2.0, 0.0])


def test_a_backend_that_raises_is_a_status_and_no_exception(monkeypatch):
    import qpsolvers

    def broken(*_, **__):
        raise RuntimeError("out of luck")

    monkeypatch.setattr(qpsolvers, "solve_problem", broken)
    h = Hierarchy.from_levels([(np.eye(2), [1.0, 3.0], [2.0, 4.0])])
    res = make("hqp").solve(h)
    assert np.isfinite(res.x).all()
    assert res.status in (Status.SOLVED, Status.BACKEND_FAILURE)


def test_qpsolvers_is_not_asked_for_a_bad_setting():
    with pytest.raises(HierarchyError, match="hqp: slack = -1"):
        make("hqp", slack=-1.0)
