"""Set-based tasks against the few lines of Moe et al. (2016), on planar arms."""

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import minimize

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled

SET_BASED = SetBased(inner=make("recursive"))
INF = np.inf


def tip(q):
    """Position (2,) of the tip of a planar arm of links of length 1, and its Jacobian (2, n)."""
    angles = np.cumsum(q)
    J = np.array([[-np.sin(angles[j:]).sum() for j in range(len(q))],
                  [np.cos(angles[j:]).sum() for j in range(len(q))]])
    return np.array([np.cos(angles).sum(), np.sin(angles).sum()]), J


def in_tangent_cone(rate, value, least, most):
    """in_T_RC of the paper: whether a rate is in the extended tangent cone."""
    if least < value < most:
        return True
    return rate >= -1e-9 if value <= least else rate <= 1e-9


def pseudoinverse(M):
    """The pseudoinverse, singular values of rounding errors being zero; rows have size one."""
    U, s, V = np.linalg.svd(M, full_matrices=False)
    return (V.T * np.array([1.0 / one if one > 1e-9 else 0.0 for one in s])) @ U.T


def by_the_paper(sets, tasks, n):
    """Resolve with set-based tasks (J, value, least, most) above equality tasks (J, rate).

    All modes in the paper's order, from none frozen to all; each by null-space projections.
    """
    for count in range(len(sets) + 1):
        for frozen in combinations(range(len(sets)), count):
            x, N = np.zeros(n), np.eye(n)
            for J, rate in [*((sets[k][0], np.zeros(1)) for k in frozen), *tasks]:
                inverse = pseudoinverse(J @ N)
                x = x + inverse @ (rate - J @ x)
                N = N - inverse @ J @ N
            if all(in_tangent_cone(float(J[0] @ x), *bounds) for k, (J, *bounds) in enumerate(sets)
                   if k not in frozen):
                return x, frozen
    raise AssertionError("the last mode has no condition")


def as_rows(sets, tasks):
    """The same problem as a Hierarchy: one level of tangent cones, then the equalities."""
    sides = [(0.0, INF) if value <= least else (-INF, 0.0) if value >= most else (-INF, INF)
             for _, value, least, most in sets]
    rows = np.vstack([J for J, *_ in sets])
    return Hierarchy.from_levels([(rows, *np.array(sides).T), *tasks])


def problems(count, inside=0.0):
    """Random arms with joint limits, a wall for the tip, and a rate asked of the tip."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        n = int(rng.integers(4, 7))
        q = rng.uniform(-2.0, 2.0, n)
        J = tip(q)[1]
        rows = [np.eye(n)[[j]] for j in rng.permutation(n)[:2]] + [J[:1]]
        values = np.where(rng.random(3) < inside, 0.5, rng.choice([0.0, 1.0], 3))
        sets = [(row, float(value), 0.0, 1.0) for row, value in zip(rows, values, strict=True)]
        yield sets, [(J, rng.normal(size=2)), (np.eye(n)[-1:], rng.normal(size=1))], n


def test_with_every_task_at_its_bound_the_mode_and_the_answer_are_those_of_the_paper():
    counts = set()
    for sets, tasks, n in problems(60):
        x, frozen = by_the_paper(sets, tasks, n)
        found = SET_BASED.solve(as_rows(sets, tasks))
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


def test_a_row_with_two_sides_is_refused_with_its_level_and_sides():
    h = Hierarchy.from_levels([([[1.0, 0.0], [0.0, 1.0]], [0.0, -1.0], [INF, 2.0])],
                              names=["walls"])
    with pytest.raises(HierarchyError, match=r"walls, row 1: two sides, -1 <= a x <= 2"):
        SET_BASED.solve(h)


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
    assert cost(x) <= theirs.fun + 1e-5
    assert (np.abs(x) <= box + 1e-9).all()


@pytest.mark.parametrize("inner", ["hcod", "tpm", "hqp"])
def test_levels_below_do_not_move_what_a_level_settled_on(inner):
    rng = np.random.default_rng(6)
    A, b = nearly_singular(rng, 1e-4), rng.normal(size=3)
    limits = np.eye(6), np.full(6, -9.0), np.full(6, 9.0)
    alone = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b)], names=["limits", "a"])).x
    both = settled("a", inner=inner).solve(Hierarchy.from_levels(
        [limits, (A, b), (np.eye(6), np.ones(6))], names=["limits", "a", "posture"])).x
    np.testing.assert_allclose(A @ both, A @ alone, atol=1e-5)
    assert np.linalg.norm(both - alone) > 1e-3
