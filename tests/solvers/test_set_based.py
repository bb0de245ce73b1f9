"""Set-based tasks and smooth activation against their papers in a few lines."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import minimize

from hierarchy import Hierarchy
from hierarchy.activation import activation
from solvers import Status, make
from solvers.problems import load
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled

SET_BASED = SetBased(inner=make("recursive"))
INF = np.inf
REGRESSIONS = Path(__file__).parents[1] / "data" / "regressions"


def pseudoinverse(M):
    """The pseudoinverse, singular values of rounding errors being zero; rows have size one."""
    U, s, V = np.linalg.svd(M, full_matrices=False)
    return (V.T * np.array([1.0 / one if one > 1e-9 else 0.0 for one in s])) @ U.T


def by_the_paper(sets, tasks, n):
    """Resolve with set-based tasks (J, sign) at bounds above equality tasks (J, rate).

    The rate of a set-based task may have its sign: the extended tangent cone of the paper.
    All modes in the paper's order, from none frozen to all; each by null-space projections.
    """
    for count in range(len(sets) + 1):
        for frozen in combinations(range(len(sets)), count):
            x, N = np.zeros(n), np.eye(n)
            for J, rate in [*((sets[k][0], np.zeros(1)) for k in frozen), *tasks]:
                inverse = pseudoinverse(J @ N)
                x = x + inverse @ (rate - J @ x)
                N = N - inverse @ J @ N
            if all(sign * (J[0] @ x) >= -1e-9 for k, (J, sign) in enumerate(sets)
                   if k not in frozen):
                return x, frozen
    raise AssertionError("the last mode has no condition")


def problems(count):
    """Random planar arms with joint limits, a wall for the tip, and a rate asked of the tip."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        n = int(rng.integers(4, 7))
        angles = np.cumsum(rng.uniform(-2.0, 2.0, n))  # of links of length 1
        J = np.array([[-np.sin(angles[j:]).sum(), np.cos(angles[j:]).sum()] for j in range(n)]).T
        rows = [np.eye(n)[[j]] for j in rng.permutation(n)[:2]] + [J[:1]]
        sets = list(zip(rows, rng.choice([-1.0, 1.0], 3), strict=True))
        yield sets, [(J, rng.normal(size=2)), (np.eye(n)[-1:], rng.normal(size=1))], n


def test_with_every_task_at_its_bound_the_mode_and_the_answer_are_those_of_the_paper():
    counts = set()
    for sets, tasks, n in problems(60):
        x, frozen = by_the_paper(sets, tasks, n)
        sides = [(0.0, INF) if sign > 0.0 else (-INF, 0.0) for _, sign in sets]  # tangent cones
        cones = np.vstack([J for J, _ in sets]), *np.array(sides).T
        found = SET_BASED.solve(Hierarchy.from_levels([cones, *tasks]))
        assert found.status is Status.SOLVED
        assert tuple(np.flatnonzero(np.abs(found.active[:3]) == 1)) == frozen
        np.testing.assert_allclose(found.x, x, atol=1e-8 * (1 + np.abs(x).max()))
        counts.add(len(frozen))
    assert counts >= {0, 1, 2}, "the problems reach modes with none, one and two frozen tasks"


def test_after_the_most_modes_everything_at_a_bound_is_frozen():
    rows = np.eye(6)
    h = Hierarchy.from_levels([(rows, np.zeros(6), np.full(6, INF)), (rows, [-1, -1, -1, 1, 1, 1])])
    found = SET_BASED.solve(h)
    np.testing.assert_allclose(found.x, [0, 0, 0, 1, 1, 1], atol=1e-12)
    assert found.iterations == 1 + 6 + 15 + 1, "one mode of none, 6 of one, 15 of two, then 0 1 2"
    short = SetBased(inner=make("recursive"), most=5).solve(h)
    np.testing.assert_allclose(short.x, np.zeros(6), atol=1e-12)
    assert short.iterations == 6
    rounded = Hierarchy.from_levels([([[1.0]], [-INF], [0.0]), ([[1.0]], [1e-12])])
    assert SET_BASED.solve(rounded).iterations == 1


PERIOD = 0.1


def settled(*curved, inner="hcod", softness=1.0):
    return Settled(inner=make(inner), period=PERIOD, softness=softness, curved=frozenset(curved))


def nearly_singular(rng, smallest):
    U, V = (np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (3, 6))
    return U @ np.diag([1.0, 0.5, smallest]) @ V[:3]


