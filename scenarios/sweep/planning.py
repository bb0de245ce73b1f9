"""Turn a sweep into its runs, each with a key derived from its content."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from hierarchy.errors import HierarchyError
from scenarios.config import Scenario, load
from scenarios.sweep.config import Sweep, SweepError, Value
from scenarios.sweep.run import Job, digest, key_of
from scenarios.sweep.sampling import changed, drawn


@dataclass(frozen=True)
class Planned:
    """A run of a sweep: scenario, resolver, sample and sampled values."""

    scenario: str
    label: str
    sample: int
    values: dict[str, Value]
    job: Job


@dataclass(frozen=True)
class Plan:
    """All runs of a sweep, without duplicates.

    `scenarios` are unchanged; `refused` has the reason for each resolver that cannot resolve a
    scenario.
    """

    sweep: Sweep
    scenarios: tuple[Scenario, ...]
    runs: tuple[Planned, ...]
    refused: tuple[str, ...]


def plan(sweep: Sweep) -> Plan:
    """Return the runs of a sweep, sample by sample.

    Raises
    ------
    HierarchyError : an unknown scenario, resolver or setting, a scenario that does not fit its
        robot, a parameter that a scenario does not have, an invalid sampled value.
    """
    scenarios = _loaded(sweep)
    labels, refused = _resolvers(scenarios, sweep.resolvers)
    versions = digest()
    runs: dict[str, Planned] = {}
    for index in range(sweep.samples):
        for scenario in scenarios:
            values = drawn(sweep, index, scenario)
            what = f"sweep {sweep.name!r}: sample {index} of scenario {scenario.name!r}"
            text = changed(scenario, values, what).to_toml()
            for spec, label in labels[scenario.name].items():
                key = key_of(text, spec, versions)
                runs.setdefault(key, Planned(scenario.name, label, index, values,
                                             Job(key, text, spec)))
    return Plan(sweep, scenarios, tuple(runs.values()), refused)


def _loaded(sweep: Sweep) -> tuple[Scenario, ...]:
    from scenarios.cell.build import build

    lasting = {} if sweep.duration is None else {"control.duration": sweep.duration}
    scenarios = tuple(load(name, lasting) for name in sweep.scenarios)
    for name, count in Counter(scenario.name for scenario in scenarios).items():
        if count > 1:
            raise SweepError(f"sweep {sweep.name!r}: scenarios: {count} are named {name!r}; give "
                             "each its own name")
    for scenario in scenarios:
        build(scenario)
    return scenarios


def _resolvers(scenarios: Sequence[Scenario], specs: Sequence[str]
               ) -> tuple[dict[str, dict[str, str]], tuple[str, ...]]:
    """Return the labels of the usable specs by scenario, and why others are not usable."""
    labels: dict[str, dict[str, str]] = {}
    refused = []
    for scenario in scenarios:
        changed = {spec: scenario.with_resolver(spec) for spec in specs}
        made = {spec: one.make_resolver() for spec, one in changed.items()}
        can = {spec: str(one.label) for spec, one in made.items()
               if one.can_resolve(changed[spec].asks)}
        refused += [f"{spec} is not run on {scenario.name}, which asks for {changed[spec].asks}: "
                    f"it resolves {one.handles}" for spec, one in made.items() if spec not in can]
        shared = Counter(can.values())
        labels[scenario.name] = {spec: spec if shared[label] > 1 else label
                                 for spec, label in can.items()}
    if not any(labels.values()):
        raise HierarchyError("; ".join(refused))
    return labels, tuple(refused)
