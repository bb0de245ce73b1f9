"""The certificate accepts the answer and nothing else, and a proof in 120 digits is one."""

import re
from decimal import Decimal, localcontext
from itertools import product
from unittest import mock

import numpy as np
import pytest
from rank_cases import rng
from refusals import refused

from hierarchy import Hierarchy
from scenarios.problems import recorded
from solvers import certificate, certify, make, problems, proof
from solvers.proof import prove
from solvers.qp import refinement

# Not DEGEN7: some of its rows are at an angle of 2e-9, whose answer is 1e8 away or not.
FAMILIES = [name for name in recorded.FAMILIES if name != "DEGEN7"]
TINY = problems.Recipe(
    joints=(2, 3), levels=(2, 4), rows=(1, 3), scales=(1.0, 1.0), spread=1.0, angles=(1e-2, 1e-1),
    ties=0.5, zero_rows=0.1, duplicates=0.3, near_parallel=0.1)
OFF = 1e-4


@pytest.mark.parametrize("name", FAMILIES)
def test_the_stored_answers_are_certified_far_below_the_tolerance_and_lead_to_proofs(name):
    for k, one in enumerate(recorded.family(name)):
        verdict = certify(one.h, one.proof.x)
        assert verdict.certified, str(verdict)
        assert max([verdict.nearest, *verdict.stationarity]) < 1e-3 * certificate.TOLERANCE
        if k < 2 and name not in ("HUM38", "DYN60", "EQ30L8"):
            found = prove(one.h, [one.proof.x])
            assert (found.complete, found.turn < 1e-15) == (True, True)
            np.testing.assert_allclose(found.x, one.proof.x, atol=1e-9)
            np.testing.assert_allclose(found.least, one.proof.least, atol=1e-9)


@pytest.mark.parametrize("seed", range(25))
def test_only_the_answer_that_is_proved_is_certified(seed):
    """The least violation of a level is one vector, not only one norm."""
    h, r = problems.generate(seed, TINY), rng(seed)
    proved = prove(h, [make("hcod").solve(h).x])
    assert proved.complete
    assert certify(h, proved.x).certified
    for x in candidates(h, proved.x, r):
        verdict, worse = certify(h, x), np.abs(h.slacks(x) - h.slacks(proved.x)).max()
        if worse < 1e-9 or worse > 1e-5:
            assert verdict.optimal == (worse < 1e-9), worse
        if verdict.optimal and np.linalg.norm(x - proved.x) > 1e-5:
            assert not verdict.is_nearest


def candidates(h, answer, r):
    """Points near and far, with single rows or none pulled out of the answer's place."""
    for length in (1e-4, 1e-2, 1.0):
        yield answer + length * r.normal(size=h.n)
        free = np.linalg.svd(h.A)[2][-1]
        yield answer + length * free
        yield answer - length * free
        yield answer + length * (h.reference - answer)
        yield answer + length * h.A[r.integers(h.m)]


