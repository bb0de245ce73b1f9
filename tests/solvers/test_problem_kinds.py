"""Structured problems have the structure they are named after."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from solvers.problems import KINDS, bounded, structured

SEEDS = range(40)
every_kind = pytest.mark.parametrize("kind", KINDS)


def made(kind):
    return [structured(seed, (kind,)) for seed in SEEDS]


def norms(h):
    return np.linalg.norm(h.A, axis=1)


@pytest.mark.slow
@every_kind
def test_every_problem_is_valid_and_the_same_for_a_seed(kind):
    for seed, h in enumerate(made(kind)):
        Hierarchy.from_levels(list(h.levels()), h.reference)
        again = structured(seed, (kind,))
        for part in ("A", "lower", "upper", "sizes", "reference"):
            assert np.array_equal(getattr(h, part), getattr(again, part))


@pytest.mark.slow
@every_kind
def test_equalities_alone_can_be_asked_for(kind):
    assert all(structured(seed, (kind,), equalities_only=True).is_equality for seed in SEEDS)


def test_a_box_goes_first_and_is_often_in_the_way():
    within = []
    for seed in SEEDS:
        h = structured(seed, ("integers",), equalities_only=True)
        box = bounded(h, seed)
        rows = box.A[:box.sizes[0]]
        assert np.array_equal(box.A[box.sizes[0]:], h.A)
        assert (np.count_nonzero(rows, axis=1) == 1).all()
        assert np.array_equal(box.A, bounded(h, seed).A)
        asked = np.linalg.lstsq(h.A, h.lower, rcond=None)[0]
        within.append(bool((box.slacks(asked)[:box.sizes[0]] == 0.0).all()))
    assert 0 < sum(within) < len(within)


@pytest.mark.slow
def test_all_kinds_are_drawn_unless_some_are_named():
    sizes = {tuple(structured(seed).sizes.tolist()) for seed in range(100)}
    assert len(sizes) > 50
    assert {structured(seed, ("one_unknown",)).n for seed in SEEDS} == {1}
    assert {structured(seed, ("sixty_unknowns",)).n for seed in SEEDS} == {60}
    assert {len(structured(seed, ("fifteen_levels",)).sizes) for seed in SEEDS} == {15}


def test_jacobians_of_singular_arms_lose_rank_and_the_dusty_ones_keep_their_dust():
    assert any(np.linalg.matrix_rank(h.A[:h.m - h.n]) < h.n for h in made("singular_arm"))
    assert all(norms(h)[norms(h) > 0.0].min() > 1e-6 for h in made("singular_arm"))
    assert any(0.0 < norms(h)[norms(h) > 0.0].min() < 1e-12 for h in made("dusty_arm"))


def test_boxes_at_rest_have_sides_of_exactly_zero():
    assert all((structured(s, ("tied_box",)).lower[:1] <= 0.0).all() for s in SEEDS)
    assert np.mean([(h.upper[:h.n] == 0.0).any() for h in made("tied_box")]) > 0.3


def test_opposed_rows_cannot_all_hold():
    assert any((h.lower[:, None] > -h.lower[None]).any() for h in made("opposed"))


def test_friction_pyramids_touch_at_zero_force():
    for h in made("contacts"):
        A, _, upper = next(iter(h.levels()))
        pyramids = np.isfinite(upper) & (upper == 0.0)
        assert np.count_nonzero(pyramids) == 5 * h.n // 3
        assert (A[pyramids] @ np.zeros(h.n) == 0.0).all()


def test_lower_levels_repeat_rows_of_upper_ones():
    assert np.mean([len(np.unique(h.A, axis=0)) < h.m for h in made("nested")]) > 0.6


def test_mixed_units_differ_by_a_million_inside_a_level():
    ratios = [size.max() / size[size > 0.0].min() for h in made("mixed_units")
              for size in (np.linalg.norm(A, axis=1) for A, *_ in h.levels()) if size.any()]
    assert max(ratios) == pytest.approx(1e6)


def test_integers_and_signs_are_whole_numbers():
    assert all((h.A == np.round(h.A)).all() and np.abs(h.A).max() <= 2.0 for h in made("integers"))
    for h in made("signs"):
        sides = np.concatenate([h.lower, h.upper])
        assert set(sides[np.isfinite(sides)]) <= {-1.0, 0.0, 1.0}


def test_near_ties_are_of_about_1e_9():
    found = 0
    for h in made("near_ties"):
        sides = np.concatenate([h.lower, h.upper])
        sides = sides[np.isfinite(sides)]
        off = np.abs(sides - np.round(sides))
        found += bool(((off > 1e-10) & (off < 1e-8)).any())
    assert found > len(SEEDS) / 3


def test_tiny_rows_are_of_norm_1e_14_and_not_in_the_top_level():
    assert all(norms(h)[:h.sizes[0]].min() > 0.9 or not norms(h)[:h.sizes[0]].all()
               for h in made("tiny_rows"))
    assert any(norms(h).min() == pytest.approx(1e-14) for h in made("tiny_rows"))


def test_a_kind_that_does_not_exist_is_refused():
    with pytest.raises(HierarchyError, match="no kind of problem is called 'arms'"):
        structured(0, ("arms",))
