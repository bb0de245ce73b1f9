"""Levels that give, and the distance to the reference in a metric."""

from functools import partial

import numpy as np
import pytest
from rank_cases import solved
from refusals import refused

from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State
from hierarchy.paths import Still
from hierarchy.tasks import LookAt, Position, Posture
from solvers import Resolution, Resolver, Status, certify, explain, make, names
from solvers.batch import Batch
from solvers.give import _joined, _split, giving
from solvers.problems import generate, structured


def problem(seed, give):
    """Levels that cannot all be met: two equalities, a conflict with them, a box, a posture."""
    rng = np.random.default_rng(seed)
    A, B, C = (rng.normal(size=(m, 6)) for m in (2, 3, 3))
    B[2] = A[0] + A[1]  # which conflicts with the level above
    return Hierarchy.from_levels(
        [(A, rng.normal(size=2)), (B, rng.normal(size=3)), (C, np.full(3, -0.5), np.full(3, 0.5)),
         (np.eye(6), rng.normal(size=6))], give=[0.0, give, 0.0, 0.0])


@pytest.mark.parametrize("resolver", [make("hcod"), make("hqp", backend="proxqp"),
                                      make("hqp", backend="daqp")], ids=lambda one: one.label)
@pytest.mark.parametrize("seed", range(2))
def test_a_level_gives_up_to_what_it_may_and_those_below_gain(resolver, seed):
    strict, soft = problem(seed, 0.0), problem(seed, [0.3, 0.1, 0.2])
    before, res = solved(resolver, strict), solved(resolver, soft)
    assert before.witnesses is None
    assert certify(soft, res.x, 1e-6, witnesses=res.witnesses).certified
    rows = slice(2, 5)
    allowed = np.abs(strict.slacks(before.x)[rows]) + np.array([0.3, 0.1, 0.2])
    assert (np.abs(soft.slacks(res.x)[rows]) <= allowed + 1e-7).all()
    assert np.abs(np.abs(soft.slacks(res.x)[rows]) - allowed).min() < 1e-7  # and a row uses it
    np.testing.assert_allclose(soft.violations(res.x)[0], strict.violations(before.x)[0], atol=1e-8)
    lower, were = soft.violations(res.x)[2:], strict.violations(before.x)[2:]
    first = int(np.argmax(np.abs(lower - were) > 1e-6))
    assert lower[first] < were[first] - 1e-3


@pytest.mark.parametrize("metric", [None, np.eye(6)], ids=["one call", "in parts"])
@pytest.mark.parametrize("most", [1, 2])
def test_a_search_for_a_witness_goes_on_from_where_the_limit_ended_it(metric, most):
    """It began anew with each solve, and never ended."""
    for seed in range(8):
        h, resolver, memory = problem(seed, 0.1), make("hcod", max_iterations=most), None
        h.metric = metric
        for _ in range(40):
            res = resolver.solve(h, memory)
            memory = res.memory
            assert res.status is Status.SOLVED or "iteration limit" in explain(h, res)
        np.testing.assert_allclose(res.x, make("hcod").solve(h).x, atol=1e-9)


def test_solves_that_share_a_working_set_answer_as_separate_ones():
    hcod, memory, h = make("hcod"), None, problem(5, [0.3, 0.1, 0.2])
    h.give = np.where(np.arange(h.m) < 8, h.give + 0.1, 0.0)  # three levels
    for step in np.random.default_rng(5).normal(scale=0.3, size=(20, h.m)):
        moved = h.changed(lower=h.lower + step, upper=h.upper + step)
        res, apart = hcod.solve(moved, memory), giving(hcod.solve, moved, moved.giving, None)
        assert (res.status, apart.status) == (Status.SOLVED, Status.SOLVED)
        np.testing.assert_allclose(res.x, apart.x, atol=1e-10)
        np.testing.assert_allclose(res.witnesses, apart.witnesses, atol=1e-10)
        memory = res.memory


@pytest.mark.parametrize(("made", "most"), [
    (generate, 60), (partial(structured, kinds=["tiny_rows"]), 53)])
@pytest.mark.parametrize("rows", [True, False])
def test_generated_hierarchies_are_certified_some_of_whose_levels_give(made, most, rows):
    solved = 0
    for seed in range(7_000_030, 7_000_090):
        h, random = made(seed), np.random.default_rng(seed)
        h.give = 0.1 * random.random(h.m) if rows else np.repeat(
            random.choice([0.0, 0.1, 1.0], len(h.sizes)), h.sizes)
        res = make("hcod").solve(h)
        if res.status is Status.SOLVED:
            assert certify(h, res.x, 1e-6, witnesses=res.witnesses).certified, seed
            solved += 1
    assert solved >= most


