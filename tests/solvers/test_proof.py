"""Proofs in 120 digits: against rational arithmetic, stored answers, and wrong candidates."""

import numpy as np
import pytest
from exact import exact

from hierarchy import Hierarchy
from hierarchy.errors import HierarchyError
from scenarios.problems.reference import FAMILIES, family
from solvers import make, problems
from solvers.proof import prove


@pytest.mark.parametrize("seed", range(6))
def test_the_answer_of_equalities_is_that_of_rational_arithmetic(seed):
    h = problems.structured(seed, ("integers",), equalities_only=True)
    found = prove(h, [make("hcod").solve(h).x])
    assert found.complete
    assert found.shift == found.turn == 0.0
    np.testing.assert_allclose(found.x, exact(h), rtol=2e-16, atol=1e-300)


@pytest.mark.parametrize("name", [
    name for name in FAMILIES if name not in ("HUM38", "DEGEN7", "DYN60", "EQ30L8")])
def test_stored_answers_lead_to_proofs_that_agree_with_them(name):
    for one in family(name)[:2]:
        found = prove(one.h, [one.x])
        assert found.complete
        assert found.turn < 1e-15
        np.testing.assert_allclose(found.x, one.x, atol=1e-9)
        np.testing.assert_allclose(found.least, one.norms, atol=1e-9)


def test_a_wrong_candidate_proves_nothing():
    h = Hierarchy.from_levels([(np.eye(2), [-1.0, -1.0], [1.0, 1.0]), ([[1.0, 1.0]], [3.0])])
    wrong = prove(h, [[1.0, 0.0]])
    assert not wrong.complete
    assert wrong.proved == 1  # the box is kept, the sum could be larger
    assert np.isnan(wrong.x).all()
    right = prove(h, [[1.0, 0.0], [1.0, 1.0]])
    assert right.complete
    np.testing.assert_array_equal(right.x, [1.0, 1.0])
    np.testing.assert_array_equal(right.least, [0.0, 1.0])


def test_optimal_but_not_nearest_to_the_reference_is_not_the_answer():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0])], reference=[0.0, 2.0])
    assert not prove(h, [[1.0, np.nan], [7.0, 7.0], "ab"[:0] or [1.0]]).turn
    found = prove(h, [[1.0, 0.0]])  # says only that the row is an equality
    np.testing.assert_array_equal(found.x, [1.0, 2.0])


def test_rows_at_a_tiny_angle_make_the_levels_below_ill_posed():
    h = Hierarchy.from_levels([([[1.0, 0.0], [1.0, 1e-9]], [1.0, 1.0]), ([[0.0, 1.0]], [5.0])])
    found = prove(h, [[1.0, 5.0]])
    assert (found.posed, found.proved, found.judged) == (1, 3, 1)
    assert 1e-10 < found.turn < 1e-8
    clear = Hierarchy.from_levels([([[1.0, 0.0], [1.0, 1e-3]], [1.0, 1.0]), ([[0.0, 1.0]], [5.0])])
    found = prove(clear, [[1.0, 0.0]])
    assert (found.posed, found.complete, found.turn) == (3, True, 0.0)
    np.testing.assert_array_equal(found.least, [0.0, 5.0])


def test_a_metric_is_refused():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0])], metric=np.diag([1.0, 2.0]))
    with pytest.raises(HierarchyError, match="metric"):
        prove(h, [[1.0, 0.0]])
