"""A sweep: the validated form of its file, its runs, each with a key of its content; one run."""

import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

from pydantic import Field

from hierarchy import plugins
from hierarchy.errors import UnknownNameError, file_path, refuse
from scenarios.cell.build import build
from scenarios.config import Scenario, ScenarioError, is_shipped, load
from scenarios.config import sections as keys
from scenarios.config.distributions import Parameters
from scenarios.config.files import files_in, make_absolute
from scenarios.config.resolvers import usable
from scenarios.config.scenario import OWN
from scenarios.config.sections import Name, Section
from scenarios.config.validation import validated
from scenarios.measure.metrics import Metric, measure
from scenarios.measure.run_folder import versions
from scenarios.measure.runs import Run
from scenarios.recording.recording import Recording
from scenarios.toml_text import read_toml

# Code that only requests or shows runs: changing it does not change the measurements.
_NOT_IN_A_RUN = ("cli/", "draw/", "export/", "library/", "problems/", "results/", "scene/",
                 "files.py", "templates.py", *(f"measure/{name}.py" for name in (
                     "goals", "motions", "runs", "statistics", "verdict")))
_NAMED = re.compile(rb"""\bfile(?:name)?=["']([^"'\0]+)["']""")  # in URDF and MJCF
_PLACE = ("system", "processor")  # entries of versions() that describe the machine


@dataclass(frozen=True)
class Job:
    """A planned run: the scenario's text, the resolver, the key of both, and needed plugins.

    sample, values : the number of the sample, and what was sampled by dotted key. group, label :
    the runs that it stands beside, and its column there.
    """

    key: str
    text: str
    resolver: str
    scenario: str = ""
    sample: int = 0
    values: Mapping[str, Any] = field(default_factory=dict)
    plugins: tuple[str, ...] = ()
    group: str = ""
    label: str = ""

    def load(self) -> Scenario:
        """Return the scenario under its resolver, after importing the plugins."""
        for module in self.plugins:
            plugins.allow(module)
        return Scenario.from_toml(self.text).with_resolver(self.resolver)


@dataclass(frozen=True)
class Outcome:
    """What came of a run; `reason` says why it did not reach its end, otherwise None.

    wall_seconds : how long it took [s], None if that is not known.
    """

    key: str
    ticks: int
    reason: str | None
    wall_seconds: float | None
    metrics: tuple[Metric, ...] = ()


Measured = Callable[[Scenario], tuple[Recording, tuple[Metric, ...]]]


def key_of(text: str, resolver: str, versions: str) -> str:
    """Return the key of a run, which is the same for the same scenario, resolver and code."""
    return hashlib.sha256("\0".join((text, resolver, versions)).encode()).hexdigest()[:32]


def digest() -> str:
    """Return a digest of everything besides the scenario that the numbers of a run depend on.

    This is the source code used in a run, including kernels and plugins, and the versions of
    dependencies.
    """
    return _of_the_package() + plugins.fingerprint()


@cache
def _of_the_package() -> str:
    root = Path(__file__).parents[2]
    used = {name: version for name, version in versions().items() if name not in _PLACE}
    found = hashlib.sha256(json.dumps(used, sort_keys=True).encode())
    for package in ("hierarchy", "solvers", "scenarios"):
        for path in sorted((root / package).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if not name.removeprefix("scenarios/").startswith(_NOT_IN_A_RUN):
                found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def simulated(scenario: Scenario) -> tuple[Recording, tuple[Metric, ...]]:
    """Return the recording of a run and what is measured on it."""
    from scenarios import simulate

    recording = simulate(scenario)
    return recording, tuple(measure(recording).values())


def outcome(job: Job, measured: Measured = simulated) -> Outcome:
    """Make a run and measure it; an exception becomes its reason."""
    begun = perf_counter()
    try:
        recording, metrics = measured(job.load())
    except Exception as error:  # the failed run is a row too, with the reason
        return Outcome(job.key, 0, f"{type(error).__name__}: {error}", perf_counter() - begun)
    return Outcome(job.key, recording.ticks, recording.fault, perf_counter() - begun, metrics)


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
    duration: keys.Span | None = None
    samples: Annotated[keys.Number, Field(le=1_000_000)]  # some kB each in memory
    seed: keys.Count = 0
    variation: keys.Flag = False
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

    Paths of files in it are relative to the file, and absolute in the returned sweep.
    Raises ScenarioError, naming the file and the key, and UnknownNameError for an unknown name.
    """
    path = find(name_or_path)
    data = read_toml(path, "sweep file", ScenarioError)
    if not {"scenarios", "samples"} & data.keys() and {"robot", "extends", "control"} & data.keys():
        raise ScenarioError(f"{path} is a scenario, to be run by `hierarchy run {path}`")
    make_absolute(data, path.parent.resolve())
    sweep = validated(Sweep, data, str(path))
    return sweep.model_copy(update={"scenarios": tuple(
        str(path.parent.resolve() / name) if name.endswith(".toml") or ".toml:" in name else name
        for name in sweep.scenarios)})


def _content(path: str) -> str:
    """Return a digest of a file, or of all in a folder: what a run depends on beside its text.

    Beside a robot's file those count that it includes, and meshes, if they are named from there.
    """
    here = Path(path)
    files, texts = sorted(here.iterdir()) if here.is_dir() else [here], list[bytes]()
    for file in files:
        texts.append(file.read_bytes() if file.is_file() else b"")
        named = (here.parent / os.fsdecode(name) for name in _NAMED.findall(texts[-1]))
        files += [one for one in dict.fromkeys(named) if one not in files]
    return hashlib.sha256(b"".join(texts)).hexdigest()[:16]


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
    alone = len({run.spec for run in columns}) == 1 < len(columns)
    code, content = digest(), cache(_content)
    runs: dict[str, Job] = {}
    for index in range(sweep.samples):
        for scenario in asked:
            if sweep.variation and not scenario.variation:
                raise ScenarioError(f"scenario {scenario.name!r} has no [variation] to sample "
                                    "from; add one, such as start.q = { around = 0.02 }")
            values = scenario.drawn(sweep.seed, index) if sweep.variation else {}
            values |= scenario.drawn(sweep.seed, index, sweep.parameters,
                                     f"sweep {sweep.name!r}: parameters")
            what = f"sweep {sweep.name!r}: sample {index} of scenario {scenario.name!r}"
            refuse("control.resolver" in values and {run.spec for run in columns} != {OWN},
                   f"{what}: control.resolver is drawn, but the resolvers of the sweep replace it; "
                   f"give it the one resolver {OWN!r}")
            sample = scenario.with_drawn(values, what)
            text = sample.to_toml()
            files = [table[key] for table, key in files_in(sample.model_dump(mode="json"))]
            for run in columns:
                if run.scenario.name == scenario.name:
                    key = key_of(text, run.spec, "".join((code, *map(content, files))))
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
    for name, count in Counter(scenario.name for scenario in scenarios).items():
        refuse(count > 1, f"{what}{count} scenarios are named {name!r}; give each its own name")
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
    refuse(not scenarios, f"{what}no scenario was given")
    refuse(not runs, "; ".join(refused) or f"{what}no resolver was given")
    if len(runs) > 1 and len({run.spec for run in runs}) == 1:
        runs = [replace(run, label=run.scenario.name) for run in runs]
    return runs, tuple(refused)
