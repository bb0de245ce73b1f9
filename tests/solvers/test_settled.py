"""Levels that come to rest where they cannot be met: the minimum of |b - A x| + alpha |x|^2 / 2."""

import numpy as np
import pytest
from scipy.optimize import minimize

from hierarchy import Hierarchy
from solvers import make
from solvers.resolvers.settled import Settled

PERIOD = 0.1


def settled(*curved, inner="hcod", softness=1.0):
    return Settled(inner=make(inner), period=PERIOD, softness=softness, curved=frozenset(curved))


def nearly_singular(rng, smallest):
    U, V = (np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (3, 6))
    return U @ np.diag([1.0, 0.5, smallest]) @ V[:3]


@pytest.mark.parametrize("smallest", [0.3, 0.05, 1e-3, 1e-9, 0.0])
@pytest.mark.parametrize("box", [np.inf, 0.6])
def test_one_level_takes_the_minimum_that_scipy_finds(smallest, box):
    rng = np.random.default_rng(4)
    A, b = nearly_singular(rng, smallest), rng.normal(size=3)
    alpha = 0.5 * PERIOD * np.linalg.norm(A)
    h = Hierarchy.from_levels([(np.eye(6), np.full(6, -box), np.full(6, box)), (A, b)],
                              names=["limits", "hand"])
    x = settled("hand").solve(h).x

    def cost(x):
        return np.linalg.norm(b - A @ x) + alpha * x @ x / 2

    theirs = min((minimize(cost, start, bounds=[(-box, box)] * 6, options={"ftol": 1e-14})
                  for start in (x, np.zeros(6))), key=lambda one: one.fun)
    assert cost(x) <= theirs.fun + 1e-5
    assert (np.abs(x) <= box + 1e-9).all()


@pytest.mark.parametrize("inner", ["hcod", "tpm", "sns"])
def test_a_level_that_can_be_met_is_met_as_by_the_inner_resolver(inner):
    rng = np.random.default_rng(5)
    h = Hierarchy.from_levels([(np.eye(6), np.full(6, -9.0), np.full(6, 9.0)),
                               (nearly_singular(rng, 0.4), 0.1 * rng.normal(size=3)),
                               (np.eye(6), rng.normal(size=6))], names=["limits", "a", "b"])
    np.testing.assert_array_equal(settled("a", inner=inner).solve(h).x, make(inner).solve(h).x)


@pytest.mark.parametrize("inner", ["hcod", "tpm", "hqp"])
def test_levels_below_do_not_move_what_a_level_settled_on(inner):
    rng = np.random.default_rng(6)
    A, b = nearly_singular(rng, 1e-4), rng.normal(size=3)
    limits = np.eye(6), np.full(6, -9.0), np.full(6, 9.0)
    alone = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b)], names=["limits", "a"])).x
    both = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b), (np.eye(6), np.ones(6))], names=["limits", "a", "posture"])).x
    np.testing.assert_allclose(A @ both, A @ alone, atol=1e-5)
    assert np.linalg.norm(both - alone) > 1e-3


def test_rows_of_its_resolution_are_those_of_the_hierarchy():
    rng = np.random.default_rng(7)
    h = Hierarchy.from_levels([(np.eye(6), np.full(6, -0.2), np.full(6, 0.2)),
                               (nearly_singular(rng, 1e-6), rng.normal(size=3)),
                               (np.eye(6), np.ones(6))], names=["limits", "a", "posture"])
    found = settled("a").solve(h)
    assert found.active.shape == found.holds_back.shape == (h.m,)
    assert found.holds_back.max() <= 3
    at = np.flatnonzero(found.active[:6])
    np.testing.assert_allclose(np.abs(found.x[at]), 0.2, atol=1e-9)
