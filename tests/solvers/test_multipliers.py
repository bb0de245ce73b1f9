"""The proof by multipliers: what it accepts is the answer, whatever a record claims."""

import numpy as np
import pytest

from hierarchy import Hierarchy
from solvers import certify, make, problems
from solvers.kernels.multipliers import prove_by_multipliers
from solvers.kernels.space import proof_size
from solvers.status import INACCURATE, SOLVED, TOO_SMALL
from solvers.workspace import run

INF = np.inf
SIZE = getattr(proof_size, "py_func", proof_size)  # compiled into kernels
DOUBTFUL = "dusty_arm", "mixed_units", "nearly_parallel", "tiny_rows", "shifted"  # often in doubt


def claims(h, held=()):
    """A record in which these rows (row, side, level) hold these levels back, and no other row."""
    record = np.zeros(3 * h.m + 3)
    record[h.m:2 * h.m] = -1.0
    for row, side, level in held:
        record[row], record[h.m + row] = side, level
    return record


def proved(h, x, record, work=None):
    arrays = (h.A, h.lower, h.upper, h.sizes, np.asarray(x, dtype=float), h.reference, record)
    return run(prove_by_multipliers, *arrays) if work is None else prove_by_multipliers(
        *arrays, work)


def corner():
    """x <= 1 and y <= 1, then x + y = 4, then x = 0."""
    return Hierarchy.from_levels([(np.eye(2), [-INF, -INF], [1, 1]), ([[1, 1]], [4]),
                                  ([[1, 0]], [0])])


HELD = (0, 1, 1), (1, 1, 1)


def test_an_answer_with_the_rows_that_hold_it_is_proved():
    assert proved(corner(), [1, 1], claims(corner(), HELD)) == SOLVED


@pytest.mark.parametrize("x", [[1, 1 - 1e-6], [0, 1], [1, 1.001], [np.nan, 1], [np.inf, 1],
                               [1e200, 1]])
@pytest.mark.parametrize("held", [HELD, ()])
def test_a_wrong_answer_is_not(x, held):
    assert proved(corner(), x, claims(corner(), held)) == INACCURATE


@pytest.mark.parametrize("held", [
    (), HELD[:1], [(0, -1, 1), (1, 1, 1)], [(0, 1, 2), (1, 1, 2)], [(0, 1, 2)]])
def test_rows_that_hold_a_level_back_are_found_where_the_record_does_not_claim_them(held):
    assert proved(corner(), [1, 1], claims(corner(), held)) == SOLVED


def test_a_row_that_is_claimed_but_points_inward_is_left_out():
    corners = ([[1, 0], [0, 1], [1, 1]], [-INF] * 3, [1, 1, 2])
    h = Hierarchy.from_levels([corners, ([[1, 2]], [10])])
    assert proved(h, [1, 1], claims(h, [(1, 1, 1), (2, 1, 1)])) == SOLVED
    assert proved(h, [1, 1], claims(h, [(0, 1, 1), (2, 1, 1)])) == SOLVED  # x <= 1 would pull
    assert proved(h, [1.1, 0.9], claims(h, [(0, 1, 1), (2, 1, 1)])) == INACCURATE


def test_a_row_that_holds_back_an_upper_level_may_pull_in_a_lower_one():
    rows = [([[1]], [-INF], [0]), ([[1]], [1]), ([[1]], [-1])]
    h = Hierarchy.from_levels(rows)
    assert proved(h, [0], claims(h, [(0, 1, 1)])) == SOLVED
    other = Hierarchy.from_levels([rows[0], rows[2], rows[1]])
    assert proved(other, [0], claims(other, [(0, 1, 2)])) == INACCURATE
    assert proved(other, [-1], claims(other)) == SOLVED


