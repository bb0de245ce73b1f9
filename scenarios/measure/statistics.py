"""Statistics over sampled starts: spread, paired differences, shares.

A closed loop amplifies small differences, so that one run says little. Two resolvers are compared
on the same samples, sample by sample, and a difference counts only if a test tells it from chance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.problem import Array

LEVEL = 0.05     # probability of calling a difference real that is chance
SAME = 1e-3      # relative difference below which two values count as the same
FEWEST = 6       # pairs that differ; with fewer the signed-rank test cannot reach LEVEL
EXACT = 50       # pairs that differ, up to which the test is exact


@dataclass(frozen=True)
class Spread:
    """Number of known values, median, quartiles, least and largest."""

    count: int
    median: float
    lower: float
    upper: float
    least: float
    largest: float


@dataclass(frozen=True)
class Paired:
    """The differences of one quantity between two runs on the same samples: second minus first.

    count : pairs in which both values are known. same : pairs within SAME of each other.
    lower, higher : pairs in which the second is lower or higher than the first.
    median, quartiles : of all differences. p : two-sided probability of such differences by
        chance, after Wilcoxon's signed-rank test of the pairs that differ (1 if too few do).
    """

    count: int
    same: int
    lower: int
    higher: int
    median: float
    quartiles: tuple[float, float]
    p: float

    @property
    def equal(self) -> bool:
        """Whether no pair differs."""
        return self.same == self.count

    @property
    def distinguishable(self) -> bool:
        """Whether the test tells the two apart."""
        return self.p < LEVEL

    def __str__(self) -> str:
        if not self.count:
            return "no pair"
        if self.equal:
            return "the same"
        if not self.distinguishable:
            return "not distinguishable"
        counts = {"lower": self.lower, "higher": self.higher}
        word = max(counts, key=lambda one: counts[one])
        rest = {**counts, "the same": self.same}
        said = [f"{word} in {rest.pop(word)} of {self.count}",
                *(f"{other} in {times}" for other, times in rest.items() if times)]
        return f"{', '.join(said)}, {probability(self.p)}"


def spread(values: Array) -> Spread | None:
    """Return the spread of the finite ones of values (N,); None if there is none."""
    known = values[np.isfinite(values)]
    if not known.size:
        return None
    least, lower, median, upper, largest = map(float, np.percentile(known, [0, 25, 50, 75, 100]))
    return Spread(known.size, median, lower, upper, least, largest)


def paired(first: Array, second: Array, same: float = SAME) -> Paired:
    """Compare two columns (N,) whose rows are the same samples.

    same : relative difference within which two values count as one.
    """
    known = np.isfinite(first) & np.isfinite(second)
    a, b = first[known], second[known]
    apart = b - a
    apart[np.abs(apart) <= same * np.maximum(np.abs(a), np.abs(b))] = 0.0
    if not apart.size:
        return Paired(0, 0, 0, 0, np.nan, (np.nan, np.nan), 1.0)
    low, median, high = np.percentile(apart, [25.0, 50.0, 75.0])
    return Paired(apart.size, int((apart == 0.0).sum()), int((apart < 0.0).sum()),
                  int((apart > 0.0).sum()), float(median), (float(low), float(high)),
                  _signed_rank(apart[apart != 0.0]))


def _signed_rank(apart: Array) -> float:
    """Return the two-sided p-value of the signed-rank test (Wilcoxon 1945).

    Exact up to EXACT pairs; with ties, scipy is not, or tries all signs, which takes a second.
    """
    if apart.size < FEWEST:
        return 1.0
    if apart.size > EXACT:
        from scipy.stats import wilcoxon

        return float(wilcoxon(apart, method="asymptotic").pvalue)
    _, place, count = np.unique(np.abs(apart), return_inverse=True, return_counts=True)
    ranks = (2 * np.cumsum(count) - count + 1)[place]  # twice the mean rank of those that are equal
    ways = np.zeros(ranks.sum() + 1)  # in which signs give each sum of positive ranks
    ways[0] = 1.0
    for rank in ranks:
        ways[rank:] += ways[:-rank].copy()
    found = ranks[apart > 0.0].sum()
    tails = ways[:found + 1].sum(), ways[found:].sum()
    return float(min(1.0, 2.0 * min(tails) / ways.sum()))


def best(columns: Mapping[str, Array], lower_is_better: bool) -> tuple[str, ...]:
    """Return the columns that are better than all others, and equal among themselves.

    Empty if another column is not distinguishable from the best: then nothing is best. The level
    of the tests is corrected for their number (Holm 1979).
    """
    known = {label: values for label, values in columns.items() if np.isfinite(values).any()}
    if len(known) < 2 or len(known) < len(columns):
        return ()
    medians = {label: float(np.nanmedian(values)) for label, values in known.items()}
    first = (min if lower_is_better else max)(medians, key=lambda label: medians[label])
    against = {label: paired(known[first], values) for label, values in known.items()
               if label != first}
    equal = [label for label, one in against.items() if one.equal]
    other = {label: one for label, one in against.items() if not one.equal}
    if not other or max(holm([one.p for one in other.values()])) >= LEVEL:
        return ()
    if any((one.median < 0.0) == lower_is_better for one in other.values()):
        return ()
    return (first, *equal)


def holm(p: Sequence[float]) -> list[float]:
    """Return p-values adjusted for their number by Holm's step-down procedure (1979)."""
    adjusted, largest = [1.0] * len(p), 0.0
    for rank, i in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        largest = max(largest, min(1.0, (len(p) - rank) * p[i]))
        adjusted[i] = largest
    return adjusted


def wilson(met: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after Wilson (1927); 0 to 1 where nothing is known."""
    from scipy.stats import binomtest

    if of == 0:
        return 0.0, 1.0
    low, high = binomtest(met, of).proportion_ci(confidence_level=0.95, method="wilson")
    return float(low), float(high)


def probability(p: float) -> str:
    """Return a p-value in words: "p < 0.001" or "p = 0.012"."""
    return "p < 0.001" if p < 1e-3 else f"p = {p:.2g}"
