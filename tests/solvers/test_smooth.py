"""Smooth activation against the equations of Simetti and Casalino (2016), written out."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from hierarchy.activation import activation
from solvers import Status, make

LAMBDA, THRESHOLD, ETA = 1e-4, 1e-2, 10.0
SMOOTH = make("smooth")
INF = np.inf


def pseudoinverse(X, A, Q):
    """X^(#,A,Q) of the paper, with the singular values and vectors of the matrix inverted."""
    n = len(Q)
    M = X.T @ A @ X + ETA * (np.eye(n) - Q).T @ (np.eye(n) - Q)
    _, s, V = np.linalg.svd(M)
    P = np.diag([LAMBDA * (1 + np.cos(np.pi * one / THRESHOLD)) / 2 if one < THRESHOLD else 0.0
                 for one in s])
    return np.linalg.pinv(M + V.T @ P @ V) @ X.T @ A @ A


def by_the_paper(levels, n):
    """The recursion of the paper over (J, activations, rates) with all rows, and the identity."""
    rho, Q, one = np.zeros(n), np.eye(n), np.eye(n)
    for J, a, rate in [*levels, (one, np.ones(n), np.zeros(n))]:
        A, X = np.diag(a), J @ Q
        W = X @ pseudoinverse(X, A, Q)
        T = one - Q @ pseudoinverse(X, A, one) @ W @ J
        rho, Q = (T @ rho + Q @ pseudoinverse(X, A, one) @ W @ rate,
                  Q @ (one - pseudoinverse(X, A, one) @ X))
    return rho


def problem(rng, n, sizes, choices):
    """Random rows of unit size, with activations of which some are exactly 0 or 1."""
    levels = [(rng.normal(size=(m, n)), rng.normal(size=m)) for m in sizes]
    acts = [np.where(rng.random(m) < 0.5, rng.choice(choices, m), rng.random(m)) for m in sizes]
    return levels, acts


def solved(levels, acts, resolver=SMOOTH):
    return resolver.solve_activated(Hierarchy.from_levels(levels), np.concatenate(acts))


def test_the_answer_is_that_of_the_paper_with_all_its_matrices():
    rng = np.random.default_rng(3)
    for _ in range(60):
        levels, acts = problem(rng, 7, rng.integers(1, 5, 3), [0.0, 1.0])
        want = by_the_paper([(J, a, rate) for (J, rate), a in zip(levels, acts, strict=True)], 7)
        found = solved(levels, acts)
        assert found.status is Status.SOLVED
        np.testing.assert_allclose(found.x, want, atol=1e-7 * (1 + np.abs(want).max()))


def test_near_a_singularity_it_is_regularised_as_in_the_paper():
    rng = np.random.default_rng(4)
    for scale in (1e-1, 1e-2, 1e-3, 0.0):
        row = rng.normal(size=(1, 4))
        J = np.vstack([row, row + scale * rng.normal(size=(1, 4))])
        levels, acts = [(J, rng.normal(size=2)), (rng.normal(size=(1, 4)), [1.0])], [[1, 0.7], [1]]
        want = by_the_paper([(*levels[0][:1], np.array(acts[0]), levels[0][1]),
                             (levels[1][0], np.ones(1), np.ones(1))], 4)
        np.testing.assert_allclose(solved(levels, list(map(np.array, acts))).x, want,
                                   atol=1e-6 * (1 + np.abs(want).max()))
        assert np.abs(want).max() < 1e4


def test_the_activation_is_one_at_the_bound_zero_beyond_the_buffer_and_has_no_kink():
    error = np.array([-0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.9])  # to the far end of a buffer of 0.4
    found = activation(error, 0.4)
    np.testing.assert_allclose(found[[0, 1, 3, 5, 6]], [0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-15)
    assert (np.diff(found) >= 0.0).all()
    step = 1e-5
    slopes = np.diff(activation(np.array([-step, 0.0, step, 0.4 - step, 0.4, 0.4 + step]), 0.4))
    np.testing.assert_allclose(slopes[[0, 1, 3, 4]] / step, 0.0, atol=1e-3)


def test_what_has_no_answer_is_refused_or_has_a_status():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0], [INF])], names=["walls"])
    with pytest.raises(HierarchyError, match=r"walls, row 0: an inequality.*activation"):
        SMOOTH.solve(h)
    with pytest.raises(HierarchyError, match=r"walls, row 0: activation 1\.5 is outside 0 \.\. 1"):
        SMOOTH.solve_activated(h, np.array([1.5]))
    below = Hierarchy.from_levels([(np.eye(2), np.zeros(2)), (np.eye(2), np.zeros(2))],
                                  names=["walls", "tip"])
    with pytest.raises(HierarchyError, match=r"tip, row 1: activation -1\.0 is outside 0 \.\. 1"):
        SMOOTH.solve_activated(below, np.array([1.0, 0.5, 0.0, -1.0]))
    with pytest.raises(HierarchyError, match=r"shape \(2,\), expected \(1,\)"):
        SMOOTH.solve_activated(h, np.ones(2))
    with pytest.raises(HierarchyError, match="eta = 0"):
        make("smooth", eta=0.0)
    rows = Hierarchy.from_levels([([[1.0, 0.0]], [0.0])])
    for spoilt, array, value in ((h, h.lower, np.nan), (rows, rows.A, np.nan),
                                 (rows, rows.A, np.inf)):
        array[0] = value
        found = SMOOTH.solve_activated(spoilt, np.ones(1))
        assert found.status is Status.NUMERICAL_FAILURE
        assert (found.x == 0.0).all()
