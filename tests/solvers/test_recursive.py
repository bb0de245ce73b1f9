"""The recursion, reverse priority and saturation, each against its paper in a few lines."""

import os
from itertools import pairwise

import numpy as np
import pytest
from rank_cases import CASES, boxed, build, gap, random_levels, rng
from refusals import refused

from hierarchy import Hierarchy
from solvers import Status, certify, make
from solvers.problems import bounded, structured

LARGEST = 0.7


def nakamura(B, e, lam0, w0):
    """(J^T J + lambda^2 I)^-1 J^T e, lambda^2 = lambda0^2 (1 - w / w0)^2 (Nakamura, Hanafusa)."""
    w = np.sqrt(max(np.linalg.det(B @ B.T), 0.0))
    lam = lam0 * (1.0 - w / w0) if w < w0 else 0.0
    return B.T @ np.linalg.solve(B @ B.T + lam**2 * np.eye(len(B)), e)


def chiaverini(B, e, lam_max, epsilon, beta=0.0):
    """J^T (J J^T + beta^2 I + lambda^2 u_m u_m^T)^-1 e, as in Chiaverini (1997)."""
    U, s, _ = np.linalg.svd(B)
    lam2 = (1.0 - (s[-1] / epsilon) ** 2) * lam_max**2 if s[-1] < epsilon else 0.0
    u = U[:, len(B) - 1]
    return B.T @ np.linalg.solve(B @ B.T + beta**2 * np.eye(len(B)) + lam2 * np.outer(u, u), e)


def clamp(v, largest):
    return v if abs(v).max() <= largest else v * (largest / abs(v).max())


def selective(B, e, gamma_max):
    """Buss and Kim (2005), section 4, with the rows as one end effector."""
    U, s, Vt = np.linalg.svd(B, full_matrices=False)
    rho, total = np.linalg.norm(B, axis=0), np.zeros(B.shape[1])
    for k, sigma in enumerate(s):
        M = (abs(Vt[k]) * rho).sum() / sigma
        gamma = min(1.0, np.linalg.norm(U[:, k]) / M) * gamma_max
        total += clamp(U[:, k] @ e / sigma * Vt[k], gamma)
    return clamp(total, gamma_max)


METHODS = {
    "nakamura": (lambda B, e: nakamura(B, e, 0.2, 3.0), {"damping": 0.2, "threshold": 3.0}),
    "chiaverini": (lambda B, e: chiaverini(B, e, 0.2, 0.6, 0.05),
                   {"damping": 0.2, "threshold": 0.6, "isotropic": 0.05}),
    "selective": (lambda B, e: selective(B, e, LARGEST), {"largest": LARGEST})}


def recursion(h, inverse):
    """Equations (5), (6) and (14), the projector undamped."""
    x, P = np.zeros(h.n), np.eye(h.n)
    for A, b, _ in h.levels():
        B = A @ P
        x = x + inverse(B, b - A @ x)
        P = P - np.linalg.pinv(B) @ B
    return x + P @ h.reference


@pytest.mark.parametrize("method", METHODS)
def test_each_method_is_what_its_paper_says(method):
    """Of tasks whose first level has a small singular value."""
    inverse, settings = METHODS[method]
    resolver, undamped, changed = make("recursive", method=method, **settings), make("tpm"), 0
    for seed in range(60):
        r = rng(seed)
        levels = [(r.normal(size=(m, 7)), r.normal(size=m)) for m in (3, 2)]
        levels[0][0][-1] = levels[0][0][0] + r.choice([0.02, 0.2]) * r.normal(size=7)
        h = Hierarchy.from_levels(levels, r.normal(size=7))
        x = resolver.solve(h).x
        assert gap(x, recursion(h, inverse)) <= 1e-9
        changed += np.abs(x - undamped.solve(h).x).max() > 1e-2
    assert changed > 30


# Reverse priority.
def by_pseudoinverses(h):
    """The recursion as printed, every pseudoinverse by numpy's SVD; no rows of unequal scale."""
    x = np.zeros(h.n)
    for first, last in reversed(list(pairwise(h.offsets))):
        J, reverse_augmented = h.A[first:last], h.A[first:]
        T = np.linalg.pinv(reverse_augmented, rcond=1e-9)[:, :last - first]
        x = x + T @ np.linalg.pinv(J @ T, rcond=1e-9) @ (h.lower[first:last] - J @ x)
    P = np.eye(h.n) - np.linalg.pinv(h.A, rcond=1e-9) @ h.A
    return x + P @ h.reference


@pytest.mark.parametrize("case", [c for c in CASES if c != "unequal_scales"])
def test_it_is_the_published_recursion_at_every_rank(case):
    h = build(case, True)
    assert gap(make("reverse").solve(h).x, by_pseudoinverses(h) if h.m else h.reference) < 1e-9


@pytest.mark.parametrize("resolver", [make("recursive"), make("reverse", form="in-order")])
@pytest.mark.parametrize(("scale", "status"), [(1, Status.SOLVED), (1e4, Status.INACCURATE)])
def test_heavy_rows_that_contradict_each_other_may_round_off_a_light_one(resolver, scale, status):
    """x was off by 5, SOLVED."""
    A = np.array([[0.3, 0.7, 0.2], [0.33, 0.77, 0.22], [0.9, 2.1, 0.6], [0.5, -0.1, 0.3]])
    by = np.array([scale, scale, scale, 1.0 / scale])
    h = Hierarchy.from_levels([(A * by[:, None], [1.0, -1.0, 1.0, 1.0] * by)])
    found = resolver.solve(h)
    assert found.status is status
    assert (gap(found.x, make("hcod").solve(h).x) < 1e-9) == (status is Status.SOLVED)


