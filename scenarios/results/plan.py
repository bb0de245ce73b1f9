"""Turn a sweep into its runs, each with a key derived from its content."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hierarchy import plugins
from hierarchy.errors import HierarchyError
from scenarios.config import Scenario, ScenarioError, load
from scenarios.config.distributions import Value
from scenarios.config.resolvers import check_names, usable
from scenarios.config.sampling import changed, drawn
from scenarios.measure.runs import Run
from scenarios.results.run import Job, digest, key_of
from scenarios.results.sweep_file import Sweep


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
    asked = _loaded(sweep) if scenarios is None else scenarios
    columns, refused = side_by_side(asked, sweep.resolvers or None, f"sweep {sweep.name!r}: ")
    alone = len({run.spec for run in columns}) == 1 and len(asked) > 1
    versions = digest()
    runs: dict[str, Planned] = {}
    for index in range(sweep.samples):
        for scenario in asked:
            values = _drawn(sweep, index, scenario)
            what = f"sweep {sweep.name!r}: sample {index} of scenario {scenario.name!r}"
            text = changed(scenario, values, what).to_toml()
            for run in columns:
                if run.scenario.name == scenario.name:
                    key = key_of(text, run.spec, versions)
                    job = Job(key, text, run.spec, scenario.name, index, values, plugins.loaded())
                    runs.setdefault(key, Planned(run.spec if alone else scenario.name, run.label,
                                                 job))
    return Plan(sweep, tuple(asked), tuple(runs.values()), refused)


def _drawn(sweep: Sweep, index: int, scenario: Scenario) -> dict[str, Value]:
    """Return the values of a sample: the scenario's own variation, overridden by the sweep's."""
    if sweep.variation and not scenario.variation:
        raise ScenarioError(f"scenario {scenario.name!r} has no [variation] to sample from; add "
                            "one, such as start.q = { around = 0.02 }")
    own = drawn(scenario, scenario.variation, sweep.seed, index) if sweep.variation else {}
    return own | drawn(scenario, sweep.parameters, sweep.seed, index,
                       f"sweep {sweep.name!r}: parameters")


def _loaded(sweep: Sweep) -> tuple[Scenario, ...]:
    lasting = {} if sweep.duration is None else {"control.duration": sweep.duration}
    return tuple(load(name, lasting) for name in sweep.scenarios)


def side_by_side(scenarios: Sequence[Scenario], specs: Sequence[str] | None, what: str = ""
                 ) -> tuple[list[Run], tuple[str, ...]]:
    """Return every scenario under every resolver that can resolve it, and why others cannot.

    A run is labelled by its resolver, by its spec if another resolver has the same label, and by
    its scenario if there is one resolver for several scenarios.

    Raises
    ------
    HierarchyError : two scenarios of one name, with `what` in front; a scenario that does not fit
        its robot; an unknown resolver or setting; no resolver that can resolve any scenario.
    """
    from scenarios.cell.build import build

    check_names(scenarios, what)
    runs: list[Run] = []
    refused: list[str] = []
    for scenario in scenarios:
        build(scenario)
        can, cannot = usable(scenario, specs)
        labels = {spec: str(one.make_resolver().label) for spec, one in can.items()}
        shared = Counter(labels.values())
        runs += [Run(one, spec, spec if shared[labels[spec]] > 1 else labels[spec])
                 for spec, one in can.items()]
        refused += cannot
    if not runs:
        raise HierarchyError("; ".join(refused) or "no resolver was given")
    if len(runs) > 1 and len({run.spec for run in runs}) == 1:
        runs = [replace(run, label=run.scenario.name) for run in runs]
    return runs, tuple(refused)