@pytest.mark.parametrize("smallest", [0.3, 0.05, 1e-3, 1e-9, 0.0])
@pytest.mark.parametrize("box", [np.inf, 0.6])
def test_one_level_takes_the_minimum_that_scipy_finds(smallest, box):
    rng = np.random.default_rng(4)
    A, b = nearly_singular(rng, smallest), rng.normal(size=3)
    alpha = 0.5 * PERIOD * np.linalg.norm(A)
    h = Hierarchy.from_levels([(np.eye(6), np.full(6, -box), np.full(6, box)), (A, b)],
                              names=["limits", "hand"])
    x = settled("hand").solve(h).x

    def cost(x):
        return np.linalg.norm(b - A @ x) + alpha * x @ x / 2

    theirs = min((minimize(cost, start, bounds=[(-box, box)] * 6, options={"ftol": 1e-14})
                  for start in (x, np.zeros(6))), key=lambda one: one.fun)
    assert cost(x) <= theirs.fun + 1e-9
    assert (np.abs(x) <= box + 1e-9).all()


def test_a_level_is_damped_about_the_answer_of_the_levels_above():
    row = np.array([[1.0, 0.01]])
    h = Hierarchy.from_levels([(np.eye(2)[:1], [2.0]), (row, [0.0])], names=["joint", "hand"])
    bend = np.linalg.norm(row)
    x = settled("hand").solve(h).x  # exactly, the second joint would go at -200 rad/s
    np.testing.assert_allclose(x, [2.0, -0.01 / (PERIOD * bend / 2)], rtol=1e-8)
    x = settled("joint", "hand").solve(h).x  # the joint bears the whole pull and bends by 1
    np.testing.assert_allclose(x, [2.0, -0.01 / (PERIOD * (bend + 1.0) / 2)], rtol=1e-8)


@pytest.mark.parametrize("inner", ["hcod", "tpm", "hqp"])
def test_levels_below_do_not_move_what_a_level_settled_on(inner):
    rng = np.random.default_rng(6)
    A, b = nearly_singular(rng, 1e-4), rng.normal(size=3)
    limits = np.eye(6), np.full(6, -9.0), np.full(6, 9.0)
    alone = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b)], names=["limits", "a"])).x
    both = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b), (np.eye(6), np.ones(6))], names=["limits", "a", "posture"]))
    np.testing.assert_allclose(A @ both.x, A @ alone, atol=1e-5)
    assert np.linalg.norm(both.x - alone) > 1e-3
    wanted = settled("a", inner=inner).solve(Hierarchy.from_levels(  # it counted as above all
        [limits, (A, b)], np.ones(6), names=["limits", "a"])).x
    np.testing.assert_allclose(wanted, both.x, atol=1e-5)
    assert inner != "hcod" or (both.holds_back == -1).all()


@pytest.mark.parametrize("inner", ["hcod", "sns", "tpm"])
def test_a_level_without_rows_above_limits_changes_nothing(inner):
    """The pace took the place of the limits, which `sns` and `tpm` then refused as a second level.
    """
    levels = [(np.eye(2), -np.ones(2), np.ones(2)), ([[1.0, 0.2]], [50.0])]
    h = Hierarchy.from_levels(levels, names=["limits", "a"])
    other = Hierarchy.from_levels([(np.empty((0, 2)), []), *levels], names=["none", *h.names])
    x, again = (settled("a", inner=inner).solve(one).x for one in (h, other))
    np.testing.assert_array_equal(again, x)


def test_a_level_that_those_above_decide_does_not_slow_those_below():
    """As of two targets for one hand: what a posture does changes the second miss by nothing."""
    rng = np.random.default_rng(7)
    A = nearly_singular(rng, 0.3)
    above, posture = (A, rng.normal(size=3)), (np.eye(6), np.ones(6))
    x0 = make("hcod").solve(Hierarchy.from_levels([above])).x
    for one_more in (0, 1):  # row that is met
        row = rng.normal(size=(one_more, 6))
        again = (np.vstack([rng.normal(size=(4, 3)) @ A, row]), [*rng.normal(size=4), *row @ x0])
        h = Hierarchy.from_levels([above, again, posture], names=["a", "b", "c"])
        np.testing.assert_allclose(settled("a", "b").solve(h).x, make("hcod").solve(h).x,
                                   atol=1e-9)


