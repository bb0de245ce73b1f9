"""The distance to the reference in a metric: one answer by every resolver, and by closed forms."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make, names

STRICT = [make(name) for name in names() if make(name).strict]
INEQUALITIES = [r for r in STRICT if r.handles == "inequalities"]
BOUNDS = [r for r in STRICT if r.handles == "bounds"]
every = pytest.mark.parametrize("resolver", STRICT, ids=lambda r: r.label)


def metric(rng, n):
    """A metric whose eigenvalues are 0.01 to 100."""
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return (Q * np.geomspace(0.01, 100.0, n)) @ Q.T


def three_levels(rng, n=7, repeated=True):
    """Levels of which one repeats a row of the first, with another target."""
    A = [rng.normal(size=(m, n)) for m in (2, 2, 1)]
    if repeated:
        A[1][0] = A[0][1]
    return [(rows, rng.normal(size=len(rows))) for rows in A]


def closed_form(levels, reference, W):
    """Level by level with weighted pseudoinverses, by another route than a change of variables.

    x + N z with N a basis of the freedom left; the last step is the one of least z^T N^T W N z.
    """
    x, N = np.zeros(len(W)), np.eye(len(W))
    for A, b in levels:
        U, s, Vt = np.linalg.svd(A @ N)
        rank = int((s > 1e-10).sum())
        x = x + N @ (Vt[:rank].T @ ((U[:, :rank].T @ (b - A @ x)) / s[:rank]))
        N = N @ Vt[rank:].T
    return x + N @ np.linalg.solve(N.T @ W @ N, N.T @ W @ (reference - x))


@every
def test_the_answer_is_the_nearest_in_the_metric(resolver):
    rng = np.random.default_rng(1)
    for _ in range(5):
        levels, W, reference = three_levels(rng), metric(rng, 7), rng.normal(size=7)
        h = Hierarchy.from_levels(levels, reference, metric=W)
        res = resolver.solve(h)
        assert res.status is Status.SOLVED
        expected = closed_form(levels, reference, W)
        np.testing.assert_allclose(res.x, expected, atol=100.0 * resolver.accuracy)
        assert certify(h, res.x, 1e-6).certified
        without = Hierarchy.from_levels(levels, reference)
        np.testing.assert_allclose(h.violations(res.x), without.violations(expected), atol=1e-7)


@pytest.mark.parametrize("resolver", INEQUALITIES, ids=lambda r: r.label)
def test_inequalities_are_resolved_in_a_metric(resolver):
    rng = np.random.default_rng(4)
    for _ in range(5):
        W, reference, A = metric(rng, 6), rng.normal(size=6), rng.normal(size=(3, 6))
        box = np.eye(6), np.full(6, -0.3), np.full(6, 0.3)
        h = Hierarchy.from_levels([box, (A, rng.normal(size=3))], reference, metric=W)
        res, exact = resolver.solve(h), make("hcod").solve(h)
        assert res.status is Status.SOLVED
        assert certify(h, exact.x).certified
        np.testing.assert_allclose(res.x, exact.x, atol=1e-6)
        warm = resolver.solve(h, res.memory)
        np.testing.assert_allclose(warm.x, exact.x, atol=1e-6)


@pytest.mark.parametrize("resolver", BOUNDS, ids=lambda r: r.label)
def test_resolvers_of_bounds_take_them_with_a_diagonal_metric_alone(resolver):
    rng = np.random.default_rng(6)
    A, b = rng.normal(size=(2, 4)), np.array([0.5, -0.2])
    box = np.eye(4), np.full(4, -1.0), np.full(4, 1.0)
    diagonal = Hierarchy.from_levels([box, (A, b)], metric=np.diag([1.0, 4.0, 9.0, 2.0]))
    np.testing.assert_allclose(resolver.solve(diagonal).x, make("hcod").solve(diagonal).x,
                               atol=1e-8)
    dense = Hierarchy.from_levels([box, (A, b)], metric=metric(rng, 4))
    with pytest.raises(HierarchyError, match=r"level 1, row 0: an inequality.*a bound on one"):
        resolver.solve(dense)


@pytest.mark.parametrize("name", names())
def test_a_metric_that_loses_definiteness_is_a_numerical_failure(name):
    h = Hierarchy.from_levels([([[1.0, 0.3]], [1.0])], [1.0, 1.0], metric=np.eye(2))
    h.metric[1, 1] = -1.0
    res = make(name).solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert not res.x.any()
    assert not certify(h, [1.0, 0.0]).certified
