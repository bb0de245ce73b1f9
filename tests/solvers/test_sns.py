"""Saturation in the null space: the box is kept, what is scaled is said, priorities hold."""

import os
import subprocess
import sys
from itertools import product

import numpy as np
import pytest
from rank_cases import random_levels
from scipy.optimize import linprog

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make
from solvers.workspace import WORKSPACE

FORMS = [make("sns", form=form, scales=scales)
         for form in ("basic", "optimal") for scales in ("target", "miss")]
BASIC, OPTIMAL = make("sns"), make("sns", form="optimal")
JIT = os.environ.get("NUMBA_DISABLE_JIT") != "1"
MANY, FEW = (300, 60) if JIT else (8, 4)

every_form = pytest.mark.parametrize("resolver", FORMS, ids=lambda r: r.label.replace(" ", "-"))


def boxed(low, up, *levels, reference=None):
    return Hierarchy.from_levels([(np.eye(len(low)), low, up), *levels], reference)


def problems(count, seed, levels=None):
    """Yield (h, low, up): boxes of every kind above rows of every rank."""
    r = np.random.default_rng(seed)
    for _ in range(count):
        n, rows, tasks = int(r.integers(1, 9)), [], []
        for _ in range(levels or r.integers(1, 5)):
            A = r.normal(size=(r.integers(0, 5), n))
            for a in A:
                kind = r.integers(0, 9)
                if kind == 0 and rows:
                    a[:] = r.normal(size=len(rows)) @ np.array(rows)
                elif kind == 1 and rows:
                    a[:] = rows[-1] + 1e-3 * r.normal(size=n)
                elif kind == 2:
                    a[:] = 0.0
                elif kind == 3:
                    a[:] = np.eye(n)[r.integers(n)]
                rows.append(a)
            tasks.append((A, r.normal(size=len(A)) * r.choice([0.0, 0.3, 1.0, 5.0])))
        middle = r.normal(size=n) * r.choice([0.0, 0.5])  # zero may lie outside
        low, up = middle - r.uniform(0.05, 2.0, n), middle + r.uniform(0.05, 2.0, n)
        low[r.random(n) < 0.1], up[r.random(n) < 0.1] = -np.inf, np.inf
        if n > 1 and r.random() < 0.3:
            low[0] = up[0] = middle[0]
        scale = r.choice([1.0, -2.0, 0.5], size=n)
        sides = np.sort([scale * low, scale * up], axis=0)
        h = Hierarchy.from_levels([(np.diag(scale), *sides), *tasks],
                                  r.normal(size=n) * r.choice([0.0, 1.0, 5.0]))
        yield h, low, up


@pytest.mark.slow
@every_form
def test_bounds_are_kept_always(resolver):
    for h, low, up in problems(MANY, 1):
        res = resolver.solve(h)
        assert res.status is Status.SOLVED
        assert (np.clip(res.x, low, up) == res.x).all()


@pytest.mark.slow
@every_form
def test_a_lower_level_never_changes_the_value_of_a_higher_one(resolver):
    for h, _, _ in problems(MANY, 2):
        res, levels = resolver.solve(h), list(h.levels())
        for count in range(2, len(levels)):
            part = resolver.solve(Hierarchy.from_levels(levels[:count], h.reference))
            assert np.array_equal(part.scaling, res.scaling[:count])
            rows = np.vstack([A for A, _, _ in levels[1:count]])
            change = np.abs(rows @ (res.x - part.x)).max(initial=0.0)
            assert change <= 1e-9 * (1.0 + np.abs(res.x).max())


HALF = np.full(7, 0.5)


@pytest.mark.parametrize("form", ["basic", "optimal"])
def test_a_scaled_level_reaches_that_share_of_its_target(form):
    scaled = 0
    for seed in range(FEW):
        levels = random_levels(7, (2, 2, 1), seed)
        res = make("sns", form=form).solve(boxed(-HALF, HALF, *levels))
        for (J, b), s in zip(levels, res.scaling[1:], strict=True):
            if s > 0.0:
                np.testing.assert_allclose(J @ res.x, s * b, atol=1e-9)
            scaled += 0.0 < s < 1.0
    assert scaled > 10 or not JIT


