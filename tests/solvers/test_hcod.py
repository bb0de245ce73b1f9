"""`hcod`: answers by hand, words for what holds back, its own check, rows of any size."""


import numpy as np
import pytest
from rank_cases import family, solved
from refusals import refused

from hierarchy import Hierarchy
from solvers import Status, explain, make
from solvers.kernels.active_set.exact import solve_damped, solve_equalities, solve_hierarchy
from solvers.problems import Recipe, generate, structured
from solvers.resolvers import hcod
from solvers.status import EQUAL
from solvers.workspace import WORKSPACE, entry

HCOD = make("hcod")


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_equalities_that_come_first_have_the_same_answer_from_a_smaller_kernel(monkeypatch,
                                                                               damping):
    one, other = make("hcod", damping=damping), Hierarchy.from_levels([(np.eye(2), [1, 0], [2, 3])])
    problems, clear = [structured(seed, equalities_only=True) for seed in range(40)], 0
    for h in problems:
        monkeypatch.setattr(hcod, "_kernels", {})
        monkeypatch.setattr(WORKSPACE, "array", np.empty(8))  # which says so before all else
        first = one.solve(h)
        clear += hcod._kernels == {damping > 0: entry(solve_equalities)}
        np.testing.assert_array_equal(one.solve(other).x, [1, 0])
        assert hcod._kernels == {damping > 0: entry(solve_damped if damping else solve_hierarchy)}
        res = one.solve(h)
        assert (res.status, *res.x, *res.record) == (first.status, *first.x, *first.record)
    assert clear == 40 if damping else 0 < clear < 40


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_an_iteration_limit_keeps_the_levels_above_and_says_where_it_was(damping):
    """With damping equalities below it were inactive, `unfinished` was 0, and where a solve took
    its last iteration, it was not SOLVED."""
    for h in (*(h for h, _, _ in list(family("HUM38"))[:10]), *map(structured, range(40))):
        full = make("hcod", damping=damping).solve(h)
        if full.status is not Status.SOLVED:
            continue
        for limit in {1, 3, 6, 11, full.iterations - 1} & {*range(1, full.iterations)}:
            res = make("hcod", damping=damping, max_iterations=limit).solve(h)
            assert (res.status, res.iterations) == (Status.ITERATION_LIMIT, limit)
            assert (res.active == EQUAL)[h.lower == h.upper].all()
            k = res.unfinished
            assert h.names[k] in explain(h, res)
            assert k > 0 or limit < 3, "the first levels take no more iterations"
            if damping == 0.0:
                np.testing.assert_allclose(h.violations(res.x)[:k], h.violations(full.x)[:k],
                                           atol=1e-8)
        res = make("hcod", damping=damping, max_iterations=full.iterations).solve(h)
        assert (res.status, res.unfinished, *res.x) == (Status.SOLVED, None, *full.x)
    apart = Hierarchy.from_levels([([[1.0], [-1.0]], [1.0, 1.0], [2.0, 2.0])])
    assert make("hcod", max_iterations=1).solve(apart).unfinished == 0


@pytest.mark.parametrize(("kind", "seed", "budget"), [
    ("tiny_rows", 1, 5), ("tiny_rows", 138, 5), ("contacts", 7, 5), ("sixty_unknowns", 2, 5),
    ("sixty_unknowns", 6, 1), ("opposed", 10, 3), ("opposed", 40, 5)])
def test_slices_of_a_budget_end_with_the_answer_of_one_solve(kind, seed, budget):
    """One iteration is less than a step; `opposed` has sides that cancel, up to rounding."""
    h, part = structured(460_000_000 + seed, (kind,)), make("hcod", max_iterations=budget)
    res, slices = part.solve(h), 1
    while res.status is Status.ITERATION_LIMIT and slices < 400:
        res, slices = part.solve(h, res.memory), slices + 1
    assert (res.status, slices > 1) == (Status.SOLVED, True)
    np.testing.assert_allclose(res.x, HCOD.solve(h).x, atol=1e-9)