def test_inequalities_whose_pace_leaves_one_point_do_not_hide_what_a_level_below_found():
    """Of a Panda's manipulability: joints jumped by 2.8 rad/s, and the hand's level was lost."""
    h = load(REGRESSIONS / "settled" / "panda_manipulability.npz")  # limits, a, b, a hand
    resolver = replace(settled("a", "b", "c"), period=0.02, bends={"a": 0.4722, "b": 0.4722})
    A, b, _ = list(resolver.asked(h).levels())[-1]
    np.testing.assert_allclose(A @ resolver.solve(h).x, b, atol=1e-6)


@pytest.mark.parametrize(("inner", "bad"), [
    ("hcod", None), ("hqp", None), ("hcod", np.nan), ("hcod", INF), ("hcod", 1e308)])
def test_rows_of_any_size_end_in_a_status_and_those_that_are_no_numbers_at_once(inner, bad):
    """Divisions of 0 by 0, overflow in a direction of length 1, and LAPACK, where singular values
    of such rows were asked for, ended the loop or never came back."""
    resolver = replace(settled(*"abc", inner=inner), bends={"b": 1.0, "c": 0.5})
    for seed in range(60):
        rng = np.random.default_rng(seed)
        sizes = [1.0, 1e-12, 1e-160, 1e8, 1e150, 1e200] if bad is None else [1.0]
        levels = [(rng.normal(size=(2, 4)) * rng.choice(sizes, size=(2, 1)),
                   rng.normal(size=2) * rng.choice([1.0, 1e-8, 1e150])) for _ in range(3)]
        levels[1] = (*levels[1], np.full(2, INF))
        h = Hierarchy.from_levels(levels, names=[*"abc"])
        if bad is not None:
            h.A[rng.integers(6)] = bad
        res = resolver.solve(h)
        assert np.isfinite(res.x).all()
        assert bad is None or (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)


def test_a_level_may_have_the_name_of_what_is_put_above_it():
    levels = [(np.diag([1.0, 1e-6]), [0.0, 9.0]), (np.eye(2), np.ones(2))]
    found = [settled(name).solve(Hierarchy.from_levels(levels, names=[name, "pace'"])).x
             for name in ("pace", "hand")]
    np.testing.assert_array_equal(*found)


def test_a_merged_level_out_of_reach_keeps_its_memory_and_strict_levels_stay_strict():
    rng = np.random.default_rng(6)
    A, b, E = nearly_singular(rng, 1e-4), 3.0 * rng.normal(size=3), np.eye(6)
    h = Hierarchy.from_levels([(E[:1], [0.3]), (E, np.full(6, 0.1), np.full(6, 0.4)), (A, b),
                               (E, np.zeros(6))], names=["mechanism", "limits", "hand", "posture"])
    merged, y = settled("hand", inner="merged"), np.zeros(3)
    memory = None
    for _ in range(4):
        assert merged._calmed(h) is not None
        found = merged.solve(h, memory)
        assert h.violations(found.x)[:2].max() < 1e-9
        y = np.clip(y + 0.1 * np.clip(b - A @ found.x, -1.0, 1.0), -1.0, 1.0)
        np.testing.assert_allclose(found.memory[:h.m], [*np.zeros(7), *y, *np.zeros(6)])
        sides = 1 * (found.x > 0.4 - 1e-9) - (found.x < 0.1 + 1e-9)
        np.testing.assert_array_equal(found.active[1:7], sides)
        memory = found.memory
    assert make("merged").solve(h, memory).status is found.status is Status.SOLVED


LAMBDA, THRESHOLD, ETA = 1e-4, 1e-2, 10.0
SMOOTH = make("smooth")


def activated_pseudoinverse(X, A, Q):
    """X^(#,A,Q) of the paper, with the singular values and vectors of the matrix inverted."""
    n = len(Q)
    M = X.T @ A @ X + ETA * (np.eye(n) - Q).T @ (np.eye(n) - Q)
    _, s, V = np.linalg.svd(M)
    P = np.diag([LAMBDA * (1 + np.cos(np.pi * one / THRESHOLD)) / 2 if one < THRESHOLD else 0.0
                 for one in s])
    return np.linalg.pinv(M + V.T @ P @ V) @ X.T @ A @ A


