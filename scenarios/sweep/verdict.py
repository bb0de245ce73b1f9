"""What a sweep comes to, in three lines made from its statistics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hierarchy.words import listed
from scenarios.config import Scenario
from scenarios.measure.metrics import Metric
from scenarios.measure.runs import caveats
from scenarios.recording.facts import resolver_facts
from scenarios.sweep.results import Criterion, Results, Share, valued

_DISTANCE = "Kept the distance asked for"
_IN_WORDS = {"Reached the end": "reached the end", "Touched nothing": "touched nothing",
             "Kept the joint limits": "kept the joint limits",
             "Every tick solved": "had every tick solved", _DISTANCE: "kept the distance asked for"}
# What is weighed in the last line, in this order, and in which words.
_WEIGHED = {"position_error_median_settled": "path error", "body_distance_min": "body distance",
            "ee_distance_min": "end effector distance", "cone_violation_max": "excess of the cone",
            "speed_max": "joint speed", "acceleration_max": "joint acceleration"}


def verdict(results: Results) -> tuple[str, ...]:
    """Return what went wrong and how often, which columns are the same, and what to use."""
    said = success(results), _sentence(_sameness(results)), _sentence(_advice(results))
    return tuple(line for line in said if line)


def success(results: Results) -> str:
    """Return in how many runs each criterion was met, for all resolvers together if equal."""
    said: dict[str, list[str]] = {}
    for criterion in (*results.criteria()[:-1], *_distances(results)):
        said.setdefault(_who(results, criterion), []).append(_IN_WORDS[criterion.label])
    text = "; ".join(f"{who} {listed(did)}" for who, did in said.items())
    return f"{text[0].upper()}{text[1:]}."


def _distances(results: Results) -> Iterator[Criterion]:
    """Yield in which runs no distance that the scenario asks for was given up, if it asks."""
    below = [results.values[name] for name in ("body_below_share", "ee_below_share")
             if name in results.values]
    if below:
        measured = ~np.isnan(below).all(axis=0)
        yield Criterion(_DISTANCE, measured & ~np.any(np.array(below) > 0.0, axis=0))


def _sentence(clauses: Iterator[str]) -> str:
    text = "; ".join(clauses)
    return f"{text}." if text else ""


def _who(results: Results, criterion: Criterion) -> str:
    shares = {label: results.share(criterion, label) for label in results.labels}
    met, of = sum(s.met for s in shares.values()), sum(s.of for s in shares.values())
    if met == of:
        return f"all {of} runs" if of > 1 else "the run"
    if met == 0:
        return "no run"
    if len({(share.met, share.of) for share in shares.values()}) == 1:
        each = " under each resolver" if len(shares) > 1 else ""
        return f"{next(iter(shares.values()))} runs{each}"
    under: dict[str, list[str]] = {}
    for label, share in shares.items():
        under.setdefault(str(share), []).append(label)
    return listed([f"{share} runs under {'each of ' * (len(labels) > 1)}{listed(labels)}"
                   for share, labels in under.items()])


def _sameness(results: Results) -> Iterator[str]:
    """Yield which columns have the same metrics on every sample."""
    groups = _alike(results)
    if len(results.labels) < 2:
        return
    for group in groups:
        if len(group) > 1:
            yield f"{listed(group)} behave the same on every sample"
    if len(groups) == len(results.labels):
        yield "No two behave the same"


def _alike(results: Results) -> list[list[str]]:
    """Return the labels, together where no metric of any sample differs."""
    found: list[list[str]] = []
    for label in results.labels:
        for group in found:
            if all(_equal(results, metric, group[0], label) for metric in results.shown()):
                group.append(label)
                break
        else:
            found.append([label])
    return found


def _equal(results: Results, metric: Metric, first: str, second: str) -> bool:
    return results.paired(metric.name, second, first).equal


def _advice(results: Results) -> Iterator[str]:
    """Yield what to use: by success first, then what is best beyond chance."""
    if len(results.labels) < 2:
        return
    sound = _soundest(results)
    if len(sound) < len(results.labels):
        yield f"Use {listed(sound, 'or')}: the others fail more often than chance explains"
    merits: dict[str, list[str]] = {}
    unclear = []
    for metric in _weighed(results):
        if best := results.best(metric):
            merits.setdefault(listed(best), []).append(_merit(results, metric, best))
        else:
            unclear.append(_WEIGHED[metric.name])
    for who, what in merits.items():
        yield f"{who} is best beyond chance in {listed(what)}"
    if unclear and not merits:
        yield f"None is best beyond chance in {listed(unclear, 'or')}"
    jobs = {run.label: run.job for run in results.runs}
    yield from caveats({label: resolver_facts(Scenario.from_toml(job.text).with_resolver(
        job.resolver)) for label, job in jobs.items()})


def _soundest(results: Results) -> list[str]:
    """Return the labels whose share of flawless runs is not clearly below the best one."""
    flawless = results.criteria()[-1]
    shares = {label: results.share(flawless, label) for label in results.labels}
    top = max(shares.values(), key=_rate)
    return [label for label, share in shares.items() if share.interval[1] >= top.interval[0]]


def _rate(share: Share) -> float:
    return share.met / share.of


def _weighed(results: Results) -> Sequence[Metric]:
    shown = {metric.name: metric for metric in results.shown()}
    return [shown[name] for name in _WEIGHED if name in shown]


def _merit(results: Results, metric: Metric, best: Sequence[str]) -> str:
    """Return a metric with the medians of the best and of the next column."""
    medians = {label: found.median for label in results.labels
               if (found := results.spread(metric.name, label)) is not None}
    others = [value for label, value in medians.items() if label not in best]
    near = min(others) if metric.lower_is_better else max(others)
    shown = [valued(metric, value).shown() for value in (medians[best[0]], near)]
    unit = f" {metric.shown_unit}" if metric.shown_unit else ""
    return f"{_WEIGHED[metric.name]} ({shown[0]}{unit}, next {shown[1]}{unit})"
