"""What every resolver promises, on rank cases. A new resolver is picked up by name.

Of the product of resolvers and cases a third is tested, which has every resolver and every case.
"""

import copy
import dataclasses
import gc
import os
import pickle
import tracemalloc
from itertools import product

import numpy as np
import pytest
from rank_cases import CASES, boxed, build, family, gap, moved, random_levels, rng, solved
from refusals import refused

from benchmark.solve import oracle
from hierarchy import Hierarchy, HierarchyError
from scenarios.problems import recorded as families
from solvers import Status, certify, make, names
from solvers.qp.backends import BACKENDS
from solvers.workspace import WORKSPACE

HQP = [make("hqp", backend=name, form=form)
       for name in BACKENDS for form in ("null-space", "slack")]
RESOLVERS = [*(make(name) for name in names() if name != "hqp"), make("tpm-published"),
             *(make("recursive", method=name) for name in ("nakamura", "chiaverini", "selective")),
             make("sns", form="optimal"), make("reverse", form="in-order"), *HQP]
STRICT = [r for r in RESOLVERS if r.strict]
INEQUALITIES = [r for r in STRICT if r.handles == "inequalities"]
EQUALITIES_ONLY = [r for r in RESOLVERS if r.handles == "equalities"]
BOUNDS = [r for r in RESOLVERS if r.handles == "bounds"]
PROBLEMS = 3 if os.environ.get("NUMBA_DISABLE_JIT") == "1" else 50
SLOW = 6  # problems of a family for a cascade: the rest is in the benchmark


def every(resolvers):
    return pytest.mark.parametrize("resolver", resolvers, ids=lambda r: r.label.replace(" ", "-"))


def on_cases(resolvers, share=3):
    """A part of all pairs of a resolver and a rank case."""
    pairs = [(resolver, case) for i, resolver in enumerate(resolvers)
             for j, case in enumerate(CASES) if (i + j) % share == 0]
    return pytest.mark.parametrize(("resolver", "case"), pairs, ids=[
        f"{resolver.label.replace(' ', '-')}-{case}" for resolver, case in pairs])


def assert_close(resolver, x, expected):
    assert np.abs(x - expected).max() <= resolver.accuracy * (1.0 + np.abs(expected).max())


@on_cases(STRICT, 1)
def test_strict_resolvers_find_the_oracles_answer(resolver, case):
    for reference in (False, True):
        h = build(case, reference)
        assert_close(resolver, solved(resolver, h).x, oracle.solve(h))


@pytest.mark.parametrize(("resolver", "name"), [
    *product(STRICT, families.EQUALITIES), *product(INEQUALITIES, families.INEQUALITIES)],
    ids=lambda one: getattr(one, "label", one))
def test_strict_resolvers_are_right_at_every_level_of_the_families(resolver, name):
    """Those that call somebody else's solver may say of inequalities that they are not."""
    close = max(1e-8 if name == "DEGEN7" else 0.0, resolver.accuracy)  # of rows parallel to 1e-9
    for h, x, norms in list(family(name))[:SLOW if resolver in HQP else PROBLEMS]:
        res = resolver.solve(h)
        if res.status is Status.SOLVED:
            assert gap(h.violations(res.x), norms) <= close
            assert gap(res.x, x) <= close
            assert certify(h, res.x, 10.0 * resolver.accuracy).certified
        else:
            assert resolver in HQP
            assert name in families.INEQUALITIES


@on_cases(RESOLVERS)
def test_a_solve_depends_on_its_input_alone_and_leaves_it_as_it_is(resolver, case, monkeypatch):
    """Not on what was left in the work space, which grows, nor on a copy having solved before."""
    for bounded, damping in product({False, resolver.handles != "equalities"}, (0.0, 0.1)):
        h, same = (boxed(build(case, True), -0.3, 0.3) if bounded else build(case, True)
                   for _ in range(2))
        monkeypatch.setattr(WORKSPACE, "array", np.empty(1))
        one = dataclasses.replace(resolver, damping=damping)
        first, copied = one.solve(h), pickle.loads(pickle.dumps(one))
        assert (copied, copied.handles) == (one, one.handles)
        assert repr(pickle.loads(pickle.dumps(first))) == repr(copy.copy(first)) == repr(first)
        assert first.x.shape == (h.n,)
        assert np.isfinite(first.x).all()
        monkeypatch.setattr(WORKSPACE, "array", np.resize([np.nan, np.inf, 1e300], 100_000))
        again = copied.solve(h)
        assert first.x is not again.x
        if resolver in HQP:  # some backends depend on where in memory numpy put the program
            assert_close(resolver, again.x, first.x)
        else:
            assert np.array_equal(first.x, again.x)
        for kept, given in zip((*h.rows, h.reference), (*same.rows, same.reference), strict=True):
            assert np.array_equal(kept, given)


