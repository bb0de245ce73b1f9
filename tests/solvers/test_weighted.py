"""Priorities as weights, merged levels with a memory, and the cascade of quadratic programs."""

import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest
from rank_cases import CASES, boxed, build, family, solved
from refusals import refused

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make
from solvers.qp import backends, programs, refinement
from solvers.resolvers import merged
from solvers.resolvers.weighted import lexicographic_weights


def by_hand(h, strict, weights, mu=0.0, y=0.0):
    """Levels that stay strict, and below them one of weighted rows at sides moved by y (m,).

    With a row mu (x - reference) for each unknown that none of its equalities names alone.
    """
    first, w = h.offsets[strict], np.repeat(weights, h.sizes[strict:])
    A, equal = h.A[first:], (h.lower == h.upper)[first:]
    named = (A[equal & (np.count_nonzero(A, axis=1) == 1)] != 0.0).any(axis=0)
    drawn = mu * np.eye(h.n)[~named]
    sides = [np.r_[w * (side + y)[first:], drawn @ h.reference] for side in (h.lower, h.upper)]
    return Hierarchy.from_levels([*[*h.levels()][:strict], (
        np.vstack([w[:, None] * A, drawn]), *sides)], h.reference)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("ratio", [1.0, 10.0, 1e3])
def test_within_limits_it_is_the_minimiser_and_shown_to_be(case, ratio):
    h = boxed(build(case, True), -0.7, 0.7)
    weights = ratio ** np.arange(len(h.sizes) - 2, -1, -1.0)
    x = solved(make("weighted", ratio=ratio), h).x
    assert certify(by_hand(h, 1, weights), x).optimal


def test_lexicographic_weights_are_the_smallest_that_do():
    assert lexicographic_weights([5.0, 3.0, 4.0], 0.1) == pytest.approx((
        np.hypot(4.0, 40.0 * 3.0) / 0.1, 40.0, 1.0))
    assert lexicographic_weights([0.0, 0.0], 0.1) == (1.0, 1.0)
    assert lexicographic_weights([0.0, 0.0], 0.1, regularised=1.0) == (10.0, 1.0)
    for wrong in ([[1.0, 2.0]], [1.0, -1.0], [np.nan], 1.0):
        refused("expected numbers >= 0, one per level", lexicographic_weights, wrong, 0.1)
    refused("not an array of numbers", lexicographic_weights, ["1"], 0.1)
    refused("tolerance = None", lexicographic_weights, [1.0], None)


def test_a_top_level_with_an_inequality_is_strict_and_the_last_level_never_is():
    box, wish = (np.eye(2), [-1.0] * 2, [1.0] * 2), ([[1.0, 1.0]], [9.0])
    for low in (0.0, 1.0):  # also where the sides of a limit have met
        h = Hierarchy.from_levels([(np.eye(2), [low, -1.0], [1.0, 1.0]), wish])
        assert h.violations(make("weighted", ratio=3.0).solve(h).x)[0] < 1e-9
    alone = Hierarchy.from_levels([box], [3.0, 0.5])
    np.testing.assert_allclose(make("weighted").solve(alone).x, [1.0, 0.5], atol=1e-9)
    refused("weighted: all levels stay strict", make("weighted", strict_levels=-1).solve, alone)
    refused("2 weights for 3 levels", make("weighted", weights=(2.0, 1.0)).solve,
            build("generic", True))


@pytest.mark.parametrize("name", backends.BACKENDS)
def test_a_backend_that_is_not_installed_names_what_brings_it(name, monkeypatch):
    backends.installed.cache_clear()
    monkeypatch.setitem(sys.modules, backends.BACKENDS[name].module, None)
    extra = "scenarios" if name in ("proxqp", "osqp") else "qp"
    with pytest.raises(HierarchyError, match=rf"'{name}' is not .* 'task-hierarchy\[{extra}\]'$"):
        make("hqp", backend=name)
    backends.installed.cache_clear()


@pytest.mark.parametrize(("vouched", "status"), [(False, Status.BACKEND_FAILURE),
                                                 (True, Status.INACCURATE)])
