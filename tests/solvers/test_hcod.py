import numpy as np
import pytest
from rank_cases import family
from scipy.optimize import lsq_linear

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, explain, make
from solvers.problems import structured

INF = np.inf
HCOD = make("hcod")


def two_joints(limit=1.0):
    """Limits on two joints, a hand that asks for too much of the first, a posture."""
    return Hierarchy.from_levels(
        [(np.eye(2), [-limit, -limit], [limit, limit]), ([[1.0, 0.5]], [3.0]),
         (np.eye(2), [0.0, 0.25])], names=["limits", "hand", "posture"])


def test_an_answer_found_by_hand():
    res = HCOD.solve(two_joints())
    np.testing.assert_allclose(res.x, [1, 1])
    assert res.status is Status.SOLVED
    assert res.active.tolist() == [1, 1, 2, 2, 2]
    assert res.holds_back[:2].tolist() == [1, 1]
    assert res.multipliers[:2] == pytest.approx([1.5, 0.75])


@pytest.mark.parametrize("name", ["EQ7", "EQ7over", "EQ7sing", "EQ30L8"])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_equalities_alone_are_the_staircase_to_the_last_digit(name, damping):
    hcod, tpm = make("hcod", damping=damping), make("tpm", damping=damping)
    for h, _, _ in family(name):
        np.testing.assert_array_equal(hcod.solve(h).x, tpm.solve(h).x)


@pytest.mark.slow
@pytest.mark.parametrize("limit", [1, 3, 6, 11])
def test_an_iteration_limit_keeps_the_levels_above_and_says_where_it_was(limit):
    resolver = make("hcod", max_iterations=limit)
    for h, _, norms in list(family("HUM38"))[:10]:
        res = resolver.solve(h)
        assert np.isfinite(res.x).all()
        assert res.iterations <= limit
        if res.status is Status.SOLVED:
            assert res.unfinished is None
            continue
        assert res.status is Status.ITERATION_LIMIT
        k = res.unfinished
        np.testing.assert_allclose(h.violations(res.x)[:k], norms[:k], atol=1e-8)
        assert h.names[k] in explain(h, res)


def test_explain_says_in_words_what_blocks_what():
    h = two_joints()
    text = explain(h, HCOD.solve(h)).splitlines()
    assert text[0] == "limits is met."
    assert text[1] == ("hand is missed by 1.5: held back by limits row 0 at its upper side and "
                       "row 1 at its upper side.")
    assert text[2].startswith("posture is missed by 1.25: held back by")


X, Y = ([[1.0, 0.0]], [0.0]), ([[0.0, 1.0]], [0.0])
STRAIGHT = np.array([[0.0, 0.0], [0.6, 0.3], [0.8, 0.4]])  # rows x, y, z of a straight arm
EXPLAINED = {
    "equalities, and rows that disagree": (
        [([[1.0, 0.0]], [1.0]), ([[1.0, 0.0]], [2.0]), (np.zeros((0, 2)), []),
         ([[0.0, 1.0], [0.0, 1.0]], [0.0, 1.0])],
        ["level 1 is met.", "level 2 is missed by 1: held back by level 1.",
         "level 3 has no rows.", "level 4 is missed by 0.707: its own rows disagree."]),
    "a level that carries next to nothing is left out": (
        [X, Y, ([[1e-8, 1.0]], [1.0])],
        [..., ..., "level 3 is missed by 1: held back by level 2."]),
    "a level that carries a little": (
        [X, Y, ([[1e-4, 1.0]], [1.0])],
        [..., ..., "level 3 is missed by 1: held back by level 1 and level 2."]),
    "no joint moves it: singular": (
        [(STRAIGHT, [-0.5, 0.6, 0.8])],
        ["level 1 is missed by 0.5: singular here: no joint moves level 1 along row 0."])}


@pytest.mark.parametrize("case", EXPLAINED)
def test_explain_says_what_holds_a_level_back(case):
    levels, said = EXPLAINED[case]
    h = Hierarchy.from_levels(levels)
    lines = explain(h, HCOD.solve(h)).splitlines()
    assert lines == [line if words is ... else words
                     for line, words in zip(lines, said, strict=True)]


def test_explain_names_the_rows_that_are_missed_by_most_and_not_those_missed_by_a_little():
    h = Hierarchy.from_levels([(np.eye(3), [-1.0] * 3, [1.0] * 3),
                               (np.eye(3), [2.0, 1.5, 1.05], [INF] * 3)], names=["limits", "wish"])
    said = explain(h, HCOD.solve(h), rows=["a", "b", "c"] * 2).splitlines()[1]
    assert said.startswith("wish is missed by 1.12, at a and b: held back by limits a at")


def test_explain_needs_to_know_the_active_set():
    h = Hierarchy.from_levels([([[1.0]], [1.0])])
    with pytest.raises(HierarchyError, match="hcod"):
        explain(h, make("tpm").solve(h))


# Levels, the reference, and x, found by hand.
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_answer_scales_with_the_data(scale):
    for h, x, _ in list(family("INEQ7"))[:20]:
        scaled = Hierarchy(h.A, h.lower * scale, h.upper * scale, h.sizes, h.reference, h.names)
        np.testing.assert_allclose(HCOD.solve(scaled).x, x * scale, rtol=1e-7,
                                   atol=1e-8 * scale * np.abs(x).max())


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("damping", [0.01, 0.3])
def test_a_damped_level_inside_bounds_is_a_bounded_least_squares_problem(seed, damping):
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(6, 4)), 3.0 * rng.normal(size=6)  # dependent rows: lambda = damping
    centre, width = rng.normal(size=4), rng.uniform(0.1, 1.0, 4)
    low, up = centre - width, centre + width
    h = Hierarchy.from_levels([(np.eye(4), low, up), (A, b)])
    res = make("hcod", damping=damping).solve(h)
    expected = lsq_linear(np.vstack([A, damping * np.eye(4)]), np.append(b, np.zeros(4)),
                          (low, up), method="bvls", tol=1e-15).x
    assert res.status is Status.SOLVED
    np.testing.assert_allclose(res.x, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_rows_as_small_as_rounding_make_no_answer_large(seed):
    h = structured(seed, ("tiny_rows",))
    res = make("hcod").solve(h)
    assert np.abs(res.x).max() < 1e6  # such a row alone in its level would ask for 1e14
    if res.status is Status.SOLVED:
        assert certify(h, res.x).certified


def test_a_level_that_is_rounding_beside_others_counts_where_limits_hold_x():
    """Recorded in an example of pink: a vertical motion of an arm that moves in a plane."""
    limits, lifted = (np.eye(2), [-2.0] * 2, [2.0] * 2), ([[2.56e-18, 1.8e-18]], [-700.0])
    h = Hierarchy.from_levels([limits, lifted])
    res = HCOD.solve(h)
    assert res.status is Status.SOLVED
    np.testing.assert_array_equal(res.x, [-2.0, -2.0])
    assert res.verified(h)
    free = HCOD.solve(Hierarchy.from_levels([([[1.0, 0.0]], [0.5]), lifted]))
    assert free.status is Status.INACCURATE
    np.testing.assert_array_equal(free.x, [0.5, 0.0])


def test_rows_whose_sides_cross_are_all_that_is_said():
    h = Hierarchy.from_levels([(np.eye(2), [0.0, 0.0], [1.0, 1.0])], names=["box"])
    h.lower[1] = 2.0
    res = HCOD.solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert explain(h, res) == "box row 1: no value lies between lower 2 and upper 1"
