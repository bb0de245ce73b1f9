import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError

INF = np.inf


def test_a_violation_is_the_distance_to_the_rows_interval():
    h = Hierarchy.from_levels([([[1, 0], [0, 1]], [3, 4]), ([[1, 0]], [-1], [1]),
                               ([[0, 1]], [2], [INF])])
    np.testing.assert_allclose(h.violations([0, 0]), [5, 0, 2])
    np.testing.assert_allclose(h.slacks([2, 0]), [-1, -4, 1, -2])


@pytest.mark.parametrize(("levels", "said"), [
    ([(np.eye(2), [1, np.nan])], "level 1, row 1: lower is nan"),
    ([(np.eye(2), [1, 2]), ([[np.nan, 0]], [1])], "level 2, row 0: A[0, 0] is nan"),
    ([([[INF, 0]], [1])], "A[0, 0] is inf"),
    ([(np.eye(2), [1, INF])], "level 1, row 1"),
    ([([[1, 0]], [INF], [INF])], "level 1, row 0"),
    ([(np.eye(2), [1])], "b has shape (1,), expected (2,)"),
    ([(np.eye(2), [1, 2]), (np.eye(3), [1, 2, 3])], "level 2: A has 3 columns"),
    ([(np.zeros((0, 0)), [])], "n = 0"),
    ([], "no levels"),
    ([(np.eye(2),)], "expected (A, b) or (A, lower, upper)"),
    ([("abc", [1])], "level 1: A is not an array of numbers")])
def test_bad_input_is_named(levels, said):
    with pytest.raises(HierarchyError) as error:
        Hierarchy.from_levels(levels)
    assert said in str(error.value)