def test_an_answer_that_cannot_be_shown_right_leaves_the_levels_above(vouched, status, monkeypatch):
    monkeypatch.setattr(programs.Program, "solve", lambda *_: (np.full(9, 0.1), vouched))
    monkeypatch.setattr("solvers.resolvers.hqp.refined", lambda *_: None)
    res = make("hqp").solve(Hierarchy.from_levels([
        ([[1.0, 0.0]], [2.0]), (np.eye(2), [-1.0, 3.0], [1.0, 4.0])]))
    assert res.status is status
    np.testing.assert_allclose(res.x, [2.0, 0.0], rtol=0.0, atol=3.0 * make("hqp").accuracy)


def test_a_program_of_small_weights_and_wide_sides_is_not_taken_for_infeasible():
    """As of forces that may be 1e4 N, of which a level that is little sees a part."""
    rng = np.random.default_rng(4)
    A, wide = rng.normal(size=(30, 12)), np.full(30, 1e4)
    goal = refinement.Rows(1e-2 * rng.normal(size=(3, 12)), *[np.array([40.0, -300.0, 20.0])] * 2)
    y, vouched = programs.null_space_program(
        goal, refinement.Rows.none(12), refinement.Rows(A, -wide, 1e-2 * wide), 0.0, None
    ).solve(backends.backend_of("proxqp"))
    assert vouched
    assert (A @ y <= 1e2 + 1e-3).all()


def test_osqp_does_not_look_for_its_builds_at_each_program_whichever_backend_came_first():
    code = ("import numpy as np, solvers, hierarchy\n"
            "h = hierarchy.Hierarchy.from_levels([(np.eye(2), [1.0, 2.0])])\n"
            "solvers.make('hqp').solve(h)\n"
            "import osqp.interface\nassert osqp.interface.OSQP_ALGEBRA_BACKEND == 'builtin'")
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_backend_that_raises_is_a_status_and_the_level_of_limits_is_kept(monkeypatch):
    monkeypatch.setattr("qpsolvers.solve_problem", lambda *_, **__: 1 / 0)
    monkeypatch.setattr("solvers.qp.refinement._Refinement.projected", lambda _, z: z)
    monkeypatch.setattr("solvers.qp.refinement.REFINEMENTS", 5)  # more do without a backend
    h = next(iter(family("HUM38")))[0]
    res = make("hqp", backend="proxqp").solve(h)
    assert res.status is Status.BACKEND_FAILURE
    assert np.isfinite(res.x).all()
    assert h.violations(res.x)[0] < 1e-8


def test_solves_in_two_threads_leave_the_filters_of_warnings_as_they_were(monkeypatch):
    filters, calls, entered, left = list(warnings.filters), [], Event(), Event()

    def call(*_, **__):  # the first waits for the second, which ends after it
        calls.append(1)
        if len(calls) == 2:
            entered.set()
        (left if entered.is_set() else entered).wait(0.2)
        raise ValueError

    monkeypatch.setattr("qpsolvers.solve_problem", call)
    none = refinement.Rows.none(1)
    program = programs.null_space_program(none, none, none, 1.0, None)

    def solve(_):
        program.solve(backends.backend_of("proxqp"))
        left.set()

    with ThreadPoolExecutor(2) as threads:
        list(threads.map(solve, range(2)))
    assert warnings.filters == filters


@pytest.mark.parametrize("rows", [
    ([[0, 0, 1e3], [0, 0, 1e-3], [2.7067129e-4, 8.9151391e-4, 3.6323543e-4]],
     [-np.inf, -1e-3, 0.0], [1e3, -1e-3, 1e-3]),
    ([[669.71, -52.95, -740.73], [-6.1103e-4, 5.5851e-4, 5.6098e-4], [405.35, 359.46, -840.52]],
     [-2000.0, 0.0, -2000.0], [-2000.0, 1e-3, -2000.0])])
def test_a_row_a_million_times_smaller_than_its_neighbours_is_met_as_they_are(rows):
    h = Hierarchy.from_levels([rows, (np.eye(3), np.zeros(3))])
    found = solved(make("hqp"), h)
    np.testing.assert_allclose(h.slacks(found.x)[:3] / np.linalg.norm(h.A[:3], axis=1), 0.0,
                               atol=1e-9)
    assert certify(h, found.x).certified


