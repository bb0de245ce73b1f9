"""The Task Priority Matrix: exact as a staircase, and where the published form is not."""

import numpy as np
import oracle
import pytest
from rank_cases import CASES, build, random_levels

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make
from solvers.resolvers.tpm import FORMS, task_priority_matrix

every_case = pytest.mark.parametrize("case", CASES, ids=lambda c: c.__name__)
every_form = pytest.mark.parametrize("form", FORMS)
PUBLISHED = make("tpm-published")
STAIRCASE = make("tpm")


@every_case
@every_form
def test_f_and_the_contributions_give_the_answer(case, form):
    h = build(case, True)
    for damping in (0.0, 0.05):
        tpm = task_priority_matrix(h, form=form, damping=damping)
        x = make("tpm", form=form, damping=damping).solve(h).x
        assert tpm.contributions.shape == (len(h.sizes), h.n)
        close(tpm.contributions.sum(axis=0) + tpm.null_space_term, x)
        if h.m:
            J = pseudoinverse(h)
            close(J @ tpm.F, tpm.G)
            close(x, J @ (tpm.F @ h.lower - h.A @ h.reference) + h.reference)  # (14)


def pseudoinverse(h):
    """J^# with the rank decided on rows of unit norm, as the resolvers do."""
    size = np.linalg.norm(h.A, axis=1, keepdims=True)
    _, s, Vt = np.linalg.svd(h.A / np.where(size > 0, size, 1.0))
    V = Vt[:np.count_nonzero(s > 1e-9)].T
    return V @ np.linalg.pinv(h.A @ V)


def close(x, y, tolerance=1e-8):
    np.testing.assert_allclose(x, y, rtol=0, atol=tolerance * (1.0 + np.abs(y).max(initial=0.0)))


def test_the_matrix_of_an_inequality_is_refused():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0], [1.0])])
    with pytest.raises(HierarchyError, match="level 1, row 0: an inequality"):
        task_priority_matrix(h)


# -- the published form, as printed: not to be mended ---------------------------------------------

# A row dependent on those above takes a column of Q that nothing determines, and later levels need
# it; or absolute tolerances see another rank in rows of unequal scale.
# For each case, the number of levels down to the one that loses rank: these are still exact.
ARBITRARY = {"rank_lost_inside_the_first_level": 1, "middle_level_dependent_on_the_first": 2,
             "row_repeated_inside_a_level": 1, "unequal_scales": 1}
DETERMINED = [case for case in CASES if case.__name__ not in (*ARBITRARY, "no_levels")]


@pytest.mark.parametrize("case", DETERMINED, ids=lambda c: c.__name__)
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_the_published_form_is_what_its_equations_say(case, damping):
    h = build(case, True)
    x, F = oracle.published(h, damping=damping)
    close(make("tpm-published", damping=damping).solve(h).x, x)
    close(task_priority_matrix(h, form="published", damping=damping).F.T @ h.lower,
          F.T @ h.lower)


@pytest.mark.parametrize("case", [case for case in CASES if case.__name__ in ARBITRARY],
                         ids=lambda c: c.__name__)
def test_where_its_equations_leave_a_choice_it_is_exact_down_to_the_level_that_loses_rank(case):
    h, exact = build(case, True), ARBITRARY[case.__name__]
    res, right = PUBLISHED.solve(h), oracle.solve(h)
    assert res.status is Status.SOLVED
    close(h.violations(res.x)[:exact], h.violations(right)[:exact])
    assert np.abs(res.x - right).max() > 0.1


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("change", ["none", "last level dependent", "freedom left over"])
def test_the_published_form_is_exact_where_no_upper_level_loses_rank_or_freedom_is_left(
        seed, change):
    levels = random_levels(10 if change == "freedom left over" else 6, (3, 2, 3), seed)
    if change == "last level dependent":
        levels[2][0][0] = [1.0, -2.0, 0.5] @ levels[0][0]
    if change == "freedom left over":
        levels[1][0][0] = [1.0, -2.0, 0.5] @ levels[0][0]
    h = Hierarchy.from_levels(levels)
    close(PUBLISHED.solve(h).x, oracle.solve(h))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("n", "sizes", "level"), [
    (6, (3, 2, 3), 1), (7, (3, 3, 3, 3), 0), (5, (3, 3), 0)])
def test_the_published_form_departs_where_an_upper_level_loses_rank_that_is_needed_below(
        seed, n, sizes, level):
    """The case of the published algorithm's limits; the staircase has none of them."""
    levels = random_levels(n, sizes, seed)
    levels[level][0][1] = levels[0][0][0]  # dependent on the first level, or repeated inside it
    h = Hierarchy.from_levels(levels)
    exact = oracle.solve(h)
    close(STAIRCASE.solve(h).x, exact)
    assert np.abs(PUBLISHED.solve(h).x - exact).max() > 1e-6


# -- near the edge of a rank -----------------------------------------------------------------------

@pytest.mark.parametrize("resolver", [STAIRCASE, make("recursive")], ids=lambda r: r.label)
def test_the_rank_tolerance_decides_what_counts_as_parallel(resolver):
    A = np.array([[1.0, 0.0], [1.0, 1e-5]])
    h = Hierarchy.from_levels([(A[:1], [1.0]), (A[1:], [2.0])])
    blunt = make(resolver.name, rank_tolerance=1e-4)
    assert np.allclose(resolver.solve(h).x, [1.0, 1e5])
    assert np.allclose(blunt.solve(h).x, [1.0, 0.0])