def test_the_distance_to_the_reference_needs_a_proof_too():
    h = Hierarchy.from_levels([([[1, 0]], [-INF], [1])], reference=[2, 3])
    assert proved(h, [1, 3], claims(h, [(0, 1, 1)])) == SOLVED
    assert proved(h, [1, 3], claims(h)) == SOLVED
    assert proved(h, [0.9, 3], claims(h)) == INACCURATE
    assert proved(h, [1, 2.9], claims(h, [(0, 1, 1)])) == INACCURATE


def test_a_shift_of_sides_by_rounding_is_allowed_and_no_more():
    h = Hierarchy.from_levels([(1e-3 * np.eye(1), [1e-3]), (np.eye(1), [7])])
    assert proved(h, [1 + 1e-10], claims(h)) == SOLVED
    assert proved(h, [1 + 1e-7], claims(h)) == INACCURATE


@pytest.mark.parametrize("angle", [1.5e-9, 3e-9])
def test_rows_that_are_nearly_parallel_are_left_to_the_certificate(angle):
    h = Hierarchy.from_levels([([[1, 0]], [0]), ([[1, angle]], [0])])
    assert proved(h, [0, 0], claims(h)) == INACCURATE
    h = Hierarchy.from_levels([([[1, 0]], [0]), ([[1, 1e-6]], [0])])
    assert proved(h, [0, 0], claims(h)) == SOLVED


def test_rows_that_only_together_are_nearly_dependent_are_left_to_the_certificate():
    A = np.array([[0, 0, 1], [0, 5e-7, 1], [2e-7, 1, 0]])  # each at 2e-7 rad or more to those above
    h = Hierarchy.from_levels([(A, [0, 0.3, 0.3])])
    assert proved(h, np.linalg.solve(A, h.lower), claims(h)) == INACCURATE


@pytest.mark.parametrize("norm", [1e-13, 1e-200, 1e200])
def test_rows_of_unusual_norm_are_left_to_the_certificate(norm):
    h = Hierarchy.from_levels([([[1, 0]], [0]), ([[0, norm]], [0])])
    assert proved(h, [0, 0], claims(h)) == INACCURATE


def test_rows_of_zeros_and_levels_without_rows_change_nothing():
    h = Hierarchy.from_levels([([[0, 0]], [3]), (np.empty((0, 2)), []), ([[1, 0]], [2])])
    assert proved(h, [2, 0], claims(h)) == SOLVED


@pytest.mark.parametrize("name", ["EQ7over", "EQ30L8", "INEQ7", "HUM38"])
def test_the_exact_answers_of_ordinary_problems_are_proved(name):
    for seed in range(20):
        h = problems.family(name, 26112430 + seed)
        res = make("hcod").solve(h)
        assert proved(h, res.x, res.memory) == SOLVED


@pytest.mark.parametrize("kind", [*DOUBTFUL, "contacts", "recipe"])
@pytest.mark.parametrize("moved", [0.0, 1e-9, 1e-6])
def test_what_is_proved_is_certified(kind, moved):
    rng = np.random.default_rng(12)
    for seed in range(60):
        h = (problems.generate(seed) if kind == "recipe"
             else problems.structured(261124300 + seed, (kind,)))
        res = make("hcod").solve(h)
        x = res.x + moved * (1.0 + np.linalg.norm(res.x)) * rng.uniform(-1.0, 1.0, h.n)
        if proved(h, x, res.memory) == SOLVED:
            assert certify(h, x).certified, seed


@pytest.mark.parametrize("n", [1, 2, 60])
@pytest.mark.parametrize("sizes", [[], [0, 0], [1], [70], [1] * 30])
def test_the_stated_work_space_is_enough_and_no_number_less_is(n, sizes):
    rng = np.random.default_rng(3)
    h = Hierarchy.from_levels([(rng.normal(size=(m, n)), rng.normal(size=m)) for m in sizes],
                              np.zeros(n))
    x, enough = make("hcod").solve(h).x, SIZE(n, h.m, len(sizes))
    assert proved(h, x, claims(h), np.full(enough, np.nan)) == SOLVED
    assert proved(h, x, claims(h), np.empty(enough - 1)) == TOO_SMALL
