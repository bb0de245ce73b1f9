"""`tpm` with limits: bounds always kept, and everything else as well as they allow."""

import os

import numpy as np
import pytest
from rank_cases import CASES, boxed, build, rng
from scipy.optimize import lsq_linear

from hierarchy import Hierarchy
from solvers import Status, certify, make
from solvers.problems import Recipe, generate

SLOW = os.environ.get("NUMBA_DISABLE_JIT") == "1"
PROBLEMS = 5 if SLOW else 200
TPM = make("tpm")
KEPT = 1e-12  # of a bound, relative to 1 + |bound|
TAME = Recipe(equalities_only=True, joints=(1, 20), levels=(1, 5), rows=(0, 10), near_parallel=0.0,
              scales=(1.0, 1.0), spread=1.0)
WILD = Recipe(equalities_only=True, joints=(1, 20), levels=(1, 5), rows=(0, 10))

every_case = pytest.mark.parametrize("case", CASES, ids=lambda c: c.__name__)


def limited(seed, recipe=TAME):
    """A generated hierarchy behind bounds of all kinds, some of which pass through its answer."""
    h, r = generate(seed, recipe), rng(seed + 10**6)
    x = TPM.solve(h).x
    size = np.median(np.abs(x)) + 1e-3
    rows, lower, upper = [], [], []
    for joint in r.permutation(np.repeat(np.arange(h.n), r.integers(0, 3, h.n))):
        middle = r.choice([0.0, x[joint], 0.5 * x[joint], size * r.normal()])
        half = size * r.choice([0.0, 0.3, 1.0, 3.0]) * r.exponential()
        sides = np.array([middle - half, middle + half])
        sides[r.integers(2)] = r.choice([sides[0], sides[1], x[joint], np.inf * r.choice([-1, 1])])
        scale = r.choice([1.0, 1.0, -1.0, 2.0, -0.01, 100.0])
        low, high = np.sort(scale * sides)
        if low == high and np.isinf(low):
            low, high = -np.inf, np.inf
        rows.append(scale * np.eye(h.n)[joint])
        lower.append(-np.inf if low == np.inf else low)
        upper.append(np.inf if high == -np.inf else high)
    rows.append(np.eye(h.n)[0])  # one that is an inequality for certain
    bounds = (np.array(rows), [*lower, -9.0 * size], [*upper, 9.0 * size])
    return Hierarchy.from_levels([bounds, *((A, b) for A, b, _ in h.levels())], h.reference)


def assert_kept(h, x):
    """No bound that another does not exclude is passed by more than rounding."""
    A, lower, upper = next(iter(h.levels()))
    joint, scale = np.abs(A).argmax(axis=1), A.sum(axis=1)
    sides = np.sort([lower / scale, upper / scale], axis=0)
    low, high = np.full(h.n, -np.inf), np.full(h.n, np.inf)
    np.maximum.at(low, joint, sides[0])
    np.minimum.at(high, joint, sides[1])
    low, high = np.minimum(low, high), np.maximum(low, high)
    with np.errstate(invalid="ignore"):
        assert not (x < low - KEPT * (1.0 + np.abs(low))).any()
        assert not (x > high + KEPT * (1.0 + np.abs(high))).any()


