"""The same scenarios under several resolvers: run, measured, and laid side by side."""

from __future__ import annotations

import dataclasses
import json
import math
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hierarchy.errors import HierarchyError
from scenarios import metrics
from scenarios.folders import claim, slug, write_text
from scenarios.metrics import Metric
from scenarios.parting import Parting, partings
from scenarios.recording import Recording, save, versions

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from solvers.resolver import Handles

# By default every way that the letter compares, and ours; where rows are inequalities, the whole
# field of those that take them.
DEFAULT_RESOLVERS: dict[Handles, tuple[str, ...]] = {
    "equalities": ("tpm", "tpm:form=staircase", "recursive", "augmented", "hqp",
                   "hqp:backend=osqp", "hqp:backend=daqp", "hcod"),
    "bounds": ("tpm:form=staircase", "sns", "sns:form=optimal", "weighted", "hqp", "hcod"),
    "inequalities": ("weighted", "hqp", "hqp:backend=daqp", "hcod")}

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Run:
    """One scenario under one resolver, with what came of it.

    `recording` is None when the run could not begin or broke; `error` then says why.
    """

    scenario: Scenario
    spec: str
    label: str
    recording: Recording | None = None
    error: str | None = None

    @property
    def fault(self) -> str | None:
        """Why the run did not reach its end, or None when it did."""
        return self.error or (self.recording.fault if self.recording else None)

    @property
    def folder(self) -> str:
        """Where the run lies below the comparison's own folder."""
        return f"{slug(self.scenario.name)}/{slug(self.spec)}"

    @property
    def settings(self) -> dict[str, Any]:
        """The resolver's settings as they were used."""
        resolver = self.scenario.make_resolver()
        return {field.name: getattr(resolver, field.name) for field in dataclasses.fields(resolver)
                } if dataclasses.is_dataclass(resolver) else {}

    @cached_property
    def metrics(self) -> dict[str, Metric]:
        """What was measured on it, by name; empty without a recording."""
        return metrics.measure(self.recording) if self.recording else {}


@dataclass(frozen=True)
class Row:
    """One line of the table: a metric, its value for each run, and which of them are best."""

    label: str
    unit: str
    group: str
    cells: tuple[str, ...]
    notes: tuple[str, ...]
    best: frozenset[int]
    name: str = ""


@dataclass(frozen=True)
class Comparison:
    """Runs in the order asked for, scenario by scenario.

    `refused` says of each resolver that cannot resolve a scenario why it was not run; `folder` is
    where the runs' folders lie, as it was named, or None if they were not kept.
    """

    runs: tuple[Run, ...]
    command: str
    versions: dict[str, str]
    refused: tuple[str, ...] = ()
    folder: str | None = None

    @property
    def faults(self) -> list[Run]:
        """The runs that did not reach their end."""
        return [run for run in self.runs if run.fault]

    def groups(self) -> dict[str, list[Run]]:
        """Return the runs that stand side by side, with the name of each group.

        Those are the runs of one scenario; or, with one resolver, the runs of all scenarios.
        """
        if len({run.spec for run in self.runs}) == 1:
            return {self.runs[0].spec: list(self.runs)} if len(self.runs) > 1 else {
                self.runs[0].scenario.name: list(self.runs)}
        names = dict.fromkeys(run.scenario.name for run in self.runs)
        return {name: [run for run in self.runs if run.scenario.name == name] for name in names}

    def as_plain_data(self) -> dict[str, Any]:
        """Return what `comparison.json` holds."""
        from scenarios.report.verdict import verdict

        return {"command": self.command, "versions": self.versions,
                "verdicts": {name: verdict(runs) for name, runs in self.groups().items()},
                "runs": [_plain(run) for run in self.runs], "refused": list(self.refused),
                "partings": {name: [_plain_parting(one) for one in partings(runs)]
                             for name, runs in self.groups().items()}}


