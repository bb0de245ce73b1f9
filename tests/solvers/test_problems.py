"""Generated problems: the same for a seed, of the sizes asked for, with all that is hard."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from pinned import problem_sums, read

from hierarchy import Hierarchy, HierarchyError
from solvers import certify, make, problems
from solvers.problems import Recipe, generate

SEEDS = range(200)
PLAIN = Recipe(conflicting=0.0, zero_rows=0.0, scales=(1.0, 1.0), spread=1.0)


def everything(recipe):
    return [generate(seed, recipe) for seed in SEEDS]


def unit(h):
    size = np.linalg.norm(h.A, axis=1, keepdims=True)
    return h.A / np.where(size > 0.0, size, 1.0)


def test_a_seed_gives_the_same_problem_every_time():
    first, again = generate(5), generate(5)
    for part in ("A", "lower", "upper", "sizes", "reference"):
        assert np.array_equal(getattr(first, part), getattr(again, part))
    assert not np.array_equal(first.A, generate(6).A)


def test_every_problem_is_a_valid_hierarchy():
    for h in everything(Recipe()):
        Hierarchy.from_levels(list(h.levels()), h.reference)


def test_sizes_are_those_of_the_recipe_and_reach_both_ends():
    made = everything(Recipe(joints=(2, 5), levels=(1, 3), rows=(0, 4)))
    assert {h.n for h in made} == {2, 3, 4, 5}
    assert {len(h.sizes) for h in made} == {1, 2, 3}
    assert {size for h in made for size in h.sizes.tolist()} == {0, 1, 2, 3, 4}


def test_one_size_can_be_asked_for():
    h = generate(0, Recipe(joints=(60, 60), levels=(12, 12), rows=(40, 40), empty=0.0))
    assert h.n == 60
    assert h.sizes.tolist() == [40] * 12


@pytest.mark.slow
def test_equalities_alone_can_be_asked_for():
    assert all(h.is_equality for h in everything(Recipe(equalities_only=True)))
    assert not all(h.is_equality for h in everything(Recipe()))


@pytest.mark.slow
def test_without_conflicts_all_rows_hold_at_one_point():
    for h in everything(dataclasses.replace(PLAIN, equalities_only=True, near_parallel=0.0)):
        assert h.violations(make("tpm").solve(h).x).max() < 1e-6


def test_many_sides_pass_through_one_point():
    for h in everything(dataclasses.replace(PLAIN, ties=1.0, one_sided=0.0, sideless=0.0,
                                            rows=(30, 30), joints=(3, 3), levels=(2, 2))):
        size = unit(h)
        on = np.zeros(h.m, dtype=bool)
        through = np.linalg.lstsq(size[:4], h.lower[:4], rcond=None)[0]
        on |= (np.abs(size @ through - h.lower) < 1e-9) | (np.abs(size @ through - h.upper) < 1e-9)
        if not h.is_equality and np.count_nonzero(on) > 20:
            return
    pytest.fail("no vertex of many rows")


def test_two_rows_are_enough_to_repeat_one():
    made = everything(dataclasses.replace(PLAIN, joints=(3, 3), levels=(1, 1), rows=(2, 2),
                                          duplicates=1.0, rank_lost=0.0, simple_bounds=0.0,
                                          empty=0.0, near_parallel=0.0))
    assert sum(rank(unit(h)) == 1 for h in made) > len(made) / 3  # in half a row copies itself


def test_conflicts_leave_violations():
    made = everything(Recipe(equalities_only=True, conflicting=1.0))
    assert sum(h.violations(make("tpm").solve(h).x).max() > 1e-3 for h in made) > len(made) / 3


def rank(rows):
    return int(np.linalg.matrix_rank(rows, tol=1e-9)) if len(rows) else 0


@pytest.mark.slow
def test_ranks_are_lost_inside_levels_and_between_them():
    inside = between = 0
    for h in everything(Recipe(duplicates=0.0, zero_rows=0.0, simple_bounds=0.0)):
        rows = unit(h)
        pairs = list(zip(h.offsets[:-1], h.offsets[1:], strict=True))
        inside += any(rank(rows[i:j]) < min(j - i, h.n) for i, j in pairs)
        between += any(rank(rows[:j]) < min(rank(rows[:i]) + rank(rows[i:j]), h.n)
                       for i, j in pairs)
    assert inside > 20
    assert between > 20


def test_zero_rows_missing_sides_and_all_scales_occur():
    made = everything(Recipe())
    assert any((h.A == 0.0).all(axis=1).any() for h in made)
    assert any((np.isinf(h.lower) & np.isinf(h.upper)).any() for h in made)
    assert any((np.isfinite(h.lower) & np.isinf(h.upper)).any() for h in made)
    sizes = np.concatenate([np.linalg.norm(h.A, axis=1) for h in made])
    assert sizes[sizes > 0.0].min() < 1e-5
    assert sizes.max() > 1e5


@pytest.mark.parametrize("angle", [1e-6, 1e-3])
def test_near_parallel_rows_have_the_angle_asked_for(angle):
    recipe = dataclasses.replace(PLAIN, near_parallel=1.0, angles=(angle, angle), levels=(1, 1),
                                 rows=(2, 2), joints=(4, 4), rank_lost=0.0, simple_bounds=0.0,
                                 empty=0.0)
    for h in everything(recipe)[:50]:
        smallest = np.linalg.svd(unit(h), compute_uv=False)[-1]
        assert smallest == pytest.approx(angle / np.sqrt(2.0), rel=1e-3) or smallest > 0.05


@pytest.mark.parametrize(("knob", "value"), [
    ("joints", (0, 5)), ("joints", (5, 2)), ("rows", (-1, 3)), ("spread", 0.5), ("ties", 1.5),
    ("scales", (1.0, np.inf)), ("empty", float("nan"))])
def test_a_knob_out_of_range_is_named(knob, value):
    with pytest.raises(HierarchyError, match=f"recipe: {knob} = "):
        Recipe(**{knob: value})


def test_a_file_gives_back_what_was_written(tmp_path):
    h = Hierarchy.from_levels(list(generate(3).levels()), names=None)
    problems.save(h, tmp_path / "h.npz")
    same = problems.load(tmp_path / "h.npz")
    assert same.names == h.names
    for part in ("A", "lower", "upper", "sizes", "offsets", "reference"):
        assert np.array_equal(getattr(same, part), getattr(h, part))


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(problems.strategy(Recipe(joints=(1, 8), levels=(1, 4), rows=(0, 6), equalities_only=True)))
def test_hypothesis_draws_the_same_kind_of_problem(h):
    assert h.n <= 8
    assert certify(h, make("tpm").solve(h).x).certified


@pytest.mark.slow
def test_a_seed_means_the_problem_that_it_meant_when_it_was_reported():
    expected = read("problems")
    for kind, sums in problem_sums().items():
        allowed = 1e-6 if kind == "bounded" else 1e-10  # a box lies around a solution, as rounded
        assert sums == pytest.approx(expected.pop(kind), rel=0.0, abs=allowed), kind
    assert not expected
