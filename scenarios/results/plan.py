"""Turn a sweep into its runs, each with a key derived from its content."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hierarchy import plugins
from hierarchy.errors import HierarchyError
from scenarios.config import Scenario, load
from scenarios.config.distributions import Value
from scenarios.config.resolvers import check_names, usable
from scenarios.config.sampling import changed, drawn
from scenarios.results.run import Job, digest, key_of
from scenarios.results.sweep_file import Sweep, SweepError


@dataclass(frozen=True)
class Planned:
    """A run of a sweep: `group` are the runs it stands beside, `label` its column there."""

    group: str
    label: str
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


def plan(sweep: Sweep, scenarios: Sequence[Scenario] | None = None) -> Plan:
    """Return the runs of a sweep, sample by sample.

    scenarios : in place of those that the sweep names.

    Raises
    ------
    HierarchyError : an unknown scenario, resolver or setting, a scenario that does not fit its
        robot, a parameter that a scenario does not have, an invalid sampled value.
    """
    asked = _checked(sweep, _loaded(sweep) if scenarios is None else scenarios)
    labels, refused = _resolvers(asked, sweep.resolvers)
    specs = {spec for named in labels.values() for spec in named}
    one = next(iter(specs)) if len(specs) == 1 and len(asked) > 1 else None
    versions = digest()
    runs: dict[str, Planned] = {}
    for index in range(sweep.samples):
        for scenario in asked:
            values = _drawn(sweep, index, scenario)
            what = f"sweep {sweep.name!r}: sample {index} of scenario {scenario.name!r}"
            text = changed(scenario, values, what).to_toml()
            for spec, label in labels[scenario.name].items():
                key = key_of(text, spec, versions)
                job = Job(key, text, spec, scenario.name, index, values, plugins.loaded())
                runs.setdefault(key, Planned(one or scenario.name,
                                             scenario.name if one else label, job))
    return Plan(sweep, tuple(asked), tuple(runs.values()), refused)


def _drawn(sweep: Sweep, index: int, scenario: Scenario) -> dict[str, Value]:
    """Return the values of a sample: the scenario's own variation, overridden by the sweep's."""
    own = drawn(scenario, scenario.variation, sweep.seed, index) if sweep.variation else {}
    return own | drawn(scenario, sweep.parameters, sweep.seed, index,
                       f"sweep {sweep.name!r}: parameters")


def _loaded(sweep: Sweep) -> tuple[Scenario, ...]:
    lasting = {} if sweep.duration is None else {"control.duration": sweep.duration}
    return tuple(load(name, lasting) for name in sweep.scenarios)


def _checked(sweep: Sweep, scenarios: Sequence[Scenario]) -> Sequence[Scenario]:
    from scenarios.cell.build import build

    check_names(scenarios, f"sweep {sweep.name!r}: ")
    for scenario in scenarios:
        build(scenario)
        if sweep.variation and not scenario.variation:
            raise SweepError(f"scenario {scenario.name!r} has no [variation] to sample from; add "
                             "one, such as start.q = { around = 0.02 }")
    return scenarios


def _resolvers(scenarios: Sequence[Scenario], specs: Sequence[str]
               ) -> tuple[Mapping[str, Mapping[str, str]], tuple[str, ...]]:
    """Return the labels of the usable specs by scenario, and why others are not usable."""
    labels: dict[str, dict[str, str]] = {}
    refused: list[str] = []
    for scenario in scenarios:
        can, cannot = usable(scenario, specs or None)
        labels[scenario.name] = distinct({spec: str(one.make_resolver().label)
                                          for spec, one in can.items()})
        refused += cannot
    if not any(labels.values()):
        raise HierarchyError("; ".join(refused) or "no resolver was given")
    return labels, tuple(refused)


def distinct(labels: Mapping[str, str]) -> dict[str, str]:
    """Return labels by spec; specs of the same label are called by their spec."""
    found = list(labels.values())
    return {spec: spec if found.count(label) > 1 else label for spec, label in labels.items()}
