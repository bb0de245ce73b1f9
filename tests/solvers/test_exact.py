"""The exact engine: what it verifies, how it ends, tall levels, damping, rows of any size."""


import numpy as np
import pytest

from hierarchy import Hierarchy
from hierarchy.jit import compiled
from solvers import Status, make, problems
from solvers.kernels.multipliers import write_multipliers
from solvers.kernels.rows import ZERO
from solvers.kernels.space import matrix
from solvers.kernels.tolerances import MET
from solvers.kernels.verification import verify
from solvers.kernels.working_set import STATE, carve_working_set, load, meet
from solvers.status import EQUAL, FREE, SOLVED

HCOD = make("hcod")
INF = np.inf


X, STATE_OF_ROW, MULTIPLIER = range(3)  # what is changed in right claims


@compiled
def verified(h, x, record, work, change):
    """Whether the claims of a working set are verified after (what, level, row, value) changed."""
    A, lower, upper, sizes = h
    multiplier, at = matrix(work, ZERO, sizes.size + 1, A.shape[0])
    s, at = carve_working_set(A, sizes, x, multiplier, work, at)
    code = load(s, lower, upper, sizes, record, 1e-8)
    meet(s, sizes.size)
    write_multipliers(s, MET)
    what, level, row = np.int64(change[0]), np.int64(change[1]), np.int64(change[2])
    if what == X:
        x[row] += change[3]
    elif what == STATE_OF_ROW:
        s.index[STATE, row] = np.int64(change[3])
    elif what == MULTIPLIER and change[3] < 0.0 and multiplier[level, row] == 0.0:
        multiplier[level, row] = 1.0
    elif what == MULTIPLIER:
        multiplier[level, row] *= change[3]
    return code == SOLVED and verify(s, False)


def accepted(active, what=-1, level=0, row=0, value=0.0):
    """Whether claims about `corner` are verified, with rows that act at these sides."""
    h, record = corner(), np.zeros(18)
    record[:5] = active
    return verified((h.A, h.lower, h.upper, h.sizes), np.zeros(2), record, np.zeros(2000),
                    np.array([what, level, row, value], dtype=float))


def corner():
    """Limits on two joints, a hand that asks for too much of both, a posture."""
    return Hierarchy.from_levels([(np.eye(2), -np.ones(2), np.ones(2)), ([[1.0, 0.5]], [3.0]),
                                  (np.eye(2), [0.0, 0.25])])


RIGHT = np.array([1.0, 1.0, EQUAL, EQUAL, EQUAL])


def test_a_working_set_is_verified_with_its_answer_and_its_multipliers():
    assert accepted(RIGHT)


@pytest.mark.parametrize(("sides", "change"), [
    *((RIGHT, (X, 0, joint, step)) for joint in (0, 1) for step in (-1e-6, 1e-6)),
    *(([*sides, *RIGHT[2:]], ()) for sides in ((0, 1), (1, 0), (0, 0), (-1, 1), (1, -1))),
    *((RIGHT, (MULTIPLIER, level, row, share)) for level, row in ((1, 0), (1, 1), (1, 2))
      for share in (-1.0, 0.5)),
    (RIGHT, (MULTIPLIER, 0, 0, -1.0)), (RIGHT, (STATE_OF_ROW, 0, 0, FREE))])
def test_another_x_side_or_multiplier_is_refused(sides, change):
    assert not accepted(sides, *change)


def tall(n, m, seed):
    """Unit half-spaces that can all be met, a target below."""
    r = np.random.default_rng([n, m, seed])
    A = r.normal(size=(m, n))
    A /= np.linalg.norm(A, axis=1)[:, None]
    inside = A @ r.normal(size=n) + 0.1 * r.random(m)
    return Hierarchy.from_levels([(A, np.full(m, -INF), inside), (r.normal(size=(1, n)), [5.0])])


@pytest.mark.parametrize("n", [4, 12])
@pytest.mark.parametrize("m", [100, 1000])
def test_a_tall_level_that_can_be_met_is_met(n, m):
    for seed in range(10 if m < 1000 else 3):
        h = tall(n, m, seed)
        res = HCOD.solve(h)
        assert res.status is Status.SOLVED
        assert h.violations(res.x)[0] <= 1e-12
        assert res.iterations <= 2 * h.m


