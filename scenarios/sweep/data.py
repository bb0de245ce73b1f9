"""The statistics of a sweep as plain data for a JSON file."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from scenarios.sweep.planning import Plan
from scenarios.sweep.results import Results
from scenarios.sweep.verdict import verdict


def as_plain_data(plan: Plan, found: Mapping[str, Results], command: str,
                  versions: Mapping[str, str]) -> dict[str, Any]:
    """Return what `results.json` holds: spread, paired differences and shares, in SI units."""
    return {"command": command, "samples": plan.sweep.samples, "seed": plan.sweep.seed,
            "versions": dict(versions), "refused": list(plan.refused),
            "groups": {name: _group(results) for name, results in found.items()}}


def _group(results: Results) -> dict[str, Any]:
    return {"verdict": list(verdict(results)),
            "columns": {label: _column(results, label) for label in results.labels},
            "failures": [{"reason": one.reason, "resolver": one.run.label, "runs": one.count}
                         for one in results.failures()]}


def _column(results: Results, label: str) -> dict[str, Any]:
    """Return the shares and metrics of a column, each beside the first column."""
    shares = {}
    for criterion in results.criteria():
        share = results.share(criterion, label)
        shares[criterion.label] = {"met": share.met, "of": share.of,
                                   "wilson_95": list(share.interval)}
    return {"shares": shares, "metrics": {metric.name: _metric(results, metric.name, label)
                                          for metric in results.shown()}}


def _metric(results: Results, name: str, label: str) -> dict[str, Any]:
    found, metric = results.spread(name, label), results.metrics[name]
    known = {} if found is None else dataclasses.asdict(found)
    beside = {} if label == results.labels[0] else {
        "against_first": {**dataclasses.asdict(results.paired(name, label)),
                          "said": str(results.paired(name, label))}}
    return {"label": metric.label, "unit": metric.unit, **known, **beside,
            "best": label in results.best(metric)}
