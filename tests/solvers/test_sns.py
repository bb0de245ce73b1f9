"""Saturation in the null space: the box is kept, what is scaled is said, priorities hold."""

import os

import numpy as np
import pytest
from rank_cases import random_levels

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make

FORMS = [make("sns", form=form, scales=scales)
         for form in ("basic", "optimal") for scales in ("target", "miss")]
BASIC, OPTIMAL = make("sns"), make("sns", form="optimal")
JIT = os.environ.get("NUMBA_DISABLE_JIT") != "1"
MANY, FEW = (100, 30) if JIT else (8, 4)

every_form = pytest.mark.parametrize("resolver", FORMS, ids=lambda r: r.label.replace(" ", "-"))


def boxed(low, up, *levels, reference=None):
    return Hierarchy.from_levels([(np.eye(len(low)), low, up), *levels], reference)


def problems(count, seed, levels=None):
    """Yield (h, low, up): boxes of every kind above rows of every rank."""
    r = np.random.default_rng(seed)
    for _ in range(count):
        n, rows, tasks = int(r.integers(1, 9)), [], []
        for _ in range(levels or r.integers(1, 5)):
            A = r.normal(size=(r.integers(0, 5), n))
            for a in A:
                kind = r.integers(0, 9)
                if kind == 0 and rows:
                    a[:] = r.normal(size=len(rows)) @ np.array(rows)
                elif kind == 1 and rows:
                    a[:] = rows[-1] + 1e-3 * r.normal(size=n)
                elif kind == 2:
                    a[:] = 0.0
                elif kind == 3:
                    a[:] = np.eye(n)[r.integers(n)]
                rows.append(a)
            tasks.append((A, r.normal(size=len(A)) * r.choice([0.0, 0.3, 1.0, 5.0])))
        middle = r.normal(size=n) * r.choice([0.0, 0.5])  # zero may lie outside
        low, up = middle - r.uniform(0.05, 2.0, n), middle + r.uniform(0.05, 2.0, n)
        low[r.random(n) < 0.1], up[r.random(n) < 0.1] = -np.inf, np.inf
        if n > 1 and r.random() < 0.3:
            low[0] = up[0] = middle[0]
        scale = r.choice([1.0, -2.0, 0.5], size=n)
        sides = np.sort([scale * low, scale * up], axis=0)
        h = Hierarchy.from_levels([(np.diag(scale), *sides), *tasks],
                                  r.normal(size=n) * r.choice([0.0, 1.0, 5.0]))
        yield h, low, up


@pytest.mark.slow
@every_form
def test_bounds_are_kept_always(resolver):
    for h, low, up in problems(MANY, 1):
        res = resolver.solve(h)
        assert res.status is Status.SOLVED
        assert (np.clip(res.x, low, up) == res.x).all()


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


@pytest.mark.slow
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
    for h, _, _ in problems(FEW, 4):
        x, first = OPTIMAL.solve(h).x, h.sizes[0]
        A = h.A[first:]
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
