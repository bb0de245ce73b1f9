"""Priorities as weights, and the cascade of quadratic programs."""

import sys

import numpy as np
import pytest
from rank_cases import CASES, boxed, build, family

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make, problems
from solvers.qp import backends, programs
from solvers.resolvers.weighted import lexicographic_weights

EXACT = 1e-9


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("ratio", [1.0, 10.0, 1e3])
def test_within_limits_it_is_the_minimiser_and_shown_to_be(case, ratio):
    """Of a hierarchy of two levels: constraints, then everything weighted."""
    h, weighted = boxed(build(case, True), -0.7, 0.7), make("weighted", ratio=ratio)
    res, n, mu = weighted.solve(h), h.n, weighted.regularisation
    assert res.status is Status.SOLVED
    w = np.repeat(ratio ** np.arange(len(h.sizes) - 1, -1, -1.0), h.sizes)[n:]
    soft = (np.vstack([h.A[n:] * w[:, None], mu * np.eye(n)]),
            np.concatenate([h.lower[n:] * w, mu * h.reference]))
    two = Hierarchy.from_levels([(h.A[:n], h.lower[:n], h.upper[:n]), soft], h.reference)
    assert certify(two, res.x).optimal


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_row_released_by_rounding_alone_is_not_released_for_ever(seed):
    res = make("weighted", ratio=1e8, guesses=1, max_iterations=200).solve(
        problems.family("DEGEN7", seed))
    assert res.status is not Status.ITERATION_LIMIT
    assert res.iterations < 50


def test_lexicographic_weights_are_the_smallest_that_do():
    assert lexicographic_weights([5.0, 3.0, 4.0], 0.1) == pytest.approx((
        np.hypot(4.0, 40.0 * 3.0) / 0.1, 40.0, 1.0))
    assert lexicographic_weights([0.0, 0.0], 0.1) == (1.0, 1.0)
    assert lexicographic_weights([0.0, 0.0], 0.1, regularised=1.0) == (10.0, 1.0)


def test_only_levels_of_inequalities_are_constraints_and_as_many_as_asked_for():
    box, wish = (np.eye(2), [-1.0] * 2, [1.0] * 2), ([[1.0, 1.0]], [9.0])
    narrow = ([[1.0, 0.0]], [-0.5], [0.5])
    h = Hierarchy.from_levels([box, narrow, wish])
    violations = {hard: h.violations(make("weighted", ratio=3.0, hard_levels=hard).solve(h).x)
                  for hard in (0, 1, 2)}
    assert (violations[0][:2] > 0.01).all()
    assert violations[1][0] == pytest.approx(0.0, abs=EXACT)
    assert violations[1][1] > 0.01
    assert violations[2][:2] == pytest.approx([0.0, 0.0], abs=EXACT)


@pytest.mark.parametrize("backend", ["own", "proxqp"])
def test_constraints_that_exclude_each_other_give_what_violates_them_least(backend):
    h = Hierarchy.from_levels([([[1.0, 0.0], [1.0, 0.0]], [-np.inf, 1.0], [0.0, np.inf]),
                               ([[1.0, 1.0]], [9.0])])
    res = make("weighted", backend=backend).solve(h)
    assert res.status is Status.INACCURATE
    assert res.x[0] == pytest.approx(0.5)


def test_rows_that_are_nearly_parallel_are_said_to_leave_a_doubt():
    def nearly(angle):
        return Hierarchy.from_levels([(np.eye(2), [-1.0] * 2, [1.0] * 2), ([[1.0, 0.0]], [0.5]),
                                      ([[1.0, angle]], [0.5 + 0.1 * angle])])

    assert make("weighted").solve(nearly(1e-8)).status is Status.INACCURATE
    for angle in (0.0, 1e-15, 1e-6, 1.0):
        assert make("weighted").solve(nearly(angle)).status is Status.SOLVED


def test_weights_for_another_number_of_levels_are_refused():
    with pytest.raises(HierarchyError, match="2 weights for 3 levels"):
        make("weighted", weights=(2.0, 1.0)).solve(build("generic", True))


@pytest.mark.parametrize("name", backends.BACKENDS)
def test_a_backend_that_is_not_installed_names_what_brings_it(name, monkeypatch):
    backends.installed.cache_clear()
    monkeypatch.setitem(sys.modules, backends.BACKENDS[name].module, None)
    extra = "scenarios" if name in ("proxqp", "osqp") else "qp"
    with pytest.raises(HierarchyError, match=rf"'{name}' is not .*hierarchy\[{extra}\]$"):
        make("hqp", backend=name)
    backends.installed.cache_clear()


LIMITS_BELOW = Hierarchy.from_levels([([[1.0, 0.0]], [2.0]), (np.eye(2), [-1.0, 3.0], [1.0, 4.0])])


@pytest.mark.parametrize(("vouched", "status"), [(False, Status.BACKEND_FAILURE),
                                                 (True, Status.INACCURATE)])
def test_an_answer_that_cannot_be_shown_right_leaves_the_levels_above(vouched, status, monkeypatch):
    monkeypatch.setattr(programs.Program, "solve", lambda *_: (np.full(9, 0.1), vouched))
    monkeypatch.setattr("solvers.resolvers.hqp.refined", lambda *_: None)
    res = make("hqp").solve(LIMITS_BELOW)
    assert res.status is status
    np.testing.assert_allclose(res.x, [2.0, 0.0], rtol=0.0, atol=3.0 * make("hqp").accuracy)


@pytest.mark.parametrize("name", ["hqp", "weighted"])
def test_a_backend_that_raises_is_a_status_and_the_level_of_limits_is_kept(name, monkeypatch):
    monkeypatch.setattr("qpsolvers.solve_problem", lambda *_, **__: 1 / 0)
    h = next(iter(family("HUM38")))[0]
    res = make(name, backend="proxqp").solve(h)
    assert res.status is Status.BACKEND_FAILURE
    assert np.isfinite(res.x).all()
    assert h.violations(res.x)[0] < 1e-8


@pytest.mark.parametrize("rows", [
    ([[0, 0, 1e3], [0, 0, 1e-3], [2.7067129e-4, 8.9151391e-4, 3.6323543e-4]],
     [-np.inf, -1e-3, 0.0], [1e3, -1e-3, 1e-3]),
    ([[669.71, -52.95, -740.73], [-6.1103e-4, 5.5851e-4, 5.6098e-4], [405.35, 359.46, -840.52]],
     [-2000.0, 0.0, -2000.0], [-2000.0, 1e-3, -2000.0])])
def test_a_row_a_million_times_smaller_than_its_neighbours_is_met_as_they_are(rows):
    h = Hierarchy.from_levels([rows, (np.eye(3), np.zeros(3))])
    found = make("hqp").solve(h)
    assert found.status is Status.SOLVED
    np.testing.assert_allclose(h.slacks(found.x)[:3] / np.linalg.norm(h.A[:3], axis=1), 0.0,
                               atol=1e-9)
    assert certify(h, found.x).certified