def test_a_scaled_level_makes_up_for_that_share_of_what_it_misses():
    resolver, scaled = make("sns", scales="miss"), 0
    for seed in range(FEW):
        levels = random_levels(7, (2, 2, 1), seed)
        res = resolver.solve(boxed(-HALF, HALF, *levels))
        for k, (J, b) in enumerate(levels):
            before = J @ resolver.solve(boxed(-HALF, HALF, *levels[:k])).x
            s = res.scaling[k + 1]
            np.testing.assert_allclose(J @ res.x, before + s * (b - before), atol=1e-9)
            scaled += 0.0 < s < 1.0
    assert scaled > 10 or not JIT


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


@pytest.mark.slow
def test_the_basic_form_is_the_algorithm_as_printed():
    judged = 0
    for seed in range(MANY):
        levels = random_levels(7, (2, 2, 1), seed)
        low, up = -np.random.default_rng(seed).uniform(0.1, 1.5, (2, 7)) * [[1.0], [-1.0]]
        res, printed = BASIC.solve(boxed(low, up, *levels)), as_printed(levels, low, up)
        if printed is not None:
            np.testing.assert_allclose(res.x, printed[0], atol=1e-9)
            np.testing.assert_allclose(res.scaling[1:], printed[1], atol=1e-9)
            judged += any(0.0 < s < 1.0 for s in printed[1])
    assert judged > 50 or not JIT


# The planar arm of four unit links of the papers, q = (90, -90, 90, -90) degrees, and speeds of at
# most 2, 1, 4, 4 rad/s.
ARM = np.array([[-2.0, -1.0, -1.0, 0.0], [2.0, 2.0, 1.0, 1.0]])
SPEED = np.array([2.0, 1.0, 4.0, 4.0])


def best_set(J, b, low, up):
    """Return the largest scaling over all 3^n sets of joints at bounds, and its least x."""
    n, best = len(low), (-1.0, None)
    for choice in product((None, 0, 1), repeat=n):
        free = np.array([side is None for side in choice])
        held = np.array([0.0 if side is None else (low, up)[side][j]
                         for j, side in enumerate(choice)])
        if np.linalg.matrix_rank(J[:, free]) < len(J):
            continue
        a, c = np.zeros(n), held.copy()
        inverse = np.linalg.pinv(J[:, free])
        a[free], c[free] = inverse @ b, -inverse @ J @ held
        s = largest_scaling(a[free], c[free], low[free], up[free])
        x = s * a + c
        if s > best[0] + 1e-9 or (s > best[0] - 1e-9 and x @ x < best[1] @ best[1]):
            best = s, x
    return best


def largest_scaling(a, c, low, up):
    """Return the largest s of 0 .. 1 with s a + c in the box, or -1, by trying all candidates."""
    sides = [(side - c)[np.abs(a) > 1e-12] / a[np.abs(a) > 1e-12] for side in (low, up)]
    candidates = [s for s in np.concatenate([[0.0, 1.0], *sides]) if 0.0 <= s <= 1.0]
    fits = [s for s in candidates
            if (s * a + c >= low - 1e-9).all() and (s * a + c <= up + 1e-9).all()]
    return max(fits, default=-1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("velocity", "scaling", "x"), [
    ([-4.0, -1.5], 10 / 11, [1.8545454545, -1.0, 0.9272727273, -4.0]),
    ([-8.0, -3.0], 5 / 11, [1.8545454545, -1.0, 0.9272727273, -4.0]),
    ([-4.0, 1.5], 1.0, [1.9090909091, -0.7727272727, 0.9545454545, -1.7272727273]),
    ([-4.0, -1.0], 1.0, [2.0, -1.0, 1.0, -4.0]),
    ([-2.0, 4.0], 1.0, None),
    ([3.0, 3.0], None, None),
])
@pytest.mark.parametrize("resolver", [BASIC, OPTIMAL], ids=str)
def test_the_planar_arm_gets_the_best_of_all_sets(resolver, velocity, scaling, x):
    res = resolver.solve(boxed(-SPEED, SPEED, (ARM, velocity)))
    best, nearest = best_set(ARM, np.array(velocity), -SPEED, SPEED)
    assert res.scaling[1] == pytest.approx(best, abs=1e-9)
    np.testing.assert_allclose(ARM @ res.x, best * np.array(velocity), atol=1e-9)
    if scaling is not None:
        assert best == pytest.approx(scaling)
    if x is not None:
        np.testing.assert_allclose(res.x, x, atol=1e-9)
    if resolver is OPTIMAL:
        np.testing.assert_allclose(res.x, nearest, atol=1e-9)


