import numpy as np
import pytest
from rank_cases import family
from scipy.optimize import lsq_linear

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, explain, make
from solvers.problems import structured

INF = np.inf
HCOD = make("hcod")
INEQUALITIES = ["INEQ7", "HUM38"]


def two_joints(limit=1.0):
    """Limits on two joints, a hand that asks for too much of the first, a posture."""
    return Hierarchy.from_levels(
        [(np.eye(2), [-limit, -limit], [limit, limit]), ([[1.0, 0.5]], [3.0]),
         (np.eye(2), [0.0, 0.25])], names=["limits", "hand", "posture"])


def moved(h, rng, share=0.01):
    """The same rows with sides moved by a share of themselves."""
    factor = 1.0 + share * rng.uniform(-1, 1, h.m)
    return Hierarchy(h.A, h.lower * factor, h.upper * factor, h.sizes, h.reference, h.names)


def test_an_answer_found_by_hand():
    res = HCOD.solve(two_joints())
    np.testing.assert_allclose(res.x, [1, 1])
    assert res.status is Status.SOLVED
    assert res.active.tolist() == [1, 1, 2, 2, 2]
    assert res.holds_back[:2].tolist() == [1, 1]
    assert res.multipliers[:2] == pytest.approx([1.5, 0.75])


@pytest.mark.slow
@pytest.mark.parametrize("name", INEQUALITIES)
def test_the_answer_does_not_depend_on_the_memory(name):
    rng = np.random.default_rng(0)
    for h, _, _ in family(name):
        cold = HCOD.solve(h)
        for memory in (cold.memory, HCOD.solve(moved(h, rng)).memory, *nonsense(h, rng)):
            warm = HCOD.solve(h, memory)
            assert warm.status is Status.SOLVED
            np.testing.assert_allclose(warm.x, cold.x, atol=1e-8 * (1 + np.abs(cold.x).max()))


def nonsense(h, rng):
    """Memories of any content: rows at random sides, numbers of any size, no numbers."""
    sides = rng.integers(-1, 2, 3 * h.m + 3).astype(float)
    for last in ([1.0, 1.0, 1.0], [0.0, 0.0, -1.0], [1.0, 5.0, 1e300], [np.nan] * 3):
        yield np.concatenate([sides[:-3], last])
    yield np.full(3 * h.m + 3, np.nan)
    yield 1e200 * rng.normal(size=3 * h.m + 3)


@pytest.mark.parametrize("name", INEQUALITIES)
def test_its_own_memory_needs_one_iteration(name):
    for h, _, _ in list(family(name))[:20]:
        cold = HCOD.solve(h)
        warm = HCOD.solve(h, cold.memory)
        assert warm.iterations == 1
        np.testing.assert_allclose(warm.x, cold.x, atol=1e-9 * (1 + np.abs(cold.x).max()))


@pytest.mark.parametrize("name", ["EQ7", "EQ7over", "EQ7sing", "EQ30L8"])
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_equalities_alone_are_the_staircase_to_the_last_digit(name, damping):
    hcod, tpm = make("hcod", damping=damping), make("tpm", damping=damping)
    for h, _, _ in family(name):
        np.testing.assert_array_equal(hcod.solve(h).x, tpm.solve(h).x)


def test_cold_and_warm_know_the_same_rows_and_multipliers():
    for h, _, _ in family("INEQ7"):
        a, b = HCOD.solve(h, HCOD.solve(h).memory), HCOD.solve(h)
        np.testing.assert_array_equal(a.holds_back, b.holds_back)
        np.testing.assert_allclose(a.multipliers, b.multipliers, atol=1e-6)


def test_multipliers_balance_the_pull_of_the_level_they_hold_back():
    h = two_joints()
    res = HCOD.solve(h)
    pull = h.A[2] * (h.A[2] @ res.x - 3.0)
    np.testing.assert_allclose(pull + res.multipliers[:2] @ h.A[:2], 0, atol=1e-12)


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


def test_explain_names_equalities_and_rows_that_disagree():
    h = Hierarchy.from_levels(
        [([[1.0, 0.0]], [1.0]), ([[1.0, 0.0]], [2.0]), (np.zeros((0, 2)), []),
         ([[0.0, 1.0], [0.0, 1.0]], [0.0, 1.0])], names=["hand", "elbow", "none", "wrist"])
    assert explain(h, HCOD.solve(h)).splitlines() == [
        "hand is met.", "elbow is missed by 1: held back by hand.", "none has no rows.",
        "wrist is missed by 0.707: its own rows disagree."]


@pytest.mark.parametrize(("share", "blocking"), [
    (1e-8, "elbow"), (1e-4, "hand and elbow")])