def hard(count=15):
    """Problems that take more than ten iterations, and whether their rows are far from parallel."""
    found, seed = [], 0
    while len(found) < count:
        h = problems.structured(seed, ("nearly_parallel" if seed % 2 else "opposed",))
        if seed % 4 == 0:
            h = tall(5, 60, seed)
        res = HCOD.solve(h)
        if res.status is Status.SOLVED and res.iterations > 10:
            found.append((h, seed % 2 == 0))
        seed += 1
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("budget", "endless"), [(5, 1), (10, 0)])
def test_a_problem_solved_in_slices_ends_with_the_answer_of_one_solve(budget, endless):
    """But for one, in which a single row enters at the cost of more than five that leave."""
    sliced, problems_left = make("hcod", max_iterations=budget), 0
    for h, clear in hard():
        whole, memory = HCOD.solve(h), None
        for _ in range(50):
            res = sliced.solve(h, memory)
            assert res.iterations <= budget
            memory = res.memory
            if res.status is not Status.ITERATION_LIMIT:
                break
            k = res.unfinished if clear else 0
            np.testing.assert_allclose(h.violations(res.x)[:k], h.violations(whole.x)[:k],
                                       atol=1e-7 * (1 + np.abs(whole.x).max()))
        problems_left += res.status is not Status.SOLVED
        if res.status is Status.SOLVED:
            np.testing.assert_allclose(res.x, whole.x, atol=1e-8 * (1 + np.abs(whole.x).max()))
    assert problems_left <= endless


def arm(angle):
    """Velocity limits, the hand of a planar arm that is straight up to an angle, a posture."""
    q = np.array([0.3, angle, -angle, 2 * angle])
    tips = np.cumsum(q)[::-1]
    J = np.cumsum([[-np.sin(t), np.cos(t)] for t in tips], axis=0)[::-1].T
    return np.eye(4), J


@pytest.mark.parametrize("name", ["hcod", "tpm"])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3])
def test_damped_x_is_continuous_in_the_targets_under_a_box(name, angle):
    resolver, r = make(name, damping=0.1), np.random.default_rng(7)
    box, J = arm(angle)
    for _ in range(50):
        target, half = r.normal(size=2), r.uniform(0.05, 1.0, 4)
        x = []
        for step in (0.0, 1e-11):
            h = Hierarchy.from_levels([(box, -half, half), (J, target + step), (box, 0.1 * half)])
            res = resolver.solve(h)
            assert res.status is Status.SOLVED
            x.append(res.x)
        assert np.abs(x[1] - x[0]).max() <= 1e-6


@pytest.mark.parametrize("name", ["hcod", "tpm"])
def test_damped_x_is_continuous_where_a_bound_begins_to_act(name):
    """A level alone passes the bound, the levels below move x away: it jumped by 3.6."""
    resolver = make(name, damping=0.1)
    for seed in range(60):
        r = np.random.default_rng([seed, 3206])
        n, half = 2 + seed % 6, 9.0
        A, B = r.normal(size=(1 + seed % 2, n)), r.normal(size=(1, n))
        A[-1] = A[0] * (seed % 2) + A[-1] * 10.0 ** r.uniform(-3.0, 0.0)
        tasks, x = [(A, r.normal(size=len(A))), (B, r.normal(size=1))], []
        for step in (0.0, 0.0, 1e-11):
            limits = np.full(n, half)
            if x:
                limits[seed % n] = abs(x[0][seed % n])
            h = Hierarchy.from_levels([(np.eye(n), -limits, limits),
                                       (A, tasks[0][1] + step), tasks[1]])
            x.append(resolver.solve(h).x)
        assert np.abs(x[2] - x[1]).max() <= 1e-6


@pytest.mark.filterwarnings("ignore:overflow")
@pytest.mark.parametrize("below", [0, 1])
def test_rows_of_any_size_are_solved_and_numbers_that_overflow_are_a_failure(below):
    tiny = Hierarchy.from_levels([([[1e-200]], [1e-200], [INF if below else 1e-200])])
    np.testing.assert_array_equal(HCOD.solve(tiny).x, [1.0])
    small = Hierarchy.from_levels([([[1e-150, 0.0], [0.0, 2e-150]], [1e-150] * 2, [1e-150, 3e-150]),
                                   ([[1e-150, 1e-150]], [4e-150])])
    np.testing.assert_allclose(HCOD.solve(small).x, [1.0, 1.5])
    large = Hierarchy.from_levels([(np.eye(2), np.zeros(2), np.ones(2)),
                                   ([[1.0, 1.0], [1.0, 2.0]], [1e154, 2e154])])
    res = HCOD.solve(large)
    assert res.status is Status.NUMERICAL_FAILURE
    assert not res.x.any()