@pytest.mark.parametrize("seed", [5, 9])
def test_the_levels_are_passed_from_a_memory_that_violates_nothing(seed):
    """Some 40 rows act, of which two leave; from nothing it takes 58 and 86 steps."""
    h = structured(seed, ("sixty_unknowns",))
    shift = 0.01 * np.random.default_rng(seed).normal(size=h.m)
    moved = h.changed(lower=h.lower + shift, upper=h.upper + shift)
    cold, warm = HCOD.solve(moved), HCOD.solve(moved, HCOD.solve(h).memory)
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-12 * np.abs(cold.x).max())
    assert warm.iterations < 10 < 50 < cold.iterations


def test_a_solved_answer_is_verified_from_its_active_rows_and_no_other_is():
    for seed in range(700, 740):
        h = structured(seed)
        res = HCOD.solve(h)
        assert res.verified(h) == (res.status is Status.SOLVED)
    BOX = Hierarchy.from_levels([(np.eye(3), np.full(3, -1.0), np.ones(3)),
                                 ([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]], [5.0, 0.5])])
    res = HCOD.solve(BOX)
    none = res.memory.copy()
    none[:BOX.m] = 0.0
    assert res.verified(BOX)
    assert not res.verified(BOX.changed(upper=BOX.upper + 0.1 * (BOX.upper > BOX.lower)))
    for x, memory in ((res.x + 1e-6, res.memory), (res.x, none)):
        assert not type(res)(x, res.status, memory).verified(BOX)
    refused("certify(h, x)", make("weighted").solve(BOX).verified, BOX.changed(metric=np.eye(3)))
    fewer = BOX.upper_part(1)
    refused("verified: active has shape (5,), expected (3,)", res.verified, fewer)
    refused("explain: active has shape (5,), expected (3,)", explain, fewer, res)
    refused("rank_tolerance = nan", res.verified, BOX, rank_tolerance=np.nan)


X, Y, TURN = ([[1.0, 0.0]], [0.0]), ([[0.0, 1.0]], [0.0]), np.arange(4) * np.pi / 2.0
EXPLAINED = {
    "a box": ([(np.eye(2), [-1.0] * 2, [1.0] * 2), ([[1.0, 0.5]], [3.0])],
              ["level 1 is met.", "level 2 is missed by 1.5: held back by level 1 row 0 at its "
               "upper side and row 1 at its upper side."]),
    "a box in which a thruster is stuck": (
        [(np.eye(2), [-1.0, 0.5], [1.0, 0.5]), ([[1.0, 0.5]], [3.0])],
        ["level 1 is met.", "level 2 is missed by 1.75: held back by level 1 row 0 at its upper "
         "side and row 1 (fixed)."]),
    "equalities, and rows that disagree": (
        [([[1.0, 0.0]], [1.0]), ([[1.0, 0.0]], [2.0]), (np.zeros((0, 2)), []),
         ([[0.0, 1.0], [0.0, 1.0]], [0.0, 1.0])],
        ["level 1 is met.", "level 2 is missed by 1: held back by level 1.",
         "level 3 has no rows.", "level 4 is missed by 0.707: its own rows disagree."]),
    "rows that disagree below others that do not hold them back": (
        [([[1.0, 1.0]], [0.0]), ([[1.0, 0.0]] * 3, [0.1, 0.2, 0.4])],
        [..., "level 2 is missed by 0.216: its own rows disagree."]),
    "a level that carries next to nothing is left out": (
        [X, Y, ([[1e-8, 1.0]], [1.0])],
        [..., ..., "level 3 is missed by 1: held back by level 2."]),
    "a level that carries a little": (
        [X, Y, ([[1e-4, 1.0]], [1.0])],
        [..., ..., "level 3 is missed by 1: held back by level 1 and level 2."]),
    "a row at its side for a level above": (
        [(np.eye(2)[:1], [-np.inf], [1.0]), ([[1.0, 1.0]], [3.0]), ([[1.0, 0.0]], [5.0]),
         ([[1.0, 0.2]], [9.0])],
        [..., "level 2 is met.", "level 3 is missed by 4: held back by level 1 at its upper side.",
         "level 4 is missed by 7.6: held back by level 2 and level 3."]),
    "rows that give by rounding, 1e-16 of 0": (
        [(np.array([np.cos(TURN), np.sin(TURN)]).T, [-np.inf] * 4, [-0.5] * 4),
         (np.eye(2), [1.0, 0.0])],
        ["level 1 is missed by 1, of which 1 cannot be avoided.", ...], [0.0, 0.2, 0.0, 0.0], 0.0),
    "no joint moves it: singular": (
        [([[0.0, 0.0], [0.6, 0.3], [0.8, 0.4]], [-0.5, 0.6, 0.8])],  # x, y, z of a straight arm
        ["level 1 is missed by 0.5: singular here: no joint moves level 1 along row 0."])}