def test_what_saturates_first_is_the_joint_that_leaves_at_the_smallest_scaling():
    """x = s (1, 1, 1) at first: joint 3 leaves at s = 0.4, though joint 1 is as far out."""
    h = boxed([-1, -9, -9], [0.8, 9, 0.4], (np.ones((1, 3)), [3.0]))
    res = BASIC.solve(h)
    np.testing.assert_allclose(res.x, [0.8, 1.8, 0.4])
    np.testing.assert_array_equal(res.saturated, [1, 0, 1])
    np.testing.assert_array_equal(res.scaling, [1.0, 1.0])


def test_a_released_joint_is_better_used():
    """Where both forms reach the same, the optimal one is nearer to the reference."""
    found = 0
    for h, _, _ in problems(MANY, 3, levels=1):
        basic, optimal = BASIC.solve(h), OPTIMAL.solve(h)
        A = h.A[h.sizes[0]:]
        if np.abs(A @ (basic.x - optimal.x)).max(initial=0.0) < 1e-10:
            near, far = (np.linalg.norm(res.x - h.reference) for res in (optimal, basic))
            assert near <= far + 1e-9
            found += near < far - 1e-6
    assert found or not JIT


def test_the_optimal_form_ends_nearest_to_the_reference():
    """hcod, with what the levels have reached as targets, is the judge."""
    for h, _, _ in problems(FEW, 4):
        x, first = OPTIMAL.solve(h).x, h.sizes[0]
        A = h.A[first:]
        judge = make("hcod").solve(Hierarchy.from_levels(
            [(h.A[:first], h.lower[:first], h.upper[:first]), (A, A @ x)], h.reference))
        if judge.status is Status.SOLVED:
            distance = np.linalg.norm(judge.x - h.reference)
            assert np.linalg.norm(x - h.reference) <= distance + 1e-8 * (1.0 + distance)


def largest_possible(J, b, low, up):
    """Return the largest s with J x = s b in the box: a linear program."""
    return linprog(np.r_[np.zeros(len(low)), -1.0], A_eq=np.c_[J, -b], b_eq=np.zeros(len(b)),
                   bounds=[*zip(low, up, strict=True), (0.0, 1.0)]).x[-1]


@pytest.mark.slow
@pytest.mark.parametrize("resolver", [BASIC, OPTIMAL], ids=str)
def test_scaling_is_never_above_what_the_box_allows_and_mostly_reaches_it(resolver):
    shares = []
    for seed in range(MANY):
        r = np.random.default_rng(seed)
        n = int(r.integers(3, 9))
        m = int(r.integers(1, n))
        J, low, up = r.normal(size=(m, n)), -r.uniform(0.2, 2, n), r.uniform(0.2, 2, n)
        b = 2.0 * J @ r.uniform(-2, 2, n)
        s = resolver.solve(boxed(low, up, (J, b))).scaling[1]
        most = largest_possible(J, b, low, up)
        assert s <= most + 1e-7
        shares.append(s / most)
    assert np.mean(np.array(shares) > 1.0 - 1e-6) > 0.95 or not JIT
    assert min(shares) > 0.5


@every_form
def test_scaling_is_the_largest_for_the_joints_that_are_saturated(resolver):
    """With these joints at their bounds, a larger share would drive another one out."""
    for seed in range(FEW):
        r = np.random.default_rng(seed)
        J, bound = r.normal(size=(3, 7)), r.uniform(0.2, 2.0, 7)
        b = 3.0 * J @ r.uniform(-1, 1, 7)
        res = resolver.solve(boxed(-bound, bound, (J, b)))
        s = res.scaling[1]
        if not 0.0 < s < 1.0:
            continue
        free = np.abs(res.x) < bound - 1e-9
        assert np.count_nonzero(free) <= 3  # no freedom is left beside the task ...
        step = np.linalg.pinv(J[:, free]) @ b * 1e-6
        more = J[:, free] @ step - b * 1e-6
        assert np.abs(more).max() > 1e-9  # ... and without a joint at its bound it does not get on