# Levels of hierarchies in two unknowns, what is certified, and what is not with the level at fault.
THIRD = 1e3 / np.sqrt(3.0)
FREE = (5e-7, -1.0, 0.5)
UP_TO_ONE = ([[1.0, 0.0]], [-np.inf], [1.0])
SMALL = {
    "within what the levels above leave": (
        [UP_TO_ONE, (np.eye(2), [3.0, 2.0])], [[1.0, 2.0]], {(0.5, 2.0): 1, (3.0, 2.0): 0}),
    "a row pushes only towards its own side": (
        [UP_TO_ONE, (np.eye(2), [-3.0, 2.0])], [[-3.0, 2.0]], {(1.0, 2.0): 1}),
    "a violated row keeps its violation": (
        [([[1.0, 0.0], [1.0, 0.0]], [-np.inf, 1.0], [-1.0, np.inf]), (np.eye(2), [0.5, 2.0])],
        [[0.0, 2.0]], {(0.5, 2.0): 0}),
    "without levels the reference": ([(np.empty((0, 2)), [])], [[0.0, 0.0]], {(0.0, OFF): None}),
    "zero rows and levels without rows hold nothing": (
        [(np.zeros((2, 2)), [1.0, 0.0], [2.0, np.inf]), (np.empty((0, 2)), []),
         ([[1.0, 1.0]], [2.0])], [[1.0, 1.0]], {(1.0, 1.0 + OFF): 2}),
    "a satisfied large row pulls nothing": (
        [(np.array([[1e3, 0.0], [1e-3, 0.0]]), [-np.inf, -1e-3], [0.0, -1e-3])], [[-1.0, 0.0]],
        {(0.0, 0.0): 0}),
    "sides of zero have a floor": (
        [(np.eye(2), [0.0, 0.0]), (np.eye(2), [1.0, 0.0])],
        [[0.0, 0.0], [0.1 * certificate.TOLERANCE, 0.0]], {(10 * certificate.TOLERANCE, 0.0): 0}),
    "rows at an angle of 1e-8 may count either way": (
        [([[1.0, 0.0], [1.0, 1e-8]], [1.0, 1.1]), ([[0.0, 1.0]], [0.5])],
        [[1.0, 1e7], [1.05, 0.5]], {(1.0, 0.5): 0}),
    "a turn of a heavy row excuses no light one": (
        [(np.eye(2), -np.ones(2), np.ones(2)), (np.diag([1e4, 1.0]), [2e4, 0.5])], [[1.0, 0.5]],
        {(1.0, 0.0): 1}),
    "dust beside a large row may be met or ignored": (
        [(np.diag([1.0, 1e-17]), [1.0, 1.0])], [[1.0, 1e17], [1.0, 0.0]], {(1.1, 0.0): 0}),
    "dust in a level of its own is a row": (
        [([[1.0, 0.0]], [1.0]), ([[0.0, 1e-17]], [1e-17])], [[1.0, 1.0]], {(1.0, 0.0): 1}),
    "two rows together hold back a heavy one beside a light one": (
        [([[0, 0, THIRD, THIRD, THIRD], [0, 0, 0, 1e3, 0], [0, 0, 0, 0, 1e-3]],
          [-2e3, -1e3, 1e-3], [-2e3, 0, 2e-3]),
         ([[0, 0, 1e3, 0, 0], [1e-3, 0, 0, 0, 0]], [-1e3, 1e-3], [np.inf, 1e-3])],
        [[1.0, 0.0, -np.sqrt(12.0), -1.0, 1.0]],
        {(1.0, 0.0, -np.sqrt(12.0) - 1e-5, -1.0, 1.0 + 1e-5): 1}),
    **{f"rows in units of {unit}": (
        [(unit * np.eye(2)[:1], [-np.inf], [unit]), (unit * np.eye(2), [5.0 * unit, 2.0 * unit])],
        [[1.0, 2.0]], {(1.0, 2.1): 1, (0.9, 2.0): 1, (1.1, 2.0): 0})
       for unit in (1e-170, 1e-20, 1e20, 1e170)},
    # A level below may use what only nearly parallel rows above can see.
    **{f"rows at an angle of {angle}": (
        [([[1.0, 0.0], [1.0, angle]], [1.0, 1.0]), ([[0.0, 1.0]], [0.5])], [[1.0, used]],
        {(1.0, 0.5 - used): level}) for angle, used, level in (
            (1e-10, 0.5, 1), (1e-9, 0.5, 1), (1e-7, 0.0, 0), (1e-5, 0.0, 0))},
    # Two rows that oppose each other see x2 with 1e-6 and x3 with `turn`.
    **{f"rows that a turn of {turn} explains": (
        [(np.eye(3), -np.ones(3), np.ones(3)), ([[1, 0, 0], [1, 1e-6, turn]], [1.0, -1.0]),
         ([[0.0, 0.0, 1.0]], [0.5])],
        [[0.5 * (1e-6 + turn), -1.0, -1.0], *right], wrong) for turn, right, wrong in (
            (1e-9, [FREE], {}), (5e-9, [FREE], {}), (1e-7, [], {FREE: 1}))}}


@pytest.mark.parametrize("case", SMALL)
def test_a_small_hierarchy_is_judged_at_the_level_at_fault(case):
    levels, right, wrong = SMALL[case]
    h = Hierarchy.from_levels(levels)
    assert all(certify(h, x).certified for x in right)
    for x, level in wrong.items():
        verdict = certify(h, x)
        assert (verdict.certified, verdict.level) == (False, level)
    refused("x has shape", lambda: certify(h, np.zeros(9)))


@pytest.mark.parametrize(("of", "row", "wrong"), [
    *product(("x", "A", "reference", "lower"), [0], (np.nan, np.inf, 1e200)),
    ("upper", 0, -1.0), ("lower", 1, np.nan)])
def test_what_is_not_finite_or_crosses_is_never_certified_or_proved(of, row, wrong):
    h, x = Hierarchy.from_levels([([[1.0, 0.0], [0.0, 0.0]], [1.0, 0.0])]), np.eye(2)[0].copy()
    assert certify(h, x).certified
    (x if of == "x" else getattr(h, of)).flat[row] = wrong
    verdict = certify(h, x)
    assert (verdict.certified, verdict.level) == (False, 0)
    assert of not in ("lower", "upper") or prove(h, [x]).proved == 0