@pytest.mark.parametrize("wrong", ["x", "witness"])
def test_the_certificate_rejects_another_x_and_a_witness_that_misses_more(wrong):
    h = problem(3, 0.2)
    res = make("hcod").solve(h)
    x, witnesses = res.x.copy(), res.witnesses.copy()
    (x if wrong == "x" else witnesses[0])[:] += 1e-3
    assert not certify(h, x, witnesses=witnesses).certified
    assert not certify(h, make("hcod").solve(problem(3, 0.0)).x, witnesses=res.witnesses).certified
    refused("1 levels give, so witnesses must be (1, 6)", certify, h, res.x)


@pytest.mark.parametrize("resolver", [make("hcod"), make("hcod", damping=0.1), make("hqp")],
                         ids=lambda one: one.label)
@pytest.mark.parametrize(("array", "wrong"), [("give", np.nan), ("give", -1.0), ("A", np.nan)])
def test_where_a_part_has_no_answer_the_whole_has_none(resolver, array, wrong):
    h = problem(0, 0.1)
    memory = resolver.solve(h).memory
    getattr(h, array).flat[3] = wrong
    for res in (resolver.solve(h), resolver.solve(h, memory)):
        assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)
        assert res.memory is None or array == "give"
        assert res.active is None or 1 not in np.abs(res.active)


def test_memories_of_several_solves_are_one_array_and_what_is_no_such_array_is_the_last():
    joined = _joined([np.array([1.0, 2.0]), None, np.array([3.0])])
    assert [part.tolist() for part in _split(joined, 3)] == [[1.0, 2.0], [], [3.0]]
    for end in (-1.0, 0.0, 2.0, 7.0):
        other = np.r_[joined[:-1], end]
        assert _split(other, 3)[:2] == [None, None]
        assert _split(other, 3)[2] is other
    assert _split(np.zeros(3), 3)[0].size == 0
    assert _split(np.zeros(2), 3)[0] is None


def test_what_cannot_give_refuses_by_name():
    h = problem(1, 0.1)
    for resolver in map(make, set(names()) - {"hcod", "hqp"}):
        with pytest.raises(HierarchyError, match=r"level 2: it gives, .* has none \(hcod, hqp\)"):
            resolver.solve(h)
    refused("problem 0 gives", Batch.of, [h])


def test_a_stack_takes_it_by_the_name_of_a_task_in_any_order():
    robot = Robot.named("kuka_lwr")
    state = State.at(robot, np.full(7, 0.3))
    hand = Position(robot.frame("end_effector"), Still((0.3, 0.3, 0.6)))
    stack = Stack([hand, Posture((0.1,) * 7)], "velocity", give={"position": [0.1, 0.0, 0.0]})
    h = stack.hierarchy(state)
    np.testing.assert_array_equal(h.give, [0.1, *np.zeros(9)])
    swapped = stack.hierarchy(state, ("posture", "position"))
    np.testing.assert_array_equal(swapped.give, [*np.zeros(7), 0.1, 0.0, 0.0])
    without = stack.hierarchy(state, ("posture",))
    assert (without.give, without.giving) == (None, [])
    assert np.abs(h.slacks(make("hcod").solve(h).x)[:3]).max() == pytest.approx(0.1)
    stack.remove("position")
    stack.insert(LookAt(hand.frame, (0.3, 0.9, 1.4), name="position"))  # of two rows
    refused("task 'position': give has shape (3,), expected one number or (2,)", stack.hierarchy,
            state)
    for give, said in (({"position": [0.1, 0.2]}, "task 'position': give has shape"),
                       ({"positon": 0.1}, "positon")):
        refused(said, Stack, [hand], "velocity", give=give)


def test_explain_says_what_gives_how_much_and_for_whom():
    levels = [(np.array([[1.0, 1.0]]), [1.0]), (np.array([[1.0, 0.9]]), [2.0]),
              (np.eye(2), [0.0, 0.0])]
    words = {"rows": ["x", "e", "joint 1", "joint 2"], "units": ["m/s^2"] * 2 + ["rad/s^2"] * 2}

    def said(*give):
        h = Hierarchy.from_levels(levels, give=give, names=["hand", "elbow", "posture"])
        return explain(h, make("hcod").solve(h), **words).splitlines()

    hand, elbow, posture = said(0.05, 0.5, 0.0)
    assert hand == "hand is missed by 0.05: x gives 0.05 of 0.05 m/s^2 for posture."
    assert elbow == "elbow is missed by 0.5: e gives 0.5 of 0.5 m/s^2 for posture."
    assert posture.endswith("held back by hand (gives no more) and elbow (gives no more).")
    hand, elbow, posture = said(0.05, 50.0, 0.0)  # more than the posture has a use for
    assert elbow == "elbow is missed by 1.1: e gives 1.1 of 50 m/s^2 for the levels below."
    assert posture.endswith("held back by hand (gives no more).")
    assert said(0.0, 0.5, 0.0)[0] == "hand is met."
    h = problem(1, 0.1)
    refused("explain: 1 units for 14 rows", lambda: explain(h, make("hcod").solve(h), units=["m"]))