def test_explain_leaves_out_a_level_that_carries_next_to_nothing(share, blocking):
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0]), ([[0.0, 1.0]], [0.0]),
                               ([[share, 1.0]], [1.0])], names=["hand", "elbow", "wrist"])
    assert explain(h, HCOD.solve(h)).splitlines()[2] == (
        f"wrist is missed by 1: held back by {blocking}.")


def test_explain_names_the_rows_that_are_missed_by_most_and_not_those_missed_by_a_little():
    h = Hierarchy.from_levels([(np.eye(3), [-1.0] * 3, [1.0] * 3),
                               (np.eye(3), [2.0, 1.5, 1.05], [np.inf] * 3)],
                              names=["limits", "wish"])
    said = explain(h, HCOD.solve(h), rows=["a", "b", "c"] * 2).splitlines()[1]
    assert said.startswith("wish is missed by 1.12, at a and b: held back by limits a at")


def test_explain_needs_to_know_the_active_set():
    h = Hierarchy.from_levels([([[1.0]], [1.0])])
    with pytest.raises(HierarchyError, match="hcod"):
        explain(h, make("tpm").solve(h))


# Levels, the reference, and x, found by hand.
BY_HAND = {
    "rows without sides": ([([[1.0, 0.0]], [-INF], [INF]), ([[0.0, 0.0]], [-1.0], [1.0]),
                            ([[1.0, 1.0]], [2.0], [INF])], [0.5, 0.0], [1.25, 0.75]),
    "a zero row that cannot be met": (
        [(np.zeros((1, 2)), [1.0], [2.0]), ([[1.0, 1.0]], [4.0])], None, [2.0, 2.0]),
    "sides that exclude each other": (
        [([[1.0], [1.0]], [1.0, -INF], [INF, -1.0])], None, [0.0]),
    "a reference out of reach": ([([[1.0, 0.0]], [-1.0], [1.0])], [5.0, 7.0], [1.0, 7.0]),
    "every number met is zero": (
        [([[2.0], [1.0], [1.0]], [0.0, 1.0, -1.0]), ([[1.0]], [-9.0], [9.0])], None, [0.0])}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("case", BY_HAND)
def test_small_hierarchies_have_the_answer_found_by_hand(case):
    levels, reference, x = BY_HAND[case]
    h = Hierarchy.from_levels(levels, reference)
    res = HCOD.solve(h)
    assert res.status is Status.SOLVED
    np.testing.assert_allclose(res.x, x, atol=1e-12)
    assert certify(h, res.x).certified


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_answer_scales_with_the_data(scale):
    for h, x, _ in list(family("INEQ7"))[:20]:
        scaled = Hierarchy(h.A, h.lower * scale, h.upper * scale, h.sizes, h.reference, h.names)
        np.testing.assert_allclose(HCOD.solve(scaled).x, x * scale, rtol=1e-7,
                                   atol=1e-8 * scale * np.abs(x).max())


@pytest.mark.parametrize(("settings", "said"), [
    ({"guesses": 1}, "unknown setting"), ({"max_iterations": 1.5}, "max_iterations = 1.5"),
    ({"max_iterations": 0}, "max_iterations"), ({"tolerance": 0.0}, "tolerance"),
    ({"tolerence": 1e-9}, "did you mean 'tolerance'"), ({"_settings": 1}, "unknown setting"),
])
def test_bad_settings_are_named(settings, said):
    with pytest.raises(HierarchyError, match=said):
        make("hcod", **settings)


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


def test_a_direction_in_which_no_joint_moves_a_frame_is_called_singular():
    J = np.array([[0.0, 0.0], [0.6, 0.3], [0.8, 0.4]])  # of a straight arm; rows x, y, z
    h = Hierarchy.from_levels([(J, [-0.5, 0.6, 0.8])], names=["hand"])
    said = explain(h, HCOD.solve(h), rows=["x", "y", "z"])
    assert said == ("hand is missed by 0.5: singular here: no joint moves hand along x.")
    h = Hierarchy.from_levels([([[1.0, 0.0], [1.0, 0.0]], [0.0, 1.0])], names=["two"])
    assert "its own rows disagree" in explain(h, HCOD.solve(h), rows=["a", "b"])


def test_rows_whose_sides_cross_are_all_that_is_said():
    h = Hierarchy.from_levels([(np.eye(2), [0.0, 0.0], [1.0, 1.0])], names=["box"])
    h.lower[1] = 2.0
    res = HCOD.solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert explain(h, res) == "box row 1: no value lies between lower 2 and upper 1"