@pytest.mark.parametrize("case", EXPLAINED)
def test_explain_says_what_holds_a_level_back(case):
    levels, said, *give = EXPLAINED[case]
    h = Hierarchy.from_levels(levels, give=give or None)
    lines = explain(h, HCOD.solve(h)).splitlines()
    assert lines == [line if words is ... else words
                     for line, words in zip(lines, said, strict=True)]


def test_rows_whose_sides_cross_are_all_that_is_said():
    h = Hierarchy.from_levels([(np.eye(2), [0.0, 0.0], [1.0, 1.0])], names=["box"])
    h.lower[1] = 2.0
    res = HCOD.solve(h)
    assert res.status is Status.NUMERICAL_FAILURE
    assert explain(h, res) == "box row 1: no value lies between lower 2 and upper 1"
    h.lower[1], h.A[0, 0] = 0.0, np.nan  # "box is met."
    assert explain(h, HCOD.solve(h)) == str(Status.NUMERICAL_FAILURE)


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


def test_with_damping_a_row_that_acts_is_at_its_side_or_beyond():
    """One that was missed acted for good, also where levels below had met it."""
    recipe = Recipe(joints=(1, 14), levels=(1, 6), rows=(1, 9))
    for seed in (141, 153, 1141):
        h = generate(seed, recipe)
        res = solved(make("hcod", damping=0.05), h)
        value, norms = h.A @ res.x, np.linalg.norm(h.A, axis=1)
        inside = np.where(res.active == 1, h.upper - value, value - h.lower)
        assert (inside <= 1e-8 * norms)[np.abs(res.active) == 1].all()


def test_a_row_of_zeros_does_not_end_the_damping_of_its_level():
    """It made bounds of targets for single unknowns, which are not damped."""
    A, asked = np.array([[1e-3, 0.0], [0.0, 1.0]]), np.array([1.0, 1.0])
    bound, zeros = ([[0.0, 1.0]], [-np.inf], [0.5]), np.vstack([A, np.zeros((1, 2))])
    x = [solved(make("hcod", damping=0.1), Hierarchy.from_levels([bound, level])).x for level in (
        (A, asked), (zeros, [*asked, -1.0], [*asked, 1.0]))]
    np.testing.assert_allclose(x[1], x[0], rtol=1e-12)
    assert x[0][0] < 1.0


def test_damped_x_does_not_hang_on_rounding_where_a_task_lies_along_an_exceeded_row():
    """What was left of the task, 1e-16, counted as a row; x moved by 1e-3."""
    a, b = np.random.default_rng(10).normal(size=(2, 1, 3))
    x = [solved(make("hcod", damping=0.1, threshold=3.0), Hierarchy.from_levels([
        (a, [-np.inf], [0.2]), (a * (1.0 + 1e-12 * k), [1.0]), (b, [1.0])])).x for k in range(9)]
    np.testing.assert_allclose(x, [x[0]] * 9, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("power", [-480, 280, 330, 500])
def test_a_factor_of_all_rows_changes_nothing(power):
    """From 1e85 on the weight of a level that sets all of x overflowed: INACCURATE."""
    for h in map(structured, (21, 46, 66, 211)):
        other = Hierarchy.from_levels([(np.ldexp(A, power), np.ldexp(lower, power),
                                        np.ldexp(upper, power)) for A, lower, upper in h.levels()],
                                      h.reference)
        res, again = HCOD.solve(h), HCOD.solve(other)
        assert (again.status, again.iterations, *again.x) == (res.status, res.iterations, *res.x)