@pytest.mark.slow
@pytest.mark.parametrize("recipe", [TAME, WILD], ids=["tame", "wild"])
def test_bounds_are_kept_and_the_answer_is_certified(recipe):
    doubtful = 0
    for seed in range(PROBLEMS):
        h = limited(seed, recipe)
        res = TPM.solve(h)
        assert_kept(h, res.x)
        assert res.status is not Status.SOLVED or certify(h, res.x, 1e-7).certified
        doubtful += res.status is not Status.SOLVED
    assert doubtful <= (0 if recipe is TAME else PROBLEMS // 50)


@every_case
def test_bounds_that_are_out_of_the_way_change_no_digit(case):
    h = build(case, True)
    x = TPM.solve(h).x
    res = TPM.solve(boxed(h, x - 1e-3, x + 1e-3))
    assert np.array_equal(res.x, x)
    assert not res.saturated.any()
    assert res.iterations == 1


@pytest.mark.parametrize("seed", range(3))
def test_one_level_is_bounded_least_squares(seed):
    """Against scipy; more rows than joints, so that there is one answer."""
    r = rng(seed)
    n = int(r.integers(1, 9))
    A, b, high = r.normal(size=(n + 2, n)), r.normal(size=n + 2), r.exponential(size=n)
    h = Hierarchy.from_levels([(np.eye(n), -0.5 * high, high), (A, b)])
    expected = lsq_linear(A, b, (-0.5 * high, high), method="bvls", tol=1e-14).x
    np.testing.assert_allclose(TPM.solve(h).x, expected, rtol=0, atol=1e-10)


def test_scaling_is_one_where_a_level_is_met_and_the_share_of_the_target_where_it_is_not():
    bounds = (np.eye(2), [-1.0, -1.0], [1.0, 1.0])
    h = Hierarchy.from_levels([bounds, ([[1.0, 0.0]], [0.5]), ([[0.0, 1.0]], [-4.0]),
                               ([[0.0, 1.0]], [9.0]), ([[1.0, 1.0]], [0.0])])
    res = TPM.solve(h)
    np.testing.assert_allclose(res.x, [0.5, -1.0])
    np.testing.assert_allclose(res.scaling, [1.0, 1.0, 0.25, 0.0, 0.0])
    assert res.saturated.tolist() == [0, -1]
    assert res.saturated.dtype == np.int8


def test_bounds_on_some_joints_with_any_coefficient_are_intersected():
    bounds = ([[0.0, -2.0, 0.0], [0.0, 1.0, 0.0], [10.0, 0.0, 0.0]],
              [-1.0, -np.inf, -np.inf], [np.inf, 0.7, 3.0])
    h = Hierarchy.from_levels([bounds, (np.eye(3), [1.0, 1.0, 1.0])])
    res = TPM.solve(h)
    np.testing.assert_allclose(res.x, [0.3, 0.5, 1.0])
    assert res.saturated.tolist() == [1, 1, 0]


def test_bounds_that_exclude_each_other_give_the_point_of_least_violation():
    bounds = ([[1.0, 0.0], [2.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [-5.0, 4.0, -0.5, -1.0],
              [0.0, np.inf, np.inf, 1.0])
    h = Hierarchy.from_levels([bounds, ([[1.0, 1.0]], [9.0])])
    res = TPM.solve(h)
    place = lsq_linear([[1.0], [2.0], [-1.0]], [0.0, 4.0, -0.5]).x[0]
    np.testing.assert_allclose(res.x, [place, 1.0])
    assert certify(h, res.x).certified
    assert res.saturated.tolist() == [2, 1]
    assert res.scaling[0] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_damping_keeps_the_bounds_and_ends(damping):
    damped = make("tpm", damping=damping, threshold=1.0)
    for seed in range(3 if SLOW else 60):
        h = limited(seed)
        res = damped.solve(h)
        assert res.status is Status.SOLVED
        assert_kept(h, res.x)
        assert res.iterations <= 1 + (3 * h.n + 1) * (len(h.sizes) + 1)
        assert np.array_equal(damped.solve(h, res.memory).x, res.x)


@pytest.mark.parametrize("name", ["tpm", "hcod"])
def test_a_joint_that_a_light_row_fixes_among_bounds_is_not_damped(name):
    """x_1 was 0.02: the light equality counted as a task near a singularity."""
    bounds = ([[2.0, 0.0], [-0.01, 0.0], [0.0, 1.0]], [-1.0, -0.005, -1.0], [1.0, -0.005, 1.0])
    h = Hierarchy.from_levels([bounds, (np.ones((1, 2)), [0.8])])
    x = make(name, damping=0.05, threshold=0.1).solve(h).x
    np.testing.assert_allclose(x, [0.5, 0.3], rtol=0, atol=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("lower", [-np.inf, -0.5])
def test_a_bound_beyond_the_largest_number_is_a_failure_with_a_finite_x(damping, lower):
    """5e-324 x <= -1e-5 asked for x <= -inf, which was the answer."""
    tiny = [[5e-324, 0.0], [0.0, 1.0]]
    h = Hierarchy.from_levels([(tiny, [lower, -0.5], [-1e-5, 0.5]), (np.ones((1, 2)), [1.0])])
    res = make("tpm", damping=damping).solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert not res.x.any()