def test_its_search_for_multipliers_finds_the_least_that_scipys_finds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        C, b = rng.random((9, 8)) + 0.2 * rng.normal(size=(9, 8)), rng.random(9)
        own, scipys = (certificate._non_negative(C, b, 0.0, by_scipy) for by_scipy in (False, True))
        np.testing.assert_allclose(own, scipys, atol=1e-9)
        for small, large in ((1e-12, 1e6), (1e9, 1e-9)):  # units of rows and of what they explain
            found = certificate._non_negative(small * C, large * b, 0.0)
            np.testing.assert_allclose(found * small / large, own, atol=1e-9)
        with localcontext(prec=120):
            left = proof._pushed_back(*map(np.vectorize(Decimal, [object]), (C.T, b)))
        np.testing.assert_allclose(left.astype(float), b - C @ own, atol=1e-9)


def test_a_search_of_scipys_that_gives_up_finds_nothing(monkeypatch):
    monkeypatch.setattr("scipy.optimize.nnls", mock.Mock(side_effect=RuntimeError))
    np.testing.assert_array_equal(certificate._by_scipy(np.eye(3)[:2], np.ones(2)), np.zeros(3))
    for huge in (1.0, 1e51):  # too large for it
        found, off = refinement._non_negative(huge * np.eye(3)[:2], np.ones(2))
        assert (found.tolist(), off) == ([0.0, 0.0, 0.0], np.inf)


@pytest.mark.parametrize("row", [0, 1, 2])
def test_a_row_is_in_the_span_of_a_level_if_it_is_where_each_turns_by_the_angle(row):
    """Its own turn and that of the row which it follows, whatever that weighs."""
    sizes = np.array([1.0, 1e-2, 1e-5])
    for beside, outside in ((0.5e-8, False), (1.9e-8, False), (2.1e-8, True)):
        other = np.eye(4)[row:row + 1] + beside * np.eye(4)[3:]
        effect, *_ = certificate._weighted(np.eye(4)[:3], sizes, other, 1e-8)
        assert np.any(effect[3]) == outside
        assert np.any(effect[:3])


