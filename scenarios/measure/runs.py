"""Runs of scenarios side by side: what was measured, in rows with the best values marked."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

from hierarchy.words import gathered
from scenarios.config import Scenario
from scenarios.config.scenario import OWN
from scenarios.files import slug
from scenarios.measure import metrics
from scenarios.measure.happenings import Happening, happened
from scenarios.measure.metric import NOTHING
from scenarios.measure.metrics import Metric
from scenarios.recording.facts import ResolverFacts, resolver_facts
from scenarios.recording.recording import Recording, was_interrupted

_TIE = 0.01  # relative: values that near are as good, as those within NOTHING
# How a resolver that is not strict departs from strict priorities, by its name.
_DEPARTS = {
    "": "not strict",
    "tpm": "inexact where a level loses rank",
    "reverse": "inexact where targets conflict",
    "augmented": "without priorities",
    "weighted": "trades levels off by weights",
    "merged": "trades levels off by weights in motion",
    "smooth": "not strict while a row is partly active"}


@dataclass(frozen=True)
class Run:
    """One scenario under one resolver, with what came of it.

    `recording` is None when the run could not begin or broke; `error` then says why. `timing` has
    its first ticks, made while no other run was, if computing times are to be taken from those.
    """

    scenario: Scenario
    spec: str
    label: str
    recording: Recording | None = None
    error: str | None = None
    timing: Recording | None = None

    @property
    def fault(self) -> str | None:
        """Why the run did not reach its end, or None when it did."""
        return self.error or (self.recording.fault if self.recording else None)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C or a signal ended it."""
        return was_interrupted(self.fault)

    @property
    def title(self) -> str:
        """The scenario's title, with its resolver where each scenario has its own."""
        title = self.scenario.title or self.scenario.name
        by = f" ({self.scenario.make_resolver().label})" if self.spec == OWN else ""
        return f"{title}{by}"

    @property
    def folder(self) -> str:
        """Where the run lies below the comparison's own folder."""
        return f"{slug(self.scenario.name)}/{slug(self.spec)}"

    @property
    def settings(self) -> dict[str, Any]:
        """The resolver's settings as they were used, also where the run broke."""
        facts = self.recording.facts.resolver if self.recording else resolver_facts(self.scenario)
        return dict(facts.settings)

    @cached_property
    def metrics(self) -> dict[str, Metric]:
        """What was measured on it, by name; empty without a recording."""
        found = metrics.measure(self.recording) if self.recording else {}
        timed = metrics.measure(self.timing) if self.timing else {}
        return found | {name: one for name, one in timed.items()
                        if name in found and name.startswith(("time_", "late_share"))}

    def as_plain_data(self) -> dict[str, Any]:
        """Return the run for a JSON file."""
        return {"scenario": self.scenario.name, "resolver": self.spec, "label": self.label,
                "folder": self.folder, "fault": self.fault, "settings": self.settings,
                "ticks": self.recording.ticks if self.recording else 0,
                "metrics": {name: metrics.plain(one) for name, one in self.metrics.items()}}

    @cached_property
    def happened(self) -> tuple[Happening, ...]:
        """What happened in it, with the causes of jumps, which take a while to find."""
        return tuple(happened(self.recording)) if self.recording else ()


class Cell(NamedTuple):
    """A cell of a table: `kind` is "best", "out" of the comparison or "", `more` a second line."""

    text: str
    kind: str = ""
    note: str = ""
    more: str = ""


class Row(NamedTuple):
    """One line of a table of results: a metric, and a cell for each column."""

    label: str
    unit: str
    group: str
    name: str
    cells: tuple[Cell, ...]

    @property
    def heading(self) -> str:
        """Label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


def table(runs: Sequence[Run]) -> list[Row]:
    """Return the rows that compare runs of one scenario, best values marked, without details.

    Only runs of one scenario that reached their end compete: other scenarios ask for other things,
    and a shorter run's numbers cover less time. Values within one percent of the best are as good,
    and where all are, none is marked. Metrics that no run has are left out.
    """
    one_scenario = len({run.scenario.name for run in runs}) == 1
    competes = [one_scenario and run.fault is None for run in runs]
    rows = []
    for name, metric in by_name(run.metrics for run in runs).items():
        found = [replace(run.metrics[name], unit=metric.unit) if name in run.metrics else None
                 for run in runs]
        if metric.detail or all(m is None or m.value is None for m in found):
            continue
        best = _best({i: m.value for i, m in enumerate(found)
                      if m and m.value is not None and competes[i]}, metric.lower_is_better)
        rows.append(Row(metric.label, metric.shown_unit, metric.group, name, tuple(
            Cell(m.shown() if m else "–", "best" if i in best else "out" if runs[i].fault else "",
                 m.note if m else "") for i, m in enumerate(found))))
    return grouped(rows)


def by_name(each: Iterable[Mapping[str, Metric]]) -> dict[str, Metric]:
    """Return the metrics of runs by name, in "rad or m" where joints turn in some and slide."""
    found: dict[str, Metric] = {}
    for name, one in (item for of in each for item in of.items()):
        units = [unit for of in (found.get(name, one), one) for unit in of.unit.split(" or ")]
        found[name] = replace(one, unit=" or ".join(dict.fromkeys(units)))
    return found


def grouped(rows: Sequence[Row]) -> list[Row]:
    """Return rows with those of a group together, groups in the order of their first."""
    groups = list(dict.fromkeys(row.group for row in rows))
    return sorted(rows, key=lambda row: groups.index(row.group))


def flags(runs: Sequence[Run]) -> list[str]:
    """Return the `caveats` about the resolvers of runs, each once, with the columns it is about."""
    found = caveats({run.label: run.recording.facts.resolver for run in runs if run.recording})
    columns = gathered((caveat, label) for label, said in found.items() for caveat in said)
    return [f"{', '.join(labels)}: {caveat}" for caveat, labels in columns.items()]


def caveats(resolvers: Mapping[str, ResolverFacts]) -> dict[str, list[str]]:
    """Return by column what to know of its resolver before it is called the best."""
    # Damping by pivot or by level gives the same x while no level loses rank.
    damped = {label: one.damped.replace("each pivot", "each level")
              for label, one in resolvers.items()}
    first = next(iter(resolvers), "")
    return {label: [_DEPARTS.get(one.name, _DEPARTS[""])] * (not one.strict)
            + [f"damped differently from {first}"] * (damped[label] != damped[first])
            for label, one in resolvers.items()}


def _best(values: Mapping[int, float], lower: bool | None) -> frozenset[int]:
    """Return which of the values are as good as the best; empty if all are."""
    if lower is None or not values:
        return frozenset()
    winner = min(values.values()) if lower else max(values.values())
    best = frozenset(i for i, value in values.items()
                     if abs(value - winner) <= max(_TIE * max(abs(value), abs(winner)), NOTHING))
    return best if len(best) < len(values) else frozenset()
