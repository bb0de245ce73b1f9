"""`merged`: strict limits, one weighted level with a memory: what its documentation promises."""

import numpy as np
import pytest
from rank_cases import solved
from refusals import refused

from hierarchy import Hierarchy
from solvers import make

N, RATIO = 6, 5.0


def arm(seed, limit=0.6):
    """Return physics (E), a box (I), two tasks that conflict and a posture, as arrays."""
    random = np.random.default_rng(seed)
    levels = [(random.normal(size=(1, N)), np.zeros(1), np.zeros(1)),
              (np.eye(N), np.full(N, -limit), np.full(N, limit))]
    for m in (2, 3):
        b = random.normal(size=m)
        levels.append((random.normal(size=(m, N)), b, b))
    return [*levels, (np.eye(N), np.zeros(N), np.zeros(N))]


def with_targets(levels, b):
    """Return the hierarchy whose tasks, below the first two levels, aim at b (11,)."""
    parts = np.split(b, [2, 5])
    return Hierarchy.from_levels([*levels[:2], *((A, part) for (A, _, _), part in zip(
        levels[2:], parts, strict=True))])


def targets(seed, size=1.0):
    return size * np.random.default_rng(seed).normal(size=11)


@pytest.mark.parametrize("seed", range(20))
def test_x_and_torques_move_no_faster_than_the_targets(seed):
    levels, resolver = arm(seed), make("merged", ratio=RATIO, cap=0.0)
    W = np.repeat([RATIO**2, RATIO, 1.0], [2, 3, N])
    A = np.vstack([A for A, _, _ in levels[2:]])
    T = np.random.default_rng(seed + 100).normal(size=(4, N))
    null = np.linalg.svd(levels[0][0])[2][1:].T
    gamma = np.linalg.norm(T @ null @ np.linalg.pinv(W[:, None] * A @ null), axis=1)
    for size in (1e-6, 0.1, 3.0):
        b, db = targets(seed), targets(seed + 1, size)
        dx = (solved(resolver, with_targets(levels, b + db)).x
              - solved(resolver, with_targets(levels, b)).x)
        moved = np.linalg.norm(W * db)
        assert np.linalg.norm(W * (A @ dx)) <= moved * (1 + 1e-9) + 1e-9
        assert (abs(T @ dx) <= gamma * moved * (1 + 1e-9) + 1e-9).all()


@pytest.mark.parametrize("ratio", [1.0, 3.0, 30.0])
def test_a_ratio_costs_the_upper_level_at_most_what_lower_ones_miss_over_its_square(ratio):
    for seed in range(20):
        h = with_targets(arm(seed), targets(seed))
        strict, merged = make("hcod").solve(h).x, solved(make("merged", ratio=ratio, cap=0.0), h).x
        best, found = h.violations(strict), h.violations(merged)
        assert (found[:2] < 1e-9).all()
        below = best[3]**2 / ratio**2 + best[4]**2 / ratio**4
        assert found[2]**2 - best[2]**2 <= below + 1e-9


def test_the_memory_moves_by_at_most_a_step_of_the_miss_or_the_cap_and_stays_within_its_cap():
    levels, resolver = arm(3), make("merged", step=0.5, cap=0.2)
    memory, before = None, np.zeros(7 + 11)
    for seed in range(50):
        h = with_targets(levels, targets(seed))
        found = solved(resolver, h, memory)
        miss = h.lower - h.A @ found.x
        y, memory = found.carried, found.memory
        assert found.active.shape == (h.m,)
        assert (abs(y - before) <= 0.5 * np.minimum(abs(miss), 0.2) + 1e-12)[7:12].all()
        assert (abs(y) <= 0.2).all()
        assert (y[:7] == 0.0).all(), "what is strict has no memory"
        assert (y[12:] == 0.0).all(), "nothing stands below the lowest level"
        before = y