def default_resolvers(asked: Handles = "equalities") -> tuple[tuple[str, ...], dict[str, str]]:
    """Return those of DEFAULT_RESOLVERS that can run here, and of the others what brings them."""
    from solvers.backends import BACKENDS, installed

    wanted = {spec: spec.partition(":backend=")[2] for spec in DEFAULT_RESOLVERS[asked]}
    missing = {spec: "pip install 'task-hierarchy[qp]'" for spec, backend in wanted.items()
               if backend in BACKENDS and not installed(backend)}
    return tuple(spec for spec in wanted if spec not in missing), missing


def compare(scenarios: Iterable[str | Scenario] | str, resolvers: Sequence[str] | None = None,
            out: str | Path | None = None, progress: Progress | None = None,
            command: str | None = None) -> Comparison:
    """Run every scenario under every resolver, one after the other, and compare.

    A resolver that cannot resolve a scenario's rows is not run on it, and the Comparison says so.

    With `out`, each run's folder is out/<scenario>/<resolver>, the page is out/index.html and the
    numbers are in out/comparison.json. A run that breaks or faults does not lose the others;
    Ctrl-C keeps what was run so far.

    Parameters
    ----------
    scenarios : names, paths or Scenario objects.
    resolvers : specs `name` or `name:setting=value:setting=value`; by default those of
        DEFAULT_RESOLVERS that suit the scenario and are installed.
    progress : called as progress(label, ticks done, ticks in all).
    command : the command line to print on the page; made up from the names if not given.

    Raises
    ------
    HierarchyError : before anything is run: an unknown scenario, resolver or setting, a scenario
        that does not fit its robot, resolvers of which none can resolve anything, or an output
        folder that is in use.
    """
    planned, refused = _plan([scenarios] if isinstance(scenarios, str) else scenarios, resolvers)
    folder = None if out is None else claim(out)
    runs: list[Run] = []
    for run in planned:
        try:
            runs.append(_carried_out(run, folder, progress))
        except KeyboardInterrupt:
            runs.append(dataclasses.replace(run, error="interrupted"))
        if _interrupted(runs[-1]):
            break
    comparison = Comparison(tuple(runs), command or _command(planned, out), versions(),
                            tuple(refused), None if out is None else str(out))
    if folder is not None:
        folder.mkdir(exist_ok=True)
        _write(comparison, folder)
    return comparison


def table(runs: Sequence[Run], details: bool = True) -> list[Row]:
    """Return the rows that compare runs of one scenario, best values marked.

    Only runs of one scenario that reached their end compete: other scenarios ask for other things,
    and a shorter run's numbers cover less time. Values within one percent of the best are as good,
    and where all are, none is marked.
    """
    one_scenario = len({run.scenario.name for run in runs}) == 1
    competes = [one_scenario and run.fault is None for run in runs]
    known = {name: metric for run in runs for name, metric in run.metrics.items()
             if details or not metric.detail}
    return [_row(metric, [run.metrics.get(name) for run in runs], competes)
            for name, metric in known.items()]


def _row(metric: Metric, found: Sequence[Metric | None], competes: Sequence[bool]) -> Row:
    cells = tuple(m.shown() if m else "–" for m in found)
    values = {i: m.value for i, m in enumerate(found)
              if m and m.value is not None and competes[i]}
    return Row(metric.label, metric.shown_unit, metric.group, cells,
               tuple(m.note if m else "" for m in found), _best(values, metric.lower_is_better),
               metric.name)


def _best(values: Mapping[int, float], lower: bool | None, tie: float = 0.01,
          rounding: float = 1e-12) -> frozenset[int]:
    """Return which of the values are as good as the best; empty if all are.

    That is within `tie`, relative, or within what rounding makes of nothing [SI units].
    """
    if lower is None or not values:
        return frozenset()
    winner = min(values.values()) if lower else max(values.values())
    best = frozenset(i for i, value in values.items()
                     if abs(value - winner) <= max(tie * max(abs(value), abs(winner)), rounding))
    return best if len(best) < len(values) else frozenset()


