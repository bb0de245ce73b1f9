"""Saturation in the null space: the box is kept, what is scaled is said, priorities hold."""

import os

import numpy as np
import pytest
import rank_cases
from rank_cases import CASES, build, random_levels

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make

BASIC, OPTIMAL = make("sns"), make("sns", form="optimal")
JIT = os.environ.get("NUMBA_DISABLE_JIT") != "1"
MANY = 100 if JIT else 8


def boxed(low, up, *levels, reference=None):
    return Hierarchy.from_levels([(np.eye(len(low)), low, up), *levels], reference)


def as_printed(levels, low, up):
    """The algorithm of the paper with its projectors and pseudo-inverses; full rank, zero inside.

    Returns x and the scalings, or None where the paper leaves open which joint is critical.
    """
    n, x, P, scalings = len(low), np.zeros(len(low)), np.eye(len(low)), []
    for J, b in levels:
        W, way, best, s_best = np.eye(n), np.zeros(n), x, -1.0
        while True:
            saturated = np.linalg.pinv((np.eye(n) - W) @ P, rcond=1e-9)
            inverse_of = J @ ((np.eye(n) - saturated) @ P)
            if np.linalg.matrix_rank(inverse_of, tol=1e-9) < len(J):
                break
            inverse, start = np.linalg.pinv(inverse_of), x + saturated @ way
            a, c = inverse @ b, start - inverse @ J @ start
            free = np.diag(W) > 0.0
            s_up, s_low = (up + 1e-11 - c)[free] / a[free], (low - 1e-11 - c)[free] / a[free]
            s_max, s_min = np.maximum(s_up, s_low), np.minimum(s_up, s_low)
            critical = np.flatnonzero(free)[np.argmin(s_max)]
            if s_min.max() <= min(s_max.min(), 1.0) and s_max.min() >= 0.0:
                s = min(s_max.min(), 1.0)
                if s > s_best:
                    s_best, best = s, s * a + c
                if s == 1.0:
                    break
            if s_max.min() >= 1.0:
                return None
            side = up if a[critical] + c[critical] > up[critical] else low
            W[critical, critical], way[critical] = 0.0, side[critical] - x[critical]
        x = best
        scalings.append(max(s_best, 0.0))
        P = P - np.linalg.pinv(J @ P, rcond=1e-9) @ J @ P
    return x, scalings


def test_the_basic_form_is_the_algorithm_as_printed():
    judged = 0
    for seed in range(MANY):
        levels = random_levels(7, (2, 2, 1), seed)
        low, up = -np.random.default_rng(seed).uniform(0.1, 1.5, (2, 7)) * [[1.0], [-1.0]]
        res, printed = BASIC.solve(boxed(low, up, *levels)), as_printed(levels, low, up)
        if printed is not None:
            np.testing.assert_allclose(res.x, printed[0], atol=1e-9)
            np.testing.assert_allclose(res.scaling[1:], printed[1], atol=1e-9)
            judged += any(0.0 < s < 1.0 for s in printed[1])
    assert judged > 15 or not JIT


def test_the_optimal_form_ends_nearest_to_the_reference():
    """hcod, with what the levels have reached as targets, is the judge."""
    for case in CASES:
        h = rank_cases.boxed(build(case, True), -0.5, 0.7)
        x, first = OPTIMAL.solve(h).x, h.sizes[0]
        A = h.A[first:]
        assert certify(h, x, 1e-3).stationarity[0] < 1e-9, "the bounds are kept"
        judge = make("hcod").solve(Hierarchy.from_levels(
            [(h.A[:first], h.lower[:first], h.upper[:first]), (A, A @ x)], h.reference))
        if judge.status is Status.SOLVED:
            distance = np.linalg.norm(judge.x - h.reference)
            assert np.linalg.norm(x - h.reference) <= distance + 1e-8 * (1.0 + distance)


def test_a_level_without_any_scaling_adds_nothing_and_scaling_what_is_missed_helps():
    """Level 1 already moves joint 1 by -1, and 0.5 is all that the box leaves level 2."""
    h = boxed([-2.0, -0.5], [2.0, 0.5], ([[1.0, 0.0]], [-1.0]), ([[1.0, 1.0]], [1.0]))
    target, miss = BASIC.solve(h), make("sns", scales="miss").solve(h)
    np.testing.assert_allclose(target.x, [-1.0, 0.0])
    np.testing.assert_allclose(miss.x, [-1.0, 0.5])
    np.testing.assert_allclose([target.scaling[2], miss.scaling[2]], [0.0, 0.25])


def test_bounds_that_exclude_each_other_are_named():
    h = Hierarchy.from_levels([([[1, 0], [0, 1], [2, 0]], [-1, -1, 4], [1, 1, 6])],
                              names=["limits"])
    with pytest.raises(HierarchyError, match=r"limits, row 2: 4 <= 2 x\[0\] <= 6 leaves nothing"):
        BASIC.solve(h)
    touching = Hierarchy.from_levels([([[3.0], [1.0]], [-1, 0.1], [0.3, 1])])
    assert BASIC.solve(touching).x == pytest.approx(0.1)
