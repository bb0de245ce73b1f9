import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError

INF = np.inf


def test_a_violation_is_the_distance_to_the_rows_interval():
    h = Hierarchy.from_levels([([[1, 0], [0, 1]], [3, 4]), ([[1, 0]], [-1], [1]),
                               ([[0, 1]], [2], [INF])])
    np.testing.assert_allclose(h.violations([0, 0]), [5, 0, 2])
    np.testing.assert_allclose(h.slacks([2, 0]), [-1, -4, 1, -2])


def test_a_copy_keeps_everything_in_arrays_of_its_own():
    h = Hierarchy.from_levels([([[1, 0]], [3]), ([[0, 1]], [4])], reference=[5, 6],
                              names=["a", "b"], metric=2 * np.eye(2), give=[0.5, 0])
    kept = h.copy()
    for array in (h.A, h.lower, h.upper, h.reference, h.metric, h.give):
        array[:] = 7
    np.testing.assert_array_equal(kept.A, np.eye(2))
    np.testing.assert_array_equal([kept.lower, kept.upper], [[3, 4], [3, 4]])
    np.testing.assert_array_equal(kept.sizes, [1, 1])
    np.testing.assert_array_equal(kept.reference, [5, 6])
    np.testing.assert_array_equal(kept.metric, 2 * np.eye(2))
    np.testing.assert_array_equal(kept.give, [0.5, 0])
    assert kept.names == ("a", "b")


@pytest.mark.parametrize(("levels", "reference", "said"), [
    ([(np.eye(2), [1, np.nan])], None, "level 1, row 1: lower is nan"),
    ([(np.eye(2), [1, 2]), ([[np.nan, 0]], [1])], None, "level 2, row 0: A[0, 0] is nan"),
    ([([[INF, 0]], [1])], None, "A[0, 0] is inf"),
    ([(np.eye(2), [1, INF])], None, "level 1, row 1"),
    ([([[1, 0]], [2], [1])], None, "lower 2.0 and upper 1.0"),
    ([([[1, 0]], [INF], [INF])], None, "level 1, row 0"),
    ([([[1, 0]], [0], [np.nan])], None, "row 0: upper is nan"),
    ([(np.eye(2), [1])], None, "b has shape (1,), expected (2,)"),
    ([([1, 0], [1])], None, "A has shape (2,)"),
    ([(np.eye(2), [1, 2]), (np.eye(3), [1, 2, 3])], None, "level 2: A has 3 columns"),
    ([(np.eye(2), [1, 2])], [1, 2, 3], "reference has shape (3,)"),
    ([(np.eye(2), [1, 2])], [1, INF], "reference, entry 1: inf"),
    ([(np.zeros((0, 0)), [])], None, "n = 0"),
    ([], None, "no levels"),
    ([(np.eye(2),)], None, "expected (A, b) or (A, lower, upper)"),
    ([("abc", [1])], None, "level 1: A is not an array of numbers"),
])
def test_bad_input_is_named(levels, reference, said):
    with pytest.raises(HierarchyError) as error:
        Hierarchy.from_levels(levels, reference)
    assert said in str(error.value)


def test_names_of_levels_appear_in_messages():
    with pytest.raises(HierarchyError, match="elbow, row 0"):
        Hierarchy.from_levels([([[np.nan]], [1])], names=["elbow"])
    with pytest.raises(HierarchyError, match="2 names for 1 levels"):
        Hierarchy.from_levels([([[1]], [1])], names=["a", "b"])