@pytest.mark.parametrize(("z", "rows", "expected"), [
    (np.zeros(2), ([[-0.5, 0.0], [1.0, 0.0]], [-1.0, -1.0], [-0.5, 0.5]), [0.6, 0.0]),
    ([-8e-11 - 1.0, 0.0, 0.0], ([[-1.0, 1.0, 1.0]] * 2, [-np.inf, 1.0], [1.0, np.inf]), [-1, 0, 0])
])
def test_refinement_does_not_circle_and_meets_rows_that_are_missed_by_rounding(z, rows, expected):
    limits, none = refinement.Rows(*map(np.array, rows)), refinement.Rows.none(len(expected))
    found, _ = refinement.refined(np.array(z), none.A, none.lower, limits, none, 1e-8)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10)


# -- `merged`: strict limits, one weighted level with a memory ------------------------------------
def arm(seed, limit=0.6, size=1.0):
    """Physics, a box and a wall, two tasks that conflict, a cone between them, and a posture."""
    random = np.random.default_rng(seed)
    goals = [(random.normal(size=(m, 6)), size * random.normal(size=m)) for m in (1, 4)]
    physics, wall, cone = random.normal(size=(3, 1, 6))
    return Hierarchy.from_levels([
        (physics, [0.0]), (np.eye(6), [-limit] * 6, [limit] * 6), (wall, [-limit], [np.inf]),
        goals[0], (cone, [-np.inf], [-size]), goals[1], (np.eye(6)[:5], [0.3] * 5)],
        random.normal(size=6))


@pytest.mark.parametrize(("resolver", "strict", "weights", "cap"), [
    (make("merged"), 3, [64, 16, 4, 1], [1, 1, 1, 0]),
    (make("merged", ratio=3.0, step=0.5, cap=0.2, scales={"level 5": 2.0}), 3, [27, 4.5, 3, 1],
     [0.2, 0.4, 0.2, 0]),
    (make("merged", strict_levels=2, ratio=1.0, cap=0.3), 2, [1] * 5, [0.3, 0.3, 0.3, 0.3, 0]),
    (make("weighted", ratio=3.0), 0, [729, 243, 81, 27, 9, 3, 1], [0] * 7),
    (make("weighted", ratio=10.0, strict_levels=-1), 3, [1e3, 1e2, 10, 1], [0] * 4),
    (make("weighted", strict_levels=3, weights=[9.0, 4.0, 2.0, 0.5]), 3, [9, 4, 2, 0.5], [0] * 4)],
    ids=lambda one: getattr(one, "label", ""))
def test_merged_levels_are_one_of_weighted_rows_whose_sides_move_by_what_was_missed(
        resolver, strict, weights, cap):
    for seed in range(20):
        h, memory = arm(seed), None
        y, most = np.zeros(h.m), np.repeat([*[0.0] * strict, *cap], h.sizes)
        for _ in range(4):
            found = solved(resolver, h, memory)
            expected = by_hand(h, strict, weights, resolver.regularisation, y)
            np.testing.assert_allclose(found.x, make("hcod").solve(expected).x, atol=1e-9)
            value = h.A @ found.x
            miss = np.clip(value - y, h.lower, h.upper) - value
            y += getattr(resolver, "step", 1.0) * np.clip(miss, -most, most)
            y = np.clip(y, -most, most)
            np.testing.assert_allclose(found.carried, y, atol=1e-9)
            assert found.active.shape == (h.m,)
            memory = found.memory


def test_at_rest_upper_levels_are_met_as_under_strict_priorities():
    h, resolver = arm(0, limit=5.0, size=0.2), make("merged")
    strict, found = make("hcod").solve(h).x, solved(resolver, h)
    assert h.violations(found.x)[3] > 1e-4, "the memory has nothing to do"
    for _ in range(3000):
        found = solved(resolver, h, found.memory)
    np.testing.assert_allclose(found.x, strict, atol=1e-8)


def test_another_thread_never_sees_weights_that_are_not_written_yet(monkeypatch):
    resolver, write, known = make("merged"), merged.write_levels, []
    monkeypatch.setattr(merged, "write_levels", lambda *given: (
        known.append(dict(resolver._known)), write(*given)))
    resolver.solve(Hierarchy.from_levels([([[1.0]], [1.0])]))
    assert known == [{}]


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
