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


def test_the_best_is_marked_with_those_equal_to_it():
    low = np.linspace(1.0, 1.5, 16)
    columns = {"a": low, "b": low + 1.0, "c": low * (1.0 + 1e-10), "d": low + 2.0}
    assert set(best(columns, lower_is_better=True)) == {"a", "c"}
    assert best(columns, lower_is_better=False) == ("d",)


def test_nothing_is_best_where_one_cannot_be_told_from_it():
    random = np.random.default_rng(2)
    low = random.normal(size=16)
    columns = {"a": low, "b": low + random.normal(size=16), "c": low + 5.0}
    assert best(columns, lower_is_better=True) == ()
    assert best({"a": low, "b": low.copy()}, lower_is_better=True) == ()
    assert best({"a": low, "b": np.full(16, np.nan)}, lower_is_better=True) == ()
    assert best({"a": low}, lower_is_better=True) == ()
    skewed = low + np.r_[np.full(12, 1.0), np.full(4, -50.0)]
    assert best({"a": low, "b": skewed}, lower_is_better=True) == ()


def test_many_rivals_need_stronger_evidence():
    # One pair of 8 against the trend: p = 0.016 alone, too much for ten rivals after Holm.
    apart = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -0.5])
    low = np.zeros(8)
    assert best({"a": low, "b": low + apart}, lower_is_better=True) == ("a",)
    rivals = {f"b{i}": low + apart * (1.0 + 0.01 * i) for i in range(10)}
    assert best({"a": low, **rivals}, lower_is_better=True) == ()


@pytest.mark.parametrize(("met", "of", "low", "high"), [
    (18, 24, 0.551, 0.880),  # Wilson 1927
    (0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662), (0, 0, 0.0, 1.0)])
def test_the_interval_of_a_share_is_wilsons(met, of, low, high):
    assert wilson(met, of) == pytest.approx((low, high), abs=1e-4)