def test_at_rest_upper_levels_are_met_as_under_strict_priorities():
    b = np.concatenate([[0.1, -0.2], [0.3, 0.1, -0.2], np.full(N, 0.3)])
    h = with_targets(arm(1, limit=5.0), b)
    strict, resolver = make("hcod").solve(h).x, make("merged")
    found = solved(resolver, h)
    assert h.violations(found.x)[2] > 1e-4, "the memory has nothing to do"
    for _ in range(3000):
        found = solved(resolver, h, found.memory)
    np.testing.assert_allclose(found.x, strict, atol=1e-8)


def test_levels_stay_strict_down_to_the_first_run_of_inequalities_and_one_is_to_remain():
    h = Hierarchy.from_levels([
        ([[1.0, 0.0]], [1.0]), ([[1.0, 0.0]], [-5.0], [0.5]), ([[0.0, 1.0]], [-1.0], [1.0]),
        ([[0.0, 1.0]], [2.0]), ([[0.0, 1.0]], [-9.0], [0.0])])
    x = solved(make("merged", cap=0.0), h).x
    np.testing.assert_allclose(x, [1.0, 1.0], atol=1e-6)  # strict 2 and 3; level 4 outweighs 5
    one = solved(make("merged", cap=0.0, ratio=1.0, strict_levels=0), h).x
    np.testing.assert_allclose(one, [0.75, 1.0], atol=1e-5)
    h = Hierarchy.from_levels([([[1.0]], [0.0], [1.0])], names=["limits"])
    refused("all levels stay strict (limits)", make("merged").solve, h)


def test_scales_divide_the_weight_of_their_level():
    h = Hierarchy.from_levels([([[1.0]], [1.0]), ([[1.0]], [0.0])], names=["hand", "posture"])
    x = solved(make("merged", ratio=2.0, scales={"hand": 2.0}, strict_levels=0, cap=0.0), h).x
    np.testing.assert_allclose(x, [0.5], atol=1e-5)


def test_weights_below_strict_levels_are_one_level_of_weighted_rows():
    h, w = with_targets(arm(4), targets(4)), np.repeat([1.0, 1.0, 9.0, 4.0, 0.5], [1, N, 2, 3, N])
    by_hand = h.changed(A=h.A * w[:, None], lower=h.lower * w, upper=h.upper * w,
                        sizes=[1, N, 11], names=("physics", "limits", "tasks"))
    for strict, weights in ((2, [1.0, 1.0, 9.0, 4.0, 0.5]), (-1, [9.0, 4.0, 0.5])):
        found = solved(make("weighted", strict_levels=strict, weights=weights), h)
        np.testing.assert_allclose(found.x, make("hcod").solve(by_hand).x, atol=1e-10)
        assert (found.carried == 0.0).all(), "weights have no memory"
        few = make("weighted", strict_levels=strict, weights=[4.0, 0.5])
        refused("2 weights for 5 levels", few.solve, h)


def test_a_task_whose_rows_are_strict_too_drowns_no_light_rows():
    """Feet that stand and are tasks: their multipliers left rounding in what mu alone draws."""
    random = np.random.default_rng(7)
    feet = np.hstack([random.normal(size=(6, 9)), np.zeros((6, 6))])
    motion, trunk = random.normal(size=(3, 15)), np.hstack([np.eye(3), np.zeros((3, 12))])
    physics = (np.vstack([motion, feet]), np.zeros(9))
    limits = (np.eye(15), np.full(15, -9.0), np.full(15, 9.0))
    tasks = [(feet, np.full(6, 2.0))] * 6
    resolver = make("merged", cap=0.0)
    for seed in range(20):
        rest = (trunk + 0.1, np.random.default_rng(seed).normal(size=3))
        alone = solved(resolver, Hierarchy.from_levels([physics, limits, rest]))
        both = solved(resolver, Hierarchy.from_levels([physics, limits, *tasks, rest]))
        np.testing.assert_allclose(both.x, alone.x, atol=1e-9)
