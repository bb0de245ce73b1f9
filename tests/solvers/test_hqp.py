"""The cascade of quadratic programs: inequalities at any level, through each backend."""

import sys

import numpy as np
import pytest
from rank_cases import family

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make
from solvers.qp import backends, programs

BACKENDS = [make("hqp", backend=name, form=form)
            for name in backends.BACKENDS for form in ("null-space", "slack")]


def assert_close(hqp, x, expected):
    expected = np.asarray(expected)
    assert np.abs(x - expected).max() <= hqp.accuracy * (1.0 + np.abs(expected).max())


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
    assert_close(make("hqp"), res.x, [2.0, 0.0])


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