def test_rows_that_repeat_heavier_ones_count_as_zero_and_others_keep_what_is_outside_a_span():
    C = np.array([[1.0, 1.0], [1e15, 1e15], [1.0, -1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(certificate._unrepeated(C, np.abs(C)), [[0.0] * 2, *C[1:]])
    alone = certificate._unrepeated(C, np.full_like(C, 1e15))  # where these are the terms of all
    np.testing.assert_array_equal(alone, np.diag([0.0, 1.0, 0.0, 0.0]) @ C)
    basis = np.linalg.qr(np.random.default_rng(3).normal(size=(5, 3)))[0].T
    rows = np.vstack([basis[0] - 2.0 * basis[2], np.eye(5)])
    left = certificate._outside(rows, basis)
    np.testing.assert_allclose(left @ basis.T, 0.0, atol=1e-15)
    np.testing.assert_allclose(left[1:], np.eye(5) - basis.T @ basis, atol=1e-15)


def test_an_answer_for_rows_turned_until_they_depend_is_certified():
    """Two rows depend up to 1.3e-9 where others are at a side; neither a shift nor a turn alone
    explains x."""
    h = problems.structured(82019829, ("nearly_parallel",))
    x = make("hcod").solve(h).x
    assert certify(h, x).certified
    assert not certify(h, x, parallel=1e-10).certified
    for c in range(h.n):
        assert not certify(h, x + 1e-5 * np.eye(h.n)[c]).certified


EXTREMES = (0.0, 5e-324, 1e-310, 1e-200, 1e-160, 1e-8, 1.0, 1e8, 1e153, 1e160, 1.6e308)


@pytest.mark.parametrize("seed", range(20))
def test_no_number_is_too_large_or_too_small_to_be_judged(seed):
    r, levels = rng(seed), []
    for size in r.integers(0, 5, r.integers(1, 4)):
        n = 1 + seed % 4
        A, low, up = (r.choice(EXTREMES, s) * r.choice([-1.0, 1.0], s)
                      for s in ((size, n), size, size))
        low, up = np.minimum(low, up), np.maximum(low, up)
        levels.append((A, np.where(r.random(size) < 0.3, -np.inf, low), up))
    h = Hierarchy.from_levels(levels)
    for x in (np.zeros(h.n), r.normal(size=h.n), r.choice(EXTREMES, h.n)):
        assert str(certify(h, x))


@pytest.mark.parametrize(("stationarity", "nearest", "verdict"), [
    (1e-6, 1e-6, "certified: optimal at every level and nearest to the reference, to 1.0e-06"),
    (1e-6, 2e-6, "optimal at every level, but not nearest to the reference: residual 2.0e-06, "
                 "tolerance 1e-06"),
    (2e-6, 0.0, "not optimal at posture: residual 2.0e-06, tolerance 1e-06"),
    (np.nan, 0.0, "not optimal at posture: residual nan, tolerance 1e-06")])
def test_a_residual_may_be_the_tolerance_and_no_more(stationarity, nearest, verdict):
    found = certificate.Certificate(np.zeros(2), np.array([0.0, stationarity]), nearest, 1e-6,
                                    ("hand", "posture"))
    assert (str(found), found.certified) == (verdict, verdict.startswith("certified"))
    assert found.optimal == (not verdict.startswith("not optimal"))
    assert re.findall(r"<td>(yes|no)", found._repr_html_()) == [
        "yes" if one <= 1e-6 else "no" for one in (0.0, stationarity, nearest)]


BOX, EYE = (np.eye(2), [-1.0, -1.0], [1.0, 1.0]), np.eye(2)
CLEAR = {"complete": True, "turn": 0.0}
PROVED = {
    "the box is kept, and the sum can be larger": (
        [BOX, ([[1.0, 1.0]], [3.0])], [[1.0, 0.0]], {"complete": False, "proved": 1,
                                                    "x": [np.nan] * 2}),
    "one candidate of two": (
        [BOX, ([[1.0, 1.0]], [3.0])], [[1.0, 0.0], [1.0, 1.0]], {**CLEAR, "x": [1.0, 1.0],
                                                                 "least": [0.0, 1.0]}),
    # A candidate may be off a side where no other is as near.
    **{f"off a side by {off} where the next is at {gap}": (
        [(EYE, [-9.0] * 2, [1.0] * 2), (EYE, [5.0, 1.0 - gap])], [[1.0 + off, 1.0 - gap]],
        {"complete": False} if off > 1e-6 else {**CLEAR, "shift": 0.0, "x": [1.0, 1.0 - gap]})
       for off, gap in ((0.0, 1.0), (5e-9, 5e-8), (5e-8, 5e-7), (5e-7, 1.0), (0.0, 5e-9),
                        (0.0, 5e-11), (1e-5, 1.0), (1e-5, 5e-7))},
    # Squares out of range counted as zero: the reference was proved to be the answer.
    **{f"a row of {size}": ([([[size, 0.0]], [size])], [[1.0, 4.0]], {"x": [1.0, 4.0]})
       for size in (1e200, 1e-170)},
    "a candidate that says only that the row is an equality": (
        [([[1.0, 0.0]], [1.0])], [[1.0, 0.0]], {**CLEAR, "x": [1.0, 4.0]}),
    "candidates that are none": (
        [([[1.0, 0.0]], [1.0])], [[1.0, np.nan], [7.0, 7.0], [1.0]], {"turn": 0.0}),
    "rows at a tiny angle make the levels below ill-posed": (
        [([[1.0, 0.0], [1.0, 1e-9]], [1.0, 1.0]), ([[0.0, 1.0]], [5.0])], [[1.0, 5.0]],
        {"posed": 1, "proved": 3, "judged": 1}),
    "rows at an angle": ([([[1.0, 0.0], [1.0, 1e-3]], [1.0, 1.0]), ([[0.0, 1.0]], [5.0])],
                         [[1.0, 0.0]], {**CLEAR, "posed": 3, "least": [0.0, 5.0]}),
    **{f"rows in units of {unit}": (SMALL[f"rows in units of {unit}"][0], [[1.0, 2.0]],
                                    {"x": [1.0, 2.0]}) for unit in (1e-20, 1e20)}}


@pytest.mark.parametrize("case", PROVED)
def test_what_a_candidate_proves(case):
    levels, candidates, expected = PROVED[case]
    h = Hierarchy.from_levels(levels, [0.0, 0.0] if len(levels) > 1 else [3.0, 4.0])
    found = prove(h, candidates, **{"unclear": 1e-13} if case.startswith("off") else {})
    for name, value in expected.items():
        np.testing.assert_array_equal(getattr(found, name), value)
    assert "ill-posed" not in case or 1e-10 < found.turn < 1e-8
    refused("metric", prove, h.changed(metric=np.diag([1.0, 2.0])), candidates)
