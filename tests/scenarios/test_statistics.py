from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import rankdata

from scenarios.measure.statistics import best, paired, wilson


def enumerated(apart):
    """The two-sided p-value of the signed-rank test, by trying all signs."""
    ranks = rankdata(np.abs(apart))
    middle = ranks.sum() / 2
    off = abs(ranks[apart > 0].sum() - middle)
    every = [abs(ranks @ np.array(signs) - middle) for signs in product((0, 1), repeat=len(apart))]
    return np.mean(np.array(every) >= off - 1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_p_value_is_that_of_all_signs_with_and_without_ties(seed):
    random = np.random.default_rng(seed)
    first = random.normal(size=9)
    second = first + 0.4 + random.normal(size=9)
    assert paired(first, second).p == pytest.approx(enumerated(second - first))
    second = np.random.default_rng(seed).integers(-2, 5, 11).astype(float)
    assert paired(np.zeros(11), second).p == pytest.approx(enumerated(second[second != 0.0]))


def test_pairs_are_counted_by_their_direction():
    first = np.array([1.0, 2.0, 3.0, 4.0, np.nan, 6.0])
    second = np.array([1.0, 1.0, 5.0, 4.0 * (1 + 1e-4), 5.0, np.inf])
    found = paired(first, second)
    assert (found.count, found.same, found.lower, found.higher) == (4, 2, 1, 1)
    assert [replace(found, p=p).distinguishable for p in (0.0499, 0.05)] == [True, False]
    assert str(found) == "not distinguishable"


RISING = np.arange(1.0, 17.0)


@pytest.mark.parametrize(("shift", "said"), [
    (0.1 + 0.01 * np.random.default_rng(0).random(16), "lower in 16 of 16, p < 0.001"),
    (np.where(RISING <= 7.0, 0.5, 0.0), "lower in 7 of 16, the same in 9, p = 0.016")])
def test_a_shift_of_pairs_is_told_beside_those_that_do_not_differ(shift, said):
    found = paired(RISING, RISING - shift)
    assert (found.distinguishable, str(found)) == (True, said)


def test_too_few_pairs_tell_nothing():
    assert not paired(np.zeros(5), np.ones(5)).distinguishable
    assert paired(np.zeros(6), np.arange(1.0, 7.0)).distinguishable
    assert str(paired(np.full(3, np.nan), np.ones(3))) == "no pair"


LOW, NORMAL = np.linspace(1.0, 1.5, 16), np.random.default_rng(2).normal(size=(2, 16))
# One pair of 8 against the trend: p = 0.016 alone, too much for ten rivals after Holm.
APART = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -0.5])


@pytest.mark.parametrize(("columns", "lower", "marked"), [
    ([LOW, LOW + 1.0, LOW * (1.0 + 1e-10), LOW + 2.0], True, (0, 2)),
    ([LOW, LOW + 1.0, LOW * (1.0 + 1e-10), LOW + 2.0], False, (3,)),
    ([NORMAL[0], NORMAL[0] + NORMAL[1], NORMAL[0] + 5.0], True, ()),
    ([LOW, LOW.copy()], True, ()), ([LOW, np.full(16, np.nan)], True, ()), ([LOW], True, ()),
    ([LOW, LOW + np.r_[np.full(12, 1.0), np.full(4, -50.0)]], True, ()),
    ([np.zeros(8), APART], True, (0,)),
    ([np.zeros(8), *(APART * (1.0 + 0.01 * i) for i in range(10))], True, ())])
def test_the_best_is_marked_with_those_equal_to_it_where_all_others_can_be_told_from_it(
        columns, lower, marked):
    assert best(dict(enumerate(columns)), lower_is_better=lower) == marked


@pytest.mark.parametrize(("met", "of", "low", "high"), [
    (18, 24, 0.551, 0.880),  # Wilson 1927
    (0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662), (0, 0, 0.0, 1.0)])
def test_the_interval_of_a_share_is_wilsons(met, of, low, high):
    assert wilson(met, of) == pytest.approx((low, high), abs=1e-4)
