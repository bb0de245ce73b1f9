"""What runs say about the claims of the protocol: effect, interval, Holm's p, and a verdict."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import erfc, sqrt

import numpy as np
from numpy.typing import NDArray

from benchmark.reproduce.protocol import Claim, Protocol, Rows
from hierarchy.problem import Array
from scenarios.measure.metric import Metric
from scenarios.measure.statistics import holm, wilson

SUPPORTED, CONTRADICTED = "supported", "contradicted"
NEGLIGIBLE, UNDECIDED = "no effect that matters", "undecided"
DIFFERS = "differs between layouts"


@dataclass(frozen=True)
class Effect:
    """The shift of paired differences from zero: estimate, its 95 % interval, and a p-value."""

    estimate: float
    low: float
    high: float
    p: float


@dataclass(frozen=True)
class Found:
    """What was found about a claim: the effect, in the claim's direction, on all layouts and each.

    Of a bound it is the share of starts from which it is kept. p : after Holm. decided : the
    verdict, which no noise may change.
    """

    claim: Claim
    effect: Effect
    layouts: tuple[Effect, ...]
    p: float
    decided: str


def judged(protocol: Protocol, rows: Rows, family: str) -> list[Found]:
    """Return what was found about the claims of a family."""
    claims = [one for one in protocol.claims if one.family == family]
    exact, noisy = (_judged(protocol, rows, claims, noisy) for noisy in (0, 1))
    return [one if one.decided == other.decided else
            replace(one, decided=f"{UNDECIDED}: with noise {other.decided}")
            for one, other in zip(exact, noisy, strict=True)]


def _judged(protocol: Protocol, rows: Rows, claims: Sequence[Claim], noisy: int) -> list[Found]:
    some = np.ones(rows.blocks.size, dtype=bool), *map(rows.layout, rows.layouts)
    effects = [[_effect(protocol, rows, claim, apart, each) for each in some]
               for claim, apart in ((claim, _apart(rows, claim, noisy)) for claim in claims)]
    adjusted = holm([effect.p for effect, *_ in effects])
    return [Found(claim, effect, tuple(layouts), p, _verdict(protocol, claim, effect, layouts, p))
            for claim, (effect, *layouts), p in zip(claims, effects, adjusted, strict=True)]


def _apart(rows: Rows, claim: Claim, noisy: int) -> Array:
    """Return by how much each start speaks for a claim; of a bound, whether it is kept."""
    if not claim.metric:
        return rows.ended(claim.of, noisy).astype(float)
    found = rows.column(claim.of, claim.metric, noisy)
    if not claim.rival:
        return ((found >= claim.least) & (found <= claim.most)).astype(float)
    rival = rows.column(claim.rival, claim.metric, noisy)
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = np.log(found / rival) if claim.percent else found - rival
    apart = np.where(np.isinf(found) & np.isinf(rival), 0.0, apart)
    return np.asarray(-apart if claim.below else apart)


def _effect(protocol: Protocol, rows: Rows, claim: Claim, apart: Array,
            some: NDArray[np.bool_]) -> Effect:
    if claim.metric and claim.rival:
        return blocked(apart[some], rows.blocks[some])
    from scipy.stats import binomtest

    met, of = int(apart[some].sum()), int(some.sum())
    return Effect(met / of, *wilson(met, of), float(binomtest(met, of, protocol.share).pvalue))


def _verdict(protocol: Protocol, claim: Claim, effect: Effect, layouts: Sequence[Effect],
             p: float) -> str:
    middle, matters = 0.0, claim.matters
    if not (claim.metric and claim.rival):
        middle = protocol.share
    elif claim.percent:
        matters = -np.log1p(-matters / 100.0) if claim.below else np.log1p(matters / 100.0)
    low, high = effect.low - middle, effect.high - middle
    if claim.rival and -matters < low and high < matters:
        return NEGLIGIBLE
    if p >= protocol.level or (low < matters and high > -matters):
        return UNDECIDED
    sides = {float(np.sign(one.estimate - middle)) for one in layouts}
    return DIFFERS if len(sides) > 1 else SUPPORTED if low > 0.0 else CONTRADICTED


def shown(claim: Claim, rows: Rows, effect: Effect) -> str:
    """Return "estimate [low, high] unit" in the claim's own direction and unit."""
    numbers = effect.estimate, effect.low, effect.high
    if not claim.rival:
        return "{:.1f} [{:.1f}, {:.1f}] % of starts".format(*(100.0 * one for one in numbers))
    if claim.below:
        numbers = 0.0 - effect.estimate, 0.0 - effect.high, 0.0 - effect.low  # no minus before 0
    if claim.percent:
        middle, low, high = (100.0 * np.expm1(one) for one in numbers)
        return f"{_signed(middle)} [{_signed(low)}, {_signed(high)}] %"
    metric = Metric(claim.metric, "", None, rows.metrics[claim.metric]["unit"])
    middle, low, high = (replace(metric, value=one).shown() if np.isfinite(one) else
                         "∞" if one > 0.0 else "-∞" for one in numbers)
    return f"{middle} [{low}, {high}] {metric.shown_unit}".strip()


def _signed(percent: float) -> str:
    return "+∞" if percent > 1e5 else f"{percent:+.1f}"


def blocked(differences: Array, blocks: NDArray[np.int64]) -> Effect:
    """Return the shift of differences (N,) whose signs are compared within blocks (N,) only.

    The estimate is that of Hodges and Lehmann (1963), the median of all means of two differences
    of a block; the test is the signed-rank test summed over blocks (normal approximation), and the
    interval is the set of shifts that it does not reject. An infinite difference is the largest;
    what is not a number, such as that of two infinite values, counts as zero.
    """
    apart = np.where(np.isnan(differences), 0.0, differences)
    means, middle, square = [], 0.0, 0.0
    for block in np.unique(blocks):
        own = apart[blocks == block]
        n = own.size
        first, second = np.triu_indices(n)
        with np.errstate(invalid="ignore"):
            means.append(np.nan_to_num((own[first] + own[second]) / 2.0, nan=0.0, posinf=np.inf,
                                       neginf=-np.inf))
        middle += n * (n + 1) / 4.0
        square += n * (n + 1) * (2 * n + 1) / 24.0
    if not means:
        return Effect(np.nan, np.nan, np.nan, 1.0)
    ordered, deviation = np.sort(np.concatenate(means)), float(np.sqrt(square))
    above = (ordered > 0.0).sum() + (ordered == 0.0).sum() / 2.0
    p = erfc(max(abs(above - middle) - 0.5, 0.0) / deviation / sqrt(2.0))
    k = max(int(middle - 1.96 * deviation), 0)
    with np.errstate(invalid="ignore"):
        estimate = np.nan_to_num(np.median(ordered), nan=0.0, posinf=np.inf, neginf=-np.inf)
    return Effect(float(estimate), float(ordered[k]), float(ordered[-1 - k]), p)
