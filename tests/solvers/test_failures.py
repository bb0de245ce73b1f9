"""Structured problems that were once answered wrongly, with the violations that are right."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, certify, make, problems
from solvers.proof import prove
from solvers.qp.backends import BACKENDS, installed

FOLDER = Path(__file__).parents[1] / "data" / "regressions" / "structured"
SQRT2 = 2.0**0.5
RIGHT = {
    "hcod_SOLVED_wrong_2x2_integer": [SQRT2, 0.0], "hcod_iterlimit_min_11197": [SQRT2],
    "hcod_iterlimit_min_11480": [5.0**0.5], "hcod_n60_2006232_zeros": [0.0] * 7,
    "hcod_pinch_avoid_box_task": [0.141421356, 1.66013415],
    "hcod_wrong_min_2003814_order": [0.0, 800.0 / 3.0, 0.0],
    "hcod_wrong_min_2007743_order": [0.0, 0.0], "hcod_wrong_min_2011075_base": [SQRT2, 0.0, 0.0],
    "hcod_wrong_min_2011075_order": [SQRT2, 0.0], "hcod_wrong_min_2019756_order": [2.0, 0.0, 2.0],
    "tpm_wrong_min_3000097": [0.0, 0.0, 0.02], "tpm_wrong_min_3000542": [0.0, 0.0, 0.00196],
    "tpm_wrong_min_3009328": [0.0, 0.0, 2.27]}
# A row of 5e-14 beside one of 1000 takes no part, and an answer that misses it says so.
NEGLECTED = "tpm_wrong_min_3000097", Status.INACCURATE
UNKNOWN = ["hcod_nested_2004163_shift"]  # near-ties of 1e-9: any answer that says it is not sure
# Found by `hierarchy bench stress` (seeds from 50,000,000 on), reduced: an answer was
# called solved and wrong, the certificate rejected a right one (CERTAIN), or steps cycled.
# Or of the exact engine: levels missed by a fiftieth, 169 steps for 10 rows (certain but IN_DOUBT);
# tick 390 of stand-talos, on a heel edge, was INACCURATE.
STORED = sorted(path for folder in ("", "stress", "exact", "whole-body")
                for path in (FOLDER.parent / folder).glob("*.npz"))
# The nearly-* have rows that are dependent up to 1e-8 rad: x was far off on the way, and levels
# below, or the reference, moved it back along directions of which a row had a little left.
IN_DOUBT = ("hcod_169_steps_9", "hcod_SOLVED_third_level_34",
            "step-18", "step-895")  # by which rows are pivots first
CERTAIN = ["contacts-50000500", "contacts-50067440", "contacts-50081046",
           "cycle-mixed_units-50103472", "cycle-tiny_rows-50015365", "cycle-tiny_rows-50031629",
           "mixed_units-262311872", "mixed_units-281029597", "mixed_units-50076333",
           "shifted-50025253", "sixty_unknowns-50043814"]


def read(name):
    return problems.load(FOLDER / f"{name}.npz")


def is_right(h, x):
    """Judge by the certificate, and by a proof where it refuses an answer near dependent rows."""
    if certify(h, x).certified:
        return True
    proof = prove(h, [x])
    return bool(proof.complete and np.abs(proof.x - x).max() <= 1e-6 * (1 + np.abs(x).max()))


@pytest.mark.parametrize("resolver", ["hcod", "tpm", "hqp"])
@pytest.mark.parametrize("name", [*RIGHT, *UNKNOWN])
def test_what_is_called_solved_is_certified_and_has_the_right_violations(name, resolver):
    try:
        res = make(resolver).solve(read(name))
    except HierarchyError as refusal:  # of rows of this kind
        pytest.skip(str(refusal))
    assert np.isfinite(res.x).all()
    verdict = certify(read(name), res.x)
    assert res.status is not Status.SOLVED or verdict.certified, str(verdict)
    if name in RIGHT:
        assert res.status is Status.SOLVED or (name, res.status) == NEGLECTED
        np.testing.assert_allclose(read(name).violations(res.x), RIGHT[name], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_what_hcod_calls_solved_is_right_and_found_soon_with_its_memory_too(path):
    h, hcod = problems.load(path), make("hcod")
    cold = hcod.solve(h)
    for res in (cold, hcod.solve(h, cold.memory)):
        assert np.isfinite(res.x).all()
        assert res.status in (Status.SOLVED, Status.INACCURATE)
        assert res.iterations <= 8 * h.m
        assert res.status is not Status.SOLVED or is_right(h, res.x)
        if path.parent.name in ("exact", "whole-body"):
            assert res.status is Status.SOLVED or path.stem in IN_DOUBT
    certain = path.stem in CERTAIN or path.stem.startswith(("nearly-", "hcod-", "step-"))
    assert not certain or certify(h, cold.x).certified


@pytest.mark.parametrize(("name", "wrong"), [
    ("tpm_wrong_min_3000097", [0.9981079094, -10.0]), ("tpm_wrong_min_3000542", [0.0, -1.0, 1.0]),
    ("tpm_wrong_min_3009328", [0.1, 7.5, -0.3, 0.1])])
def test_a_small_row_that_could_be_met_is_not_hidden_by_a_large_one(name, wrong):
    """What tpm once gave: at least the small row of level 2 is missed, or the large one moved."""
    assert certify(read(name), wrong).level == 1


@pytest.mark.parametrize("name", ["augmented", "hcod", "recursive", "reverse", "sns", "tpm"])
def test_a_row_that_is_rounding_makes_no_answer_large(name):
    """A row of the Jacobian of a straight arm: x was 1e17, SOLVED."""
    one, dust = ([[1.0, 0.0]], [1.0]), ([[0.0, 1e-17]], [1.0])
    beside = make(name).solve(Hierarchy.from_levels([([[1.0, 0.0], [0.0, 1e-17]], [1.0, 1.0])]))
    below = make(name).solve(Hierarchy.from_levels([one, dust]))
    assert beside.status is Status.SOLVED
    assert [*beside.x, *below.x] == pytest.approx([1.0, 0.0, 1.0, 0.0], abs=1e-9)
    assert below.status is (Status.SOLVED if name == "augmented" else Status.INACCURATE)


@pytest.mark.parametrize("backend", [name for name in BACKENDS if installed(name)])
def test_numbers_that_overflow_when_squared_do_not_end_the_process(backend):
    h = read("hqp_segfault")
    res = make("hqp", backend=backend).solve(h)
    assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)
    assert not certify(h, res.x).certified
    singular = Hierarchy.from_levels([([[1.0], [1.0]], [1.0, 1.0])])
    res = make("hqp", backend=backend, damping=1e300).solve(singular)  # an OverflowError
    assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)


def test_an_x_that_grows_from_level_to_level_until_it_overflows_is_a_failure():
    """It was SOLVED, |x| = 1e307: what the backend gave."""
    E = np.eye(40)
    h = Hierarchy.from_levels([(E[:1], [1e49]), *(((a + 1e-6 * b)[None], [0.0])
                                                  for a, b in pairwise(E))])
    res = make("hqp").solve(h)
    assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)


@pytest.mark.parametrize("resolver", [
    *map(make, ("augmented", "recursive", "reverse", "sns", "tpm-published")),
    make("hcod", damping=0.1), make("tpm", damping=0.1)], ids=lambda one: one.label)
def test_rows_whose_squares_underflow_are_a_failure_where_they_are_not_solved(resolver):
    """`augmented` called zero SOLVED, others INACCURATE; the last two were not damped."""
    res = resolver.solve(Hierarchy.from_levels([([[1e-150]], [3e-150])]))
    assert (res.status, res.x.any()) == (Status.NUMERICAL_FAILURE, False)


@pytest.mark.parametrize("name", ["hcod", "merged", "tpm"])
@pytest.mark.parametrize("size", [1e-308, 1e-310, 5e-324])
def test_rows_at_the_end_of_the_range_of_numbers_are_solved(name, size):
    """Below 2^-1024 the search for a unit for them never ended."""
    res = make(name).solve(Hierarchy.from_levels([([[size, 0.0]], [size]), ([[0.0, size]], [0.0])]))
    assert res.status is Status.SOLVED
    np.testing.assert_allclose(res.x, [1.0, 0.0])


@pytest.mark.parametrize("name", ["hcod", "recursive", "sns", "tpm"])
@pytest.mark.parametrize("rank_tolerance", [1e-13, 1e-15, 1e-170, 0.0])
def test_what_may_be_rounding_is_no_direction_without_a_rank_tolerance(name, rank_tolerance):
    """Parallel rows were a failure, or SOLVED, |x| = 1e16; with zero no pivot was judged."""
    def solve(angle):
        return make(name, rank_tolerance=rank_tolerance).solve(Hierarchy.from_levels([
            ([[1.0, 1.0]], [1.0]), ([[1.0 / 3, 1.0 / 3 + angle]], [2.0])]))

    assert solve(0.0).status is Status.SOLVED
    np.testing.assert_allclose(solve(1e-15).x, [0.5, 0.5])
    judged = name in ("hcod", "tpm")
    assert solve(1e-12).status is (Status.INACCURATE if judged else Status.SOLVED)


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("name", ["hcod", "merged", "tpm"])
def test_a_failure_with_a_memory_says_nothing_of_an_earlier_solve(name, damping):
    """`active`, `iterations` and `saturated` were those of the solve that left the memory."""
    resolver = make(name, damping=damping)
    h = Hierarchy.from_levels([(np.eye(2), [-1.0, -1.0], [1.0, 1.0]), ([[1.0, 0.5]], [3.0])])
    memory = resolver.solve(h).memory
    h.A[2, 0] = np.nan
    alone, res = resolver.solve(h), resolver.solve(h, memory)
    assert (res.status, *res.x) == (Status.NUMERICAL_FAILURE, 0.0, 0.0)
    assert (type(res), res.iterations) == (type(alone), 1)
    assert res.active is None or 1 not in np.abs(res.active)


@pytest.mark.parametrize(("name", "kind", "seeds"), [
    ("hqp", "nested", (9420066,)),  # once a step of dust, far from everything
    ("hqp", "near_ties", (4, 11, 13)),  # more rows were taken to act than can be met at once
    ("hcod", "nearly_parallel", (
        261332389, 261339979, 261346471, 262321952, 271003400, 271018875, 271020795, 271025782,
        271041751, 273008558, 360061111,
        850009080)),  # multipliers of 1e18, rounding
    # In a violated level, the rounding of rows of 1 to 1e6 was the force of rows of 1e-12 to 1e-2.
    ("hcod", "near_singular_arm", (
        900000413, 900001267, 900001697, 900006110, 900006261, 900006637, 900008214, 900009317)),
    ("hcod", "scaled", (
        900002411, 900002485, 900004845, 900005634, 900007320, 900011099, 900011609,
        352038510, 771034816, 830004770)),
    # Entries of 1e-13 in a violated row kept bounds active that held lower levels back.
    ("hcod", "near_singular_arm", (342031164, 342040775, 850009867)),
    ("hcod", "shifted", (333070342,)),
    ("tpm", "nearly_parallel", (
        180005648, 180039206, 180053662, 180059618, 180083959, 180086533, 180106780, 180122079,
        180128641, 180145055))])
def test_what_was_solved_and_wrong_is_right_or_inaccurate(name, kind, seeds):
    resolver = make(name)
    for seed in seeds:
        h = problems.structured(seed, (kind,), name == "tpm")
        h = problems.bounded(h, seed) if name == "tpm" and seed % 3 else h
        res = resolver.solve(h)
        assert res.status is Status.INACCURATE or is_right(h, res.x), seed


def test_directions_that_rows_see_by_rounding_do_not_break_the_bounds_of_others():
    """proxqp went along one by 1e8, which moved a bounded unknown by 2e-5, and that was SOLVED."""
    E, inf = np.eye(4), np.inf
    for seed in (26, 82, 161):
        rng = np.random.default_rng(seed)
        row, other = (np.r_[first, rng.normal(size=3)] for first in (1e-12 * rng.normal(), 0.0))
        h = Hierarchy.from_levels([
            (E[1:], -0.01 * np.abs(rng.normal(size=3)), 1e-3 * rng.normal(size=3)**2),
            ([row], [5e-4], [inf]), ([other], [2.0])])
        res = make("hqp").solve(h)
        assert res.status is Status.SOLVED
        assert h.violations(res.x)[0] < 1e-12


@pytest.mark.parametrize(("name", "seed", "kinds"), [
    ("hqp", 10, ["chain"]),  # rows violated by a little on the way are assumed to hold nearby
    ("hqp", 5000281, []),  # |x| = 1e8
    ("hcod", 7102002, ["nearly_parallel"])])  # rows are cut more than once
def test_what_rounding_makes_hard_is_solved(name, seed, kinds):
    assert make(name).solve(problems.structured(seed, kinds)).status is Status.SOLVED