def test_bounds_may_be_given_in_any_order_sign_and_number():
    rows = [[0.0, -2.0], [1.0, 0.0], [0.0, 1.0]]
    h = Hierarchy.from_levels([(rows, [-1.0, -0.1, -np.inf], [1.0, 0.2, 0.3]),
                               (np.eye(2), [1.0, -1.0])], names=["limits", "task"])
    np.testing.assert_allclose(BASIC.solve(h).x, [0.2, -0.2])  # the direction is kept
    assert BASIC.solve(h).scaling[1] == pytest.approx(0.2)
    np.testing.assert_array_equal(BASIC.solve(h).saturated, [1, 0])


def test_a_bound_with_one_value_is_named_so():
    h = boxed([0.5, -1.0], [0.5, 1.0], ([[1.0, 1.0]], [1.0]))
    res = BASIC.solve(h)
    np.testing.assert_allclose(res.x, [0.5, 0.5])
    np.testing.assert_array_equal(res.saturated, [2, 0])


def test_where_the_box_is_all_there_is_the_reference_is_clipped():
    h = boxed([-1.0, -1.0, 0.5], [1.0, 1.0, 2.0], reference=[3.0, 0.25, -1.0])
    np.testing.assert_allclose(OPTIMAL.solve(h).x, [1.0, 0.25, 0.5])
    np.testing.assert_array_equal(OPTIMAL.solve(h).scaling, [1.0])


def test_a_stopped_joint_does_not_stop_the_others_on_their_way_to_the_reference():
    h = boxed(np.full(3, -1.0), np.full(3, 1.0), ([[1.0, 0.0, 0.0]], [0.5]),
              reference=[9.0, 9.0, 0.75])
    np.testing.assert_allclose(BASIC.solve(h).x, [0.5, 1.0, 0.75])


def test_a_level_without_any_scaling_adds_nothing_and_scaling_what_is_missed_helps():
    """Level 1 already moves joint 1 by -1, and 0.5 is all that the box leaves level 2."""
    h = boxed([-2.0, -0.5], [2.0, 0.5], ([[1.0, 0.0]], [-1.0]), ([[1.0, 1.0]], [1.0]))
    target, miss = BASIC.solve(h), make("sns", scales="miss").solve(h)
    np.testing.assert_allclose(target.x, [-1.0, 0.0])
    np.testing.assert_allclose(miss.x, [-1.0, 0.5])
    np.testing.assert_allclose([target.scaling[2], miss.scaling[2]], [0.0, 0.25])


@pytest.mark.parametrize(("levels", "said"), [
    ([(np.eye(2), [0, 0]), (np.eye(2), [-1, -1], [1, 1])], "level 2, row 0: an inequality, -1 <="),
    ([([[1, 0], [1, 1]], [-1, -1], [1, 1])], "level 1, row 1: an inequality"),
    ([([[1, 1], [0, 1]], [1, -1], [1, 1])], "level 1, row 1: an inequality"),
    ([([[0, 0]], [-1], [1])], "level 1, row 0: an inequality"),
    ([(np.eye(2), [-1, -1], [1, 1]), ([[1, 1]], [0], [np.inf])], "level 2, row 0: an inequality"),
])
@pytest.mark.parametrize("resolver", [BASIC, OPTIMAL], ids=str)
def test_other_inequalities_are_refused_by_level_and_row(resolver, levels, said):
    with pytest.raises(HierarchyError, match=said) as error:
        resolver.solve(Hierarchy.from_levels(levels))
    assert "bounds on single unknowns" in str(error.value)


def test_bounds_that_exclude_each_other_are_named():
    h = Hierarchy.from_levels([([[1, 0], [0, 1], [2, 0]], [-1, -1, 4], [1, 1, 6])],
                              names=["limits"])
    with pytest.raises(HierarchyError, match=r"limits, row 2: 4 <= 2 x\[0\] <= 6 leaves nothing"):
        BASIC.solve(h)
    touching = Hierarchy.from_levels([([[3.0], [1.0]], [-1, 0.1], [0.3, 1])])
    assert BASIC.solve(touching).x == pytest.approx(0.1)


