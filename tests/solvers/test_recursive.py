"""The recursion: one answer with the staircase, dampings against a few lines of numpy."""

from itertools import pairwise

import numpy as np
import pytest
from rank_cases import CASES, build, gap, rng

from hierarchy import Hierarchy
from solvers import make

METHODS = ("nakamura", "chiaverini", "selective")
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
    return B.T @ np.linalg.solve(
        B @ B.T + beta**2 * np.eye(len(B)) + lam2 * np.outer(u, u), e)


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


INVERSES = {
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


def nearly_singular(seed, sizes=(3, 2), n=7):
    """Tasks whose first level has a small singular value."""
    r = rng(seed)
    levels = [(r.normal(size=(m, n)), r.normal(size=m)) for m in sizes]
    levels[0][0][-1] = levels[0][0][0] + r.choice([0.02, 0.2]) * r.normal(size=n)
    return Hierarchy.from_levels(levels, r.normal(size=n))


@pytest.mark.parametrize("method", METHODS)
def test_each_method_is_what_its_paper_says(method):
    inverse, settings = INVERSES[method]
    resolver, undamped, changed = make("recursive", method=method, **settings), make("tpm"), 0
    for seed in range(60):
        h = nearly_singular(seed)
        x, expected = resolver.solve(h).x, recursion(h, inverse)
        assert np.abs(x - expected).max() <= 1e-9 * (1.0 + np.abs(expected).max())
        changed += np.abs(x - undamped.solve(h).x).max() > 1e-2
    assert changed > 30


@pytest.mark.parametrize("case", CASES)
def test_switched_off_each_method_is_the_recursion_at_every_rank(case):
    h = build(case, True)
    expected = make("recursive").solve(h).x
    for method in METHODS:
        x = make("recursive", method=method).solve(h).x
        assert np.abs(x - expected).max() <= 1e-9 * (1.0 + np.abs(expected).max())


# Reverse priority.


REVERSE, IN_ORDER, STRICT = make("reverse"), make("reverse", form="in-order"), make("tpm")
EXACT = 1e-9


def by_pseudoinverses(h, tolerance=1e-9):
    """The recursion as printed, every pseudoinverse by numpy's SVD; no rows of unequal scale."""
    x = np.zeros(h.n)
    for first, last in reversed(list(pairwise(h.offsets))):
        J, reverse_augmented = h.A[first:last], h.A[first:]
        T = np.linalg.pinv(reverse_augmented, rcond=tolerance)[:, :last - first]
        x = x + T @ np.linalg.pinv(J @ T, rcond=tolerance) @ (h.lower[first:last] - J @ x)
    P = np.eye(h.n) - np.linalg.pinv(h.A, rcond=tolerance) @ h.A
    return x + P @ h.reference


@pytest.mark.parametrize("case", [c for c in CASES if c != "unequal_scales"])
def test_it_is_the_published_recursion_at_every_rank(case):
    h = build(case, True)
    expected = by_pseudoinverses(h) if h.m else h.reference
    assert gap(REVERSE.solve(h).x, expected) < EXACT