@pytest.mark.parametrize("metric", [None, np.eye(2)], ids=["one call", "in parts"])
def test_explain_says_where_the_limit_was_before_a_witness_was_found(metric):
    h = Hierarchy.from_levels([(np.eye(2), [-1.0] * 2, [1.0] * 2), ([[1.0, 1.0]], [9.0]),
                               ([[1.0, 0.0]], [-5.0])], give=[0.0, 0.5, 0.0], metric=metric)
    found = make("hcod", max_iterations=1).solve(h)
    assert "limit was reached at 'level 2'" in explain(h, found).splitlines()[-1]


EVERY_STRICT = [make(name) for name in names() if make(name).strict]
INEQUALITIES = [r for r in EVERY_STRICT if r.handles == "inequalities"]
BOUNDS = [r for r in EVERY_STRICT if r.handles == "bounds"]


def metric(rng, n):
    """A metric whose eigenvalues are 0.01 to 100."""
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return (Q * np.geomspace(0.01, 100.0, n)) @ Q.T


def closed_form(levels, reference, W):
    """Level by level with weighted pseudoinverses, by another route than a change of variables.

    x + N z with N a basis of the freedom left; the last step is the one of least z^T N^T W N z.
    """
    x, N = np.zeros(len(W)), np.eye(len(W))
    for A, b in levels:
        U, s, Vt = np.linalg.svd(A @ N)
        rank = int((s > 1e-10).sum())
        x = x + N @ (Vt[:rank].T @ ((U[:, :rank].T @ (b - A @ x)) / s[:rank]))
        N = N @ Vt[rank:].T
    return x + N @ np.linalg.solve(N.T @ W @ N, N.T @ W @ (reference - x))


@pytest.mark.parametrize("resolver", EVERY_STRICT, ids=lambda r: r.label)
def test_the_answer_is_the_nearest_in_the_metric(resolver):
    rng = np.random.default_rng(1)
    for _ in range(5):
        A = [rng.normal(size=(m, 7)) for m in (2, 2, 1)]
        A[1][0] = A[0][1]  # with another target
        levels = [(rows, rng.normal(size=len(rows))) for rows in A]
        W, reference = metric(rng, 7), rng.normal(size=7)
        h = Hierarchy.from_levels(levels, reference, metric=W)
        res = solved(resolver, h)
        expected = closed_form(levels, reference, W)
        np.testing.assert_allclose(res.x, expected, atol=100.0 * resolver.accuracy)
        assert certify(h, res.x, 1e-6).certified
        without = Hierarchy.from_levels(levels, reference)
        np.testing.assert_allclose(h.violations(res.x), without.violations(expected), atol=1e-7)


@pytest.mark.parametrize("resolver", INEQUALITIES + BOUNDS, ids=lambda r: r.label)
def test_inequalities_are_resolved_in_a_metric_and_bounds_if_it_is_diagonal(resolver):
    rng, half = np.random.default_rng(4), 3.0 if resolver in BOUNDS else 0.3
    for _ in range(5):
        W, reference, A = metric(rng, 6), rng.normal(size=6), rng.normal(size=(3, 6))
        box = np.eye(6), np.full(6, -half), np.full(6, half)
        h = Hierarchy.from_levels([box, (A, rng.normal(size=3))], reference, metric=W)
        if resolver in BOUNDS:
            with pytest.raises(HierarchyError, match=r"level 1, row 0: an inequal.*a bound on one"):
                resolver.solve(h)
            h = h.changed(metric=np.diag(np.diag(W)))
        res, exact = solved(resolver, h), make("hcod").solve(h)
        assert certify(h, exact.x).certified
        np.testing.assert_allclose(res.x, exact.x, atol=1e-6)
        np.testing.assert_allclose(resolver.solve(h, res.memory).x, exact.x, atol=1e-6)


def test_in_a_metric_the_memory_of_a_plugin_stays_as_it_is():
    class Own(Resolver):
        name = "own"

        def solve(self, h, memory=None):
            x = make("tpm").solve(h).x
            return Resolution(x, memory=x)

    res = Own().solve(Hierarchy.from_levels([([[1.0, 2.0]], [1.0])], metric=np.diag([4.0, 1.0])))
    np.testing.assert_allclose(res.memory, [2.0 * res.x[0], res.x[1]])