@every_form
@pytest.mark.parametrize("where", ["A", "bounds", "lower", "upper", "target", "reference"])
def test_entries_that_are_not_finite_give_a_status_and_a_finite_answer(resolver, where):
    h = boxed(np.full(3, -0.1), np.full(3, 0.1), (np.ones((1, 3)), [1.0]), reference=np.ones(3))
    if where == "A":
        h.A[3, 1] = np.nan
    elif where == "bounds":
        h.A[1, 1] = np.inf
    elif where == "target":
        h.lower[3] = h.upper[3] = np.nan
    elif where == "reference":
        h.reference[1] = np.inf
    else:
        getattr(h, where)[1] = np.nan
    res = resolver.solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert not res.x.any()


@pytest.mark.slow
@every_form
def test_it_ends_within_its_sets(resolver):
    for h, _, _ in problems(MANY, 5):
        assert 1 <= resolver.solve(h).iterations <= (2 * h.n + 2) * len(h.sizes) + 4 * h.n + 2


@every_form
def test_damping_bounds_the_answer_near_a_singularity_inside_the_box(resolver):
    A = np.array([[1.0, 0.0, 0.0], [1.0, 1e-7, 0.0]])
    wide = np.full(3, 1e9)
    h = boxed(-wide, wide, (A, [0.0, 1.0]))
    damped = make("sns", form=resolver.form, scales=resolver.scales, damping=0.05)
    assert np.abs(resolver.solve(h).x).max() > 1e6
    assert np.abs(damped.solve(h).x).max() < 10.0


def test_damping_without_saturation_is_that_of_recursive():
    for seed in range(FEW):
        levels = random_levels(6, (3, 2, 2), seed)
        far, ref = np.full(6, 1e3), np.arange(6.0)
        settings = {"damping": 0.05, "threshold": 3.0}
        expected = make("recursive", **settings).solve(Hierarchy.from_levels(levels, ref)).x
        x = make("sns", **settings).solve(boxed(-far, far, *levels, reference=ref)).x
        np.testing.assert_allclose(x, expected, atol=1e-9)


@every_form
@pytest.mark.parametrize("left", [np.nan, 1e300])
def test_what_was_left_in_the_work_space_does_not_matter(resolver, left, monkeypatch):
    for h, _, _ in problems(FEW, 6):
        before = resolver.solve(h).x
        monkeypatch.setattr(WORKSPACE, "array", np.full(4096, left))
        np.testing.assert_array_equal(resolver.solve(h).x, before)


def test_work_space_is_made_larger_when_needed():
    levels = random_levels(60, (20, 20, 20))
    bound = np.full(60, 0.2)
    res = BASIC.solve(boxed(-bound, bound, *levels))
    assert res.status is Status.SOLVED
    assert np.abs(res.x).max() <= 0.2


def test_a_misspelt_form_or_scaling_is_named():
    with pytest.raises(HierarchyError, match="did you mean 'optimal'"):
        make("sns", form="optimum")
    with pytest.raises(HierarchyError, match="did you mean 'target'"):
        make("sns", scales="targets")


@pytest.mark.slow
@pytest.mark.skipif(not JIT, reason="runs the others without compiling already")
def test_it_runs_without_compiling():
    code = ("import numpy as np; from hierarchy import Hierarchy; from solvers import make\n"
            "h = Hierarchy.from_levels([(np.eye(3), [-1] * 3, [1] * 3), (np.ones((1, 3)), [2.5]),"
            " ([[1, 2, 3]], [9])], [5, 0, 0])\n"
            "for form in ('basic', 'optimal'):\n"
            "    print(*make('sns', form=form).solve(h).x)")
    out = subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, text=True,
                         capture_output=True, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}).stdout
    h = boxed([-1] * 3, [1] * 3, (np.ones((1, 3)), [2.5]), ([[1, 2, 3]], [9]), reference=[5, 0, 0])
    printed = [[float(word) for word in line.split()] for line in out.splitlines()]
    np.testing.assert_allclose(printed, [BASIC.solve(h).x, OPTIMAL.solve(h).x], atol=1e-12)