def by_simetti_and_casalino(levels, n):
    """The recursion of the paper over (J, activations, rates) with all rows, and the identity."""
    rho, Q, one = np.zeros(n), np.eye(n), np.eye(n)
    for J, a, rate in [*levels, (one, np.ones(n), np.zeros(n))]:
        A, X = np.diag(a), J @ Q
        W = X @ activated_pseudoinverse(X, A, Q)
        T = one - Q @ activated_pseudoinverse(X, A, one) @ W @ J
        rho, Q = (T @ rho + Q @ activated_pseudoinverse(X, A, one) @ W @ rate,
                  Q @ (one - activated_pseudoinverse(X, A, one) @ X))
    return rho


def smooth_problems():
    """Yield levels (J, rate) and activations of their rows, the last few near a singularity."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        sizes = rng.integers(1, 5, 3)
        yield [(rng.normal(size=(m, 7)), rng.normal(size=m)) for m in sizes], [
            np.where(rng.random(m) < 0.5, rng.choice([0.0, 1.0], m), rng.random(m)) for m in sizes]
    for scale in (1e-1, 1e-2, 1e-3, 0.0):
        J, row, other = rng.normal(size=(3, 1, 4))
        J = np.vstack([row, row + scale * J])
        yield [(J, rng.normal(size=2)), (other, np.ones(1))], [np.array([1, 0.7]), np.ones(1)]


def test_the_answer_is_that_of_the_paper_with_all_its_matrices_also_near_a_singularity():
    for levels, acts in smooth_problems():
        want = by_simetti_and_casalino([(J, a, rate) for (J, rate), a in zip(
            levels, acts, strict=True)], levels[0][0].shape[1])
        found = SMOOTH.solve_activated(Hierarchy.from_levels(levels), np.concatenate(acts))
        assert found.status is Status.SOLVED
        np.testing.assert_allclose(found.x, want, atol=1e-7 * (1 + np.abs(want).max()))
        assert np.abs(want).max() < 1e4


def test_the_activation_is_one_at_the_bound_zero_beyond_the_buffer_and_has_no_kink():
    error = np.array([-0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.9])  # to the far end of a buffer of 0.4
    found = activation(error, 0.4)
    np.testing.assert_allclose(found[[0, 1, 3, 5, 6]], [0.0, 0.0, 0.5, 1.0, 1.0], atol=1e-15)
    assert (np.diff(found) >= 0.0).all()
    step = 1e-5
    slopes = np.diff(activation(np.array([-step, 0.0, step, 0.4 - step, 0.4, 0.4 + step]), 0.4))
    np.testing.assert_allclose(slopes[[0, 1, 3, 4]] / step, 0.0, atol=1e-3)


def test_what_has_no_answer_is_refused_or_has_a_status():
    two = Hierarchy.from_levels([(np.eye(2), [0.0, -1.0], [INF, 2.0])], names=["walls"])
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0], [INF])], names=["walls"])
    below = Hierarchy.from_levels([(np.eye(2), np.zeros(2))] * 2, names=["walls", "tip"])
    given = SMOOTH.solve_activated
    for call, said in (
            (lambda: SetBased(inner="tpm"), "set-based: inner: expected a Resolver, got str 'tpm'"),
            (lambda: SET_BASED.solve(two), "walls, row 1: two sides, -1 <= a x <= 2"),
            (lambda: SMOOTH.solve(h), "walls, row 0: an inequality, 0 <= a x <= inf; smooth "
             "resolves equalities, and rows that come with an activation"),
            (lambda: given(h, np.array([1.5])), "walls, row 0: activation 1.5 is outside 0 .. 1"),
            (lambda: given(below, np.array([1.0, 0.5, 0.0, -1.0])),
             "tip, row 1: activation -1.0 is outside 0 .. 1"),
            (lambda: given(h.changed(metric=np.eye(2)), np.ones(1)), "the hierarchy has a metric"),
            (lambda: given(h, np.ones(2)), "shape (2,), expected (1,)")):
        refused(said, call)
    rows = Hierarchy.from_levels([([[1.0, 0.0]], [0.0])])
    for spoilt, array, value in ((h, h.lower, np.nan), (rows, rows.A, np.nan),
                                 (rows, rows.A, np.inf)):
        array[0] = value
        for found in (given(spoilt, np.ones(1)), SET_BASED.solve(spoilt),
                      SMOOTH.solve(spoilt.changed(upper=spoilt.lower))):
            assert (found.status, found.x.any()) == (Status.NUMERICAL_FAILURE, False)
