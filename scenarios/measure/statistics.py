"""Statistics over sampled starts: spread, paired differences, shares.

A closed loop amplifies small differences, so that one run says little. Two resolvers are compared
on the same samples, sample by sample, and a difference counts only if a test tells it from chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.problem import Array
from scenarios.measure.metric import NOTHING

LEVEL = 0.05     # probability of calling a difference real that is chance
SAME = 1e-3      # relative difference below which two values count as the same, as below NOTHING
FEWEST = 6       # pairs that differ; with fewer the signed-rank test cannot reach LEVEL
EXACT = 50       # pairs that differ, up to which the test is exact


@dataclass(frozen=True)
class Paired:
    """The differences of one quantity between two runs on the same samples: second minus first.

    count : pairs in which both values are known. alone : samples in which only one of them is.
    same : pairs within SAME of each other.
    lower, higher : pairs in which the second is lower or higher than the first.
    median, quartiles : of all differences. p : two-sided probability of such differences by
        chance, after Wilcoxon's signed-rank test of the pairs that differ (1 if too few do).
    ranks : from -1 to 1, the sum of the signed ranks of that test over that of all ranks.
    """

    count: int
    alone: int
    same: int
    lower: int
    higher: int
    median: float
    quartiles: tuple[float, float]
    p: float
    ranks: float

    @property
    def differ(self) -> int:
        """Number of pairs that differ."""
        return self.count - self.same

    @property
    def equal(self) -> bool:
        """Whether no pair differs, and no sample is without a pair."""
        return not self.differ and not self.alone

    @property
    def side(self) -> int:
        """1 if the second is higher, -1 if it is lower, 0 if ranks and most pairs disagree."""
        most = np.sign(self.higher - self.lower)
        return int(most) if most == np.sign(self.ranks) else 0

    @property
    def distinguishable(self) -> bool:
        """Whether the test tells the two apart, in the direction of most pairs that differ."""
        return self.p < LEVEL and self.side != 0

    def __str__(self) -> str:
        said = ("no pair" if not self.count else "the same" if not self.differ else
                self._apart() if self.distinguishable else "not distinguishable")
        return said + (f"; {self.alone} without a pair" if self.alone else "")

    def _apart(self) -> str:
        rest = {"lower": self.lower, "higher": self.higher, "the same": self.same}
        word = "higher" if self.side > 0 else "lower"
        said = [f"{word} in {rest.pop(word)} of {self.count}",
                *(f"{other} in {times}" for other, times in rest.items() if times)]
        return f"{', '.join(said)}, {probability(self.p)}"


def spread(values: Array) -> dict[str, float]:
    """Return number, median, quartiles, least and largest of finite values (N,); {} if none is."""
    known = values[np.isfinite(values)]
    if not known.size:
        return {}
    names = "median", "lower", "upper", "least", "largest"
    found = np.percentile(known, [50, 25, 75, 0, 100]).tolist()
    return {"count": known.size, **dict(zip(names, found, strict=True))}


def paired(first: Array, second: Array) -> Paired:
    """Compare two columns (N,) whose rows are the same samples."""
    known = np.isfinite(first) & np.isfinite(second)
    alone = int((np.isfinite(first) != np.isfinite(second)).sum())
    a, b = first[known], second[known]
    apart = b - a
    apart[np.abs(apart) <= np.maximum(SAME * np.maximum(np.abs(a), np.abs(b)), NOTHING)] = 0.0
    if not apart.size:
        return Paired(0, alone, 0, 0, 0, np.nan, (np.nan, np.nan), 1.0, 0.0)
    low, median, high = np.percentile(apart, [25.0, 50.0, 75.0])
    return Paired(apart.size, alone, int((apart == 0.0).sum()), int((apart < 0.0).sum()),
                  int((apart > 0.0).sum()), float(median), (float(low), float(high)),
                  *_signed_rank(apart[apart != 0.0]))


def _signed_rank(apart: Array) -> tuple[float, float]:
    """Return two-sided p-value and rank sum, see Paired, of the test of Wilcoxon (1945).

    Exact up to EXACT pairs; with ties, scipy is not, or tries all signs, which takes a second.
    """
    sizes = np.sort(np.abs(apart))
    ties = sizes[np.diff(sizes, prepend=-1.0) > NOTHING]  # the least of those equal to rounding
    place = np.searchsorted(ties, np.abs(apart), side="right") - 1
    count = np.bincount(place)
    ranks = (2 * np.cumsum(count) - count + 1)[place]  # twice the mean rank of those that are equal
    signed = float(np.sign(apart) @ ranks / max(ranks.sum(), 1))
    if apart.size < FEWEST:
        return 1.0, signed
    if apart.size > EXACT:
        from scipy.stats import wilcoxon

        return float(wilcoxon(np.sign(apart) * ranks, method="asymptotic").pvalue), signed
    ways = np.zeros(ranks.sum() + 1)  # in which signs give each sum of positive ranks
    ways[0] = 1.0
    for rank in ranks:
        ways[rank:] += ways[:-rank].copy()
    found = ranks[apart > 0.0].sum()
    tails = ways[:found + 1].sum(), ways[found:].sum()
    return float(min(1.0, 2.0 * min(tails) / ways.sum())), signed


def best(columns: Mapping[str, Array], lower_is_better: bool, level: float = LEVEL
         ) -> tuple[str, ...]:
    """Return the columns that are better than all others, and equal among themselves.

    Empty if another column is not distinguishable from the best, or known in a sample in which
    that is not: then nothing is best. The `level` of the tests is corrected for their number (Holm
    1979).
    """
    cost = {label: values if lower_is_better else -values for label, values in columns.items()}
    known = {label: np.isfinite(values) for label, values in cost.items()}
    if len(known) < 2 or not all(one.any() for one in known.values()):
        return ()
    middle = {label: (round(float(np.nanmedian(values)), 9), float(np.nanmean(values)))
              for label, values in cost.items()}  # counts often have the same median
    first = min(middle, key=lambda label: middle[label])
    against = {label: paired(cost[first], values) for label, values in cost.items()}
    other = [one for one in against.values() if not one.equal]
    if not other or max(holm([one.p for one in other])) >= level:
        return ()
    if any(one.side < 1 for one in other) or any(
            (one & ~known[first]).any() for one in known.values()):
        return ()
    return tuple(label for label, one in against.items() if one.equal)


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