BASIC, OPTIMAL = make("sns"), make("sns", form="optimal")
JIT = os.environ.get("NUMBA_DISABLE_JIT") != "1"


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
    for seed in range(100 if JIT else 8):
        levels = random_levels(7, (2, 2, 1), seed)
        low, up = -np.random.default_rng(seed).uniform(0.1, 1.5, (2, 7)) * [[1.0], [-1.0]]
        res = BASIC.solve(boxed(Hierarchy.from_levels(levels), low, up))
        printed = as_printed(levels, low, up)
        if printed is not None:
            np.testing.assert_allclose(res.x, printed[0], atol=1e-9)
            np.testing.assert_allclose(res.scaling[1:], printed[1], atol=1e-9)
            judged += any(0.0 < s < 1.0 for s in printed[1])
    assert judged > 15 or not JIT


@pytest.mark.parametrize("resolver", [BASIC, OPTIMAL], ids=lambda r: r.label)
@pytest.mark.parametrize("unit", [2.0**-10, 2.0**-27, 2.0**-40])
def test_small_units_change_no_answer(resolver, unit):
    """Bounds of 1e-8 were kept up to 1e-12: x was off by up to a fifth of them, and SOLVED."""
    for seed in range(40 if JIT else 4):
        h = boxed(Hierarchy.from_levels(random_levels(5, (1, 2), seed)), -0.5, 0.5)
        small = Hierarchy(h.A, unit * h.lower, unit * h.upper, h.sizes)
        np.testing.assert_allclose(resolver.solve(small).x / unit, resolver.solve(h).x, atol=1e-9)


def test_the_optimal_form_ends_nearest_to_the_reference():
    """hcod, with what the levels have reached as targets, is the judge."""
    for case in CASES:
        h = boxed(build(case, True), -0.5, 0.7)
        x, first = OPTIMAL.solve(h).x, h.sizes[0]
        A = h.A[first:]
        assert certify(h, x, 1e-3).stationarity[0] < 1e-9, "the bounds are kept"
        judge = make("hcod").solve(Hierarchy.from_levels(
            [(h.A[:first], h.lower[:first], h.upper[:first]), (A, A @ x)], h.reference))
        if judge.status is Status.SOLVED:
            distance = np.linalg.norm(judge.x - h.reference)
            assert np.linalg.norm(x - h.reference) <= distance + 1e-8 * (1.0 + distance)


@pytest.mark.parametrize("resolver", [BASIC, OPTIMAL], ids=lambda r: r.label)
def test_an_unknown_in_no_row_goes_to_the_reference_beside_rows_of_any_norm(resolver):
    """Joints that the tasks hold but for rounding stopped the way there in a third of these."""
    for seed in (3, 7, 21, 22, 26, 40, 44, 53):
        h = bounded(structured(seed, ("scaled",), True), seed)
        wide = Hierarchy(np.hstack([np.zeros((h.m, 1)), h.A]), h.lower, h.upper, h.sizes,
                         [1.0, *h.reference])
        assert resolver.solve(wide).x[0] == pytest.approx(1.0, abs=1e-7)


def test_where_no_bound_acts_x_is_that_of_the_recursion_also_in_a_box_without_zero():
    """The basic form added the reference to the x that it starts from: 1.5 instead of 1."""
    h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0])], [1.0, 1.0])
    for resolver in (BASIC, OPTIMAL):
        np.testing.assert_allclose(resolver.solve(boxed(h, 0.5, 2.0)).x, [1.0, 1.0], atol=1e-12)


def test_a_level_without_any_scaling_adds_nothing_and_scaling_what_is_missed_helps():
    """Level 1 already moves joint 1 by -1, and 0.5 is all that the box leaves level 2."""
    h = Hierarchy.from_levels([([[1.0, 0.0]], [-1.0]), ([[1.0, 1.0]], [1.0])])
    h = boxed(h, [-2.0, -0.5], [2.0, 0.5])
    target, miss = BASIC.solve(h), make("sns", scales="miss").solve(h)
    np.testing.assert_allclose(target.x, [-1.0, 0.0])
    np.testing.assert_allclose(miss.x, [-1.0, 0.5])
    np.testing.assert_allclose([target.scaling[2], miss.scaling[2]], [0.0, 0.25])


def test_bounds_that_exclude_each_other_are_named():
    h = Hierarchy.from_levels([(np.empty((0, 2)), []),
                               ([[1, 0], [0, 1], [2, 0]], [-1, -1, 4], [1, 1, 6])],
                              names=["nothing", "limits"])
    refused("limits, row 2: 4 <= 2 x[0] <= 6 leaves nothing", BASIC.solve, h)
    touching = Hierarchy.from_levels([([[3.0], [1.0]], [-1, 0.1], [0.3, 1])])
    assert BASIC.solve(touching).x == pytest.approx(0.1)


@pytest.mark.parametrize("scale", [1e-90, 1e90])
def test_singular_directions_do_not_hang_on_the_unit_of_rows(scale):
    """Squares of cosines overflowed: no rows were rotated, and x was 0.04 off."""
    r = np.random.default_rng(3)
    A, b = r.normal(size=(3, 5)), r.normal(size=3)
    one, other = (make("recursive", method="selective", largest=0.3).solve(
        Hierarchy.from_levels([(by * A, by * b)])).x for by in (1.0, scale))
    np.testing.assert_allclose(other, one, rtol=1e-12)