def _plan(scenarios: Iterable[str | Scenario],
          resolvers: Sequence[str] | None) -> tuple[list[Run], list[str]]:
    """Return the runs to be made, and why others are not."""
    from scenarios.build import build
    from scenarios.config import load

    loaded = [load(s) if isinstance(s, (str, Path)) else s for s in scenarios]
    for name, count in Counter(scenario.name for scenario in loaded).items():
        if count > 1:
            raise HierarchyError(f"{count} scenarios are called {name!r}; give each its own name")
    runs, refused = [], []
    for scenario in loaded:
        build(scenario)
        usual = default_resolvers(scenario.asks)[0] if resolvers is None else resolvers
        for spec in dict.fromkeys(usual):
            changed = scenario.with_resolver(spec)
            resolver, asked = changed.make_resolver(), changed.asks
            if resolver.can_resolve(asked):
                runs.append(Run(changed, spec, str(resolver.label)))
            else:
                refused.append(f"{spec} is not run on {scenario.name}, which asks for {asked}: it "
                               f"resolves {resolver.handles}")
    if not runs:
        raise HierarchyError("; ".join(refused) or "no resolver is named")
    return [_distinct(run, runs) for run in runs], refused


def _distinct(run: Run, runs: Sequence[Run]) -> Run:
    """Return the run with a label that tells it from those beside it.

    That is its resolver's label, or its spec where another resolver has the same one, or its
    scenario's name where there is only one resolver.
    """
    if len(runs) > 1 and len({other.spec for other in runs}) == 1:
        return dataclasses.replace(run, label=run.scenario.name)
    same = {other.spec for other in runs if other.label == run.label}
    return dataclasses.replace(run, label=run.spec) if len(same) > 1 else run


def _carried_out(run: Run, folder: Path | None, progress: Progress | None) -> Run:
    from scenarios.simulate import simulate

    tell = partial(progress, f"{run.scenario.name} {run.spec}") if progress else None
    try:
        recording = simulate(run.scenario, progress=tell)
    except Exception as error:  # one way's failure is a result, and must not lose the others'
        return dataclasses.replace(run, error=f"{type(error).__name__}: {error}")
    if folder is not None:
        save(recording, folder / run.folder)
    return dataclasses.replace(run, recording=recording)


def _interrupted(run: Run) -> bool:
    return bool(run.fault) and str(run.fault).startswith("interrupted")


def _write(comparison: Comparison, folder: Path) -> None:
    from scenarios.report import page

    data = json.dumps(comparison.as_plain_data(), indent=2, allow_nan=False)
    write_text(folder / "comparison.json", data + "\n")
    write_text(folder / "index.html", page(comparison))


def _plain(run: Run) -> dict[str, Any]:
    return {"scenario": run.scenario.name, "resolver": run.spec, "label": run.label,
            "folder": run.folder, "fault": run.fault,
            "settings": {name: _plain_value(value) for name, value in run.settings.items()},
            "ticks": run.recording.ticks if run.recording else 0,
            "metrics": {name: metrics.plain(metric) for name, metric in run.metrics.items()}}


def _plain_parting(one: Parting) -> dict[str, Any]:
    return {"label": one.label, "from": one.other, "bound_rad": one.bound, "tick": one.tick,
            "largest_rad": one.largest if math.isfinite(one.largest) else None, "why": one.why}


def _plain_value(value: Any) -> Any:
    return value if isinstance(value, (bool, int, float, str, type(None))) else repr(value)


def _command(planned: Sequence[Run], out: str | Path | None) -> str:
    names = dict.fromkeys(run.scenario.name for run in planned)
    specs = ",".join(dict.fromkeys(run.spec for run in planned))
    where = ["--out", str(out)] if out is not None else []
    return shlex.join(["hierarchy", "compare", *names, "--resolvers", specs, *where])
