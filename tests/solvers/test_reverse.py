"""Reverse priority: what it promises, and where it is the strict answer and where it is not."""

from itertools import pairwise

import numpy as np
import oracle
import pytest
from rank_cases import CASES, build, gap

from hierarchy import Hierarchy
from solvers import make

REVERSE, IN_ORDER, STRICT = make("reverse"), make("reverse", form="in-order"), make("tpm")
every_case = pytest.mark.parametrize("case", CASES, ids=lambda c: c.__name__)
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


@pytest.mark.parametrize("case", [c for c in CASES if c.__name__ != "unequal_scales"],
                         ids=lambda c: c.__name__)
def test_it_is_the_published_recursion_at_every_rank(case):
    h = build(case, True)
    expected = by_pseudoinverses(h) if h.m else h.reference
    assert gap(REVERSE.solve(h).x, expected) < EXACT


@every_case
@pytest.mark.parametrize("reference", [False, True], ids=["no_reference", "reference"])
def test_in_order_is_strict_at_every_rank(case, reference):
    h = build(case, reference)
    assert gap(IN_ORDER.solve(h).x, oracle.solve(h)) < EXACT


def test_the_published_form_departs_in_just_these_rank_cases():
    """Three or more levels, one above the last two in conflict with those below it."""
    built = {case.__name__: build(case, True) for case in CASES}
    departing = {name for name, h in built.items()
                 if gap(REVERSE.solve(h).x, oracle.solve(h)) > EXACT}
    assert departing == {"more_rows_than_joints", "middle_level_dependent_on_the_first",
                         "last_level_wholly_dependent", "row_repeated_inside_a_level"}


def test_damping_bounds_the_answer_where_a_level_hardly_clears_those_below():
    """An algorithmic singularity: both levels are well-conditioned, together they are not."""
    h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0]), ([[1.0, 1e-7]], [0.0])])
    assert np.abs(REVERSE.solve(h).x).max() > 1e6
    assert np.abs(make("reverse", damping=0.05).solve(h).x).max() < 10.0
