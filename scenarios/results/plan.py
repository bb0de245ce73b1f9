"""A sweep: the validated form of its file, and its runs, each with a key of its content."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError, file_path
from scenarios.cell.build import build
from scenarios.config import Scenario, ScenarioError, is_shipped, load
from scenarios.config.distributions import Parameters
from scenarios.config.resolvers import check_names, usable
from scenarios.config.sampling import changed, drawn
from scenarios.config.sections import Name, Section
from scenarios.config.validation import validated
from scenarios.measure.runs import Run
from scenarios.results.run import Job, digest, key_of
from scenarios.toml_text import read_toml

LIBRARY = Path(__file__).parents[1] / "library" / "sweeps"


class Sweep(Section):
    """Every scenario under every resolver, with each of `samples` draws of the parameters.

    `parameters` are dotted keys of a scenario, with numbers as list indices. A drawn value depends
    only on `seed`, the sample's number and the key: adding samples, scenarios, resolvers or
    parameters does not change existing samples. `duration` [s] overrides that of the scenarios.
    With `variation` the scenarios' own `[variation]` is drawn too. Without resolvers each scenario
    has those that `hierarchy compare` takes by default.
    """

    name: Name
    title: str = ""
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]
    resolvers: tuple[str, ...] = ()
    duration: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    samples: Annotated[int, Field(ge=1)]
    seed: Annotated[int, Field(ge=0)] = 0
    variation: bool = False
    parameters: Parameters = Field(default_factory=dict)


def shipped_sweeps() -> tuple[str, ...]:
    """Return the names of the sweeps shipped with the package."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml")))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a shipped sweep by name, or the given path; raises UnknownNameError."""
    if (path := file_path("sweep", name_or_path)).suffix == ".toml":
        return path
    if str(name_or_path) not in shipped_sweeps():
        scenario = (f"{str(name_or_path)!r} is a scenario, for `hierarchy run` and `hierarchy "
                    "compare`.") if is_shipped(str(name_or_path)) else ""
        raise UnknownNameError("sweep", str(name_or_path), shipped_sweeps(), scenario)
    return LIBRARY / f"{name_or_path}.toml"


def load_sweep(name_or_path: str | Path) -> Sweep:
    """Read a shipped sweep by name or a sweep file by path.

    Paths of scenario files in it are relative to the file, and absolute in the returned sweep.
    Raises ScenarioError, naming the file and the key, and UnknownNameError for an unknown name.
    """
    path = find(name_or_path)
    data = read_toml(path, "sweep file", ScenarioError)
    if not {"scenarios", "samples"} & data.keys() and {"robot", "extends", "control"} & data.keys():
        raise ScenarioError(f"{path} is a scenario, to be run by `hierarchy run {path}`")
    sweep = validated(Sweep, data, str(path))
    return sweep.model_copy(update={"scenarios": tuple(
        str(path.parent.resolve() / name) if name.endswith(".toml") or ".toml:" in name else name
        for name in sweep.scenarios)})


@dataclass(frozen=True)
class Plan:
    """All runs of a sweep, without duplicates.

    `scenarios` are unchanged; `refused` says why a resolver cannot resolve a scenario.
    """

    sweep: Sweep
    scenarios: tuple[Scenario, ...]
    runs: tuple[Job, ...]
    refused: tuple[str, ...]


def plan(sweep: Sweep, scenarios: Sequence[Scenario] | None = None) -> Plan:
    """Return the runs of a sweep, sample by sample, of `scenarios` or those that it names.

    Raises
    ------
    HierarchyError : an unknown scenario, resolver or setting, a scenario that does not fit its
        robot, a parameter that a scenario does not have, an invalid sampled value.
    """
    lasting = {"control.duration": sweep.duration} if sweep.duration else {}
    asked = [load(name, lasting) for name in sweep.scenarios] if scenarios is None else scenarios
    columns, refused = side_by_side(asked, sweep.resolvers or None, f"sweep {sweep.name!r}: ")
    alone = len({run.spec for run in columns}) == 1 and len(asked) > 1
    versions = digest()
    runs: dict[str, Job] = {}
    for index in range(sweep.samples):
        for scenario in asked:
            if sweep.variation and not scenario.variation:
                raise ScenarioError(f"scenario {scenario.name!r} has no [variation] to sample "
                                    "from; add one, such as start.q = { around = 0.02 }")
            own = scenario.variation if sweep.variation else {}
            values = drawn(scenario, own, sweep.seed, index) | drawn(
                scenario, sweep.parameters, sweep.seed, index, f"sweep {sweep.name!r}: parameters")
            what = f"sweep {sweep.name!r}: sample {index} of scenario {scenario.name!r}"
            text = changed(scenario, values, what).to_toml()
            for run in columns:
                if run.scenario.name == scenario.name:
                    key = key_of(text, run.spec, versions)
                    runs.setdefault(key, Job(
                        key, text, run.spec, scenario.name, index, values, plugins.loaded(),
                        run.spec if alone else scenario.name, run.label))
    return Plan(sweep, tuple(asked), tuple(runs.values()), refused)


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