@on_cases([r for r in STRICT if r.damps == "each level"])
def test_damping_means_the_same_to_every_strict_resolver(resolver, case):
    h = build(case, True)
    for threshold in (0.1, 3.0):
        damped = dataclasses.replace(resolver, damping=0.05, threshold=threshold)
        assert_close(resolver, damped.solve(h).x, oracle.solve(h, 0.05, threshold))


def test_resolvers_whose_damping_means_something_else_say_so():
    assert {r.label for r in RESOLVERS if r.damps != "each level"} == {
        "tpm-published", "reverse", "reverse in-order", "weighted", "augmented", "merged",
        "recursive nakamura", "recursive chiaverini", "recursive selective"}
    assert make("tpm").damps_with_bounds == make("hcod").damps_with_bounds


@every(RESOLVERS)
def test_entries_that_are_not_finite_give_a_status_and_a_finite_answer(resolver):
    """Also in a metric, and where that has lost definiteness."""
    for metric, (of, bad) in product((None, np.eye(7)), [("metric", -1.0), *product(
            ("A", "upper", "reference"), (np.nan, np.inf, -np.inf))]):
        h = build("generic", True).changed(metric=metric)
        if getattr(h, of) is not None:
            getattr(h, of).flat[-1] = bad
            h.lower[-1] = h.upper[-1]
            res = resolver.solve(h)
            assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)
            assert not certify(h, np.zeros(7)).certified


# Levels, a reference, and the x and violations that are right; x is None where it is not unique.
INF = np.inf
LIMITS = (np.eye(3), [-1.0] * 3, [1.0] * 3)
BOX = (np.eye(2), [-1.0, -1.0], [1.0, 1.0])
BY_HAND = {
    "an inequality above an equality": ([BOX, ([[1.0, 1.0]], [5.0])], None, [1, 1], [0, 3]),
    "an inequality below an equality": (
        [([[1.0, 0.0]], [2.0]), (np.eye(2), [-1.0, 3.0], [1.0, 4.0])], None, [2, 3], [0, 1]),
    "inequalities that cannot all hold": (
        [([[1.0, 0.0], [1.0, 0.0]], [-INF, 1.0], [0.0, INF]), ([[1.0, 1.0]], [9.0])],
        None, [0.5, 8.5], [np.sqrt(0.5), 0]),
    "an equality between inequalities": (
        [([[1.0, 0, 0]], [-1.0], [1.0]), ([[1.0, 1.0, 0]], [3.0]),
         ([[0, 1.0, 0]], [-INF], [1.5]), ([[0, 0, 1.0]], [2.0])], None, [1, 2, 2],
        [0, 0, 0.5, 0]),
    "nearest to the reference": ([LIMITS, ([[1.0, 1.0, 0.0]], [0.5])], [3.0, 0.0, -5.0],
                                 [1, -0.5, -1], [0, 0]),
    "rows without sides": ([([[1.0, 0.0]], [-INF], [INF]), ([[0.0, 0.0]], [-1.0], [1.0]),
                            ([[1.0, 1.0]], [2.0], [INF])], [0.5, 0.0], [1.25, 0.75], [0, 0, 0]),
    "a row opposite to one above": (  # dividing by what is left of it led to 5e14
        [([[0.74016879, 0.67242112]], [0.938], [1.75]),
         ([[-0.74016879, -0.67242112]], [-0.518])], [-1.9, 0.5], None, [0, 0.42]),
    "limits with just room for each other": (
        [BOX, ([[1.0, 1.0], [1.0, -1.0]], [1.5, 0.2], [INF, INF])], None, None, [0, 0]),
    "a zero row that cannot be met": (
        [(np.zeros((1, 2)), [1.0], [2.0]), ([[1.0, 1.0]], [4.0])], None, [2.0, 2.0], [1, 0]),
    "sides that exclude each other": ([([[1.0], [1.0]], [1.0, -INF], [INF, -1.0])], None, [0.0],
                                      [np.sqrt(2.0)]),
    "a reference out of reach": ([([[1.0, 0.0]], [-1.0], [1.0])], [5.0, 7.0], [1.0, 7.0], [0]),
    "every number met is zero": (
        [([[2.0], [1.0], [1.0]], [0.0, 1.0, -1.0]), ([[1.0]], [-9.0], [9.0])], None, [0.0],
        [np.sqrt(2.0), 0])}


@every(INEQUALITIES)
@pytest.mark.parametrize("case", BY_HAND)
@pytest.mark.filterwarnings("error")
def test_small_hierarchies_have_the_answer_found_by_hand(resolver, case):
    levels, reference, x, norms = BY_HAND[case]
    h = Hierarchy.from_levels(levels, reference)
    res = resolver.solve(h)
    off = resolver.accuracy if resolver in HQP else 1e-12
    assert np.linalg.norm(res.x) < 10.0
    np.testing.assert_allclose(h.violations(res.x), norms, rtol=off, atol=off)
    np.testing.assert_allclose(res.x, res.x if x is None else x, rtol=off, atol=off)
    if resolver not in HQP:
        assert res.status is Status.SOLVED
        assert certify(h, res.x).certified


@every(EQUALITIES_ONLY + BOUNDS)
def test_an_inequality_is_refused_by_level_and_row(resolver):
    h = Hierarchy.from_levels([([[1.0, 0.0]], [0.0]), ([[1.0, 1.0], [0.0, 1.0]], [0, 0], [0, 2])],
                              names=("position", "limits"))
    refused("limits, row 1: an inequality, 0 <= a x <= 2", resolver.solve, h)


@every(BOUNDS)
@pytest.mark.parametrize(("levels", "said"), [
    ([(np.eye(2), [0, 0]), BOX], "level 2, row 0: an inequality, -1 <= a x <= 1"),
    ([BOX, ([[1, 1]], [0], [INF])], "level 2, row 0: an inequality"),
    ([([[1, 0], [1, 1]], [-1, 0], [1, 2])], "level 1, row 1: an inequality, 0 <= a x <= 2"),
    ([([[1, 1], [0, 1]], [1, -1], [1, 1])], "level 1, row 1: an inequality, -1 <= a x <= 1"),
    ([([[1, 0], [0, 0]], [-1, 0], [1, 2])], "level 1, row 1: an inequality, 0 <= a x <= 2")])
def test_a_first_level_that_is_more_than_bounds_is_refused_by_level_and_row(resolver, levels, said):
    assert "single unknowns" in refused(said, resolver.solve, Hierarchy.from_levels(levels))


@on_cases([*BOUNDS, make("hcod"), make("hqp")], 1)
def test_bounds_of_a_first_level_are_kept_and_change_nothing_where_they_are_far(resolver, case):
    """They are never damped: else a joint moved away from its limit only in part."""
    h = build(case, True)
    for damping, (low, high) in product((0.0, 0.05), ((-1e6, 1e6), (-0.3, 0.3), (0.02, 1.0))):
        damped = dataclasses.replace(resolver, damping=damping, threshold=3.0)
        limited, off = boxed(h, low, high), 1e-7 if resolver.name == "hqp" else 1e-12
        found = solved(damped, limited)
        x, said = found.x, getattr(found, "saturated", found.active)
        assert ((low - off <= x) & (x <= high + off)).all()
        if resolver.name in ("tpm", "hcod"):  # a joint at its bound is said to be there
            sides = 1 * (x >= high - off) - (x <= low + off)
            assert np.array_equal(said[:h.n], sides)
        below_no_rows = Hierarchy(*limited.rows[:3], [0, *limited.sizes], limited.reference)
        assert_close(resolver, solved(damped, below_no_rows).x, x)
        if high > 1.0:
            assert_close(resolver, x, oracle.solve(h, damping, 3.0))


# -- memory ----------------------------------------------------------------------------------------
ODD = [np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0, 1.0, 2.0, 3.0, 0.5, 1e18, -7.0]


def remembered(resolver):
    """Hierarchies whose limits act, of kinds that a resolver handles."""
    for seed in range(5 if PROBLEMS < 50 else 40):
        yield boxed(Hierarchy.from_levels(random_levels(7, (3, 1, 1), seed)), -0.3, 0.3)
    if resolver.handles == "inequalities":
        for name in ("INEQ7", "HUM38"):
            yield from (h for h, _, _ in list(family(name))[:PROBLEMS if resolver.strict else 3])


@every([make("hcod"), make("tpm"), make("weighted"), make("merged", cap=0.0)])
def test_no_memory_changes_the_answer_and_its_own_leaves_little_to_do(resolver):
    """Of a tick before, of rows at random sides, of numbers of any size, of another hierarchy."""
    r, tried, close = rng(3), 0, 1e-10 if resolver.name == "tpm" else 1e-8
    for h in remembered(resolver):
        cold = resolver.solve(h)
        if cold.memory is None:  # no limit acted
            continue
        kept, odd = cold.memory.copy(), cold.memory.copy()
        spoilt = r.random(len(odd)) < 0.5
        odd[spoilt] = r.choice(ODD, spoilt.sum())
        sides = r.integers(-1, 2, len(odd)).astype(float)
        for memory in (odd, sides):
            memory[-3:-1] = 1.0  # said to be a memory
        warm = resolver.solve(h, cold.memory)
        assert np.array_equal(cold.memory, kept)
        assert warm.iterations == 1
        for memory in (kept, resolver.solve(moved(h)).memory, odd, sides, -odd[::-1],
                       1e200 * r.normal(size=len(odd)), np.full(len(odd), np.nan), np.zeros(3)):
            again = resolver.solve(h, memory)
            assert again.status is cold.status
            assert np.abs(again.x - cold.x).max() <= close * (1.0 + np.abs(cold.x).max())
        assert np.abs(warm.x - cold.x).max() <= 1e-9 * (1.0 + np.abs(cold.x).max())
        tried += 1
        if resolver.name == "hcod":
            np.testing.assert_array_equal(warm.holds_back, cold.holds_back)
            np.testing.assert_allclose(warm.multipliers, cold.multipliers, atol=1e-6)
    assert tried > 3
    free = build("generic", False)  # nothing of a memory is of use
    assert gap(resolver.solve(free, cold.memory).x, resolver.solve(free).x) <= 1e-12
    h.A[-1] = np.nan  # nor does a failure say what an earlier solve left
    for damping in (0.0, 0.1):
        one = dataclasses.replace(resolver, damping=damping)
        res = one.solve(h, cold.memory)
        assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)
        assert (type(res), res.iterations) == (type(one.solve(h)), 1)
        assert res.active is None or 1 not in np.abs(res.active)


@pytest.mark.parametrize("name", names())
def test_what_is_no_hierarchy_and_what_is_no_memory_are_refused(name):
    h = Hierarchy.from_levels([BOX, ([[1.0, 0.0]], [1.0])])
    for given in ([(np.eye(2), np.ones(2))], np.eye(2), "h", None):
        refused(f"{name}: h: expected a Hierarchy, got", make(name).solve, given)
    for memory in ([0.0] * 9, "memory", 7, np.zeros(9, dtype=np.int64), np.zeros(9, dtype=complex)):
        refused(f"{name}: memory", make(name).solve, h, memory)
    with pytest.raises(HierarchyError, match=r"give the memory of .* resolution, res\.memory"):
        make("hcod").solve(h, make("hcod").solve(h))


@every(EQUALITIES_ONLY + BOUNDS)
def test_many_solves_do_not_grow_memory(resolver):
    h = Hierarchy.from_levels([(rng().normal(size=(3, 7)), [1.0, 2.0, 3.0])])
    resolver.solve(h)
    tracemalloc.start()
    try:
        for _ in range(10):
            resolver.solve(h)
        gc.collect()  # also what Python keeps of freed tuples
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(500):
            resolver.solve(h)
        gc.collect()
        assert tracemalloc.get_traced_memory()[0] - before < 8000  # some of it the test runner's
    finally:
        tracemalloc.stop()
