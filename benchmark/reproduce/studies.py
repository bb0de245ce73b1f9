"""The studies of `studies.toml`: which scenarios, under which resolver, from how many starts."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scenarios.config import Scenario, load
from scenarios.config.groups import load_group
from scenarios.config.scenario import OWN

_TOML = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
BLOCKS: Mapping[str, Mapping[str, Any]] = _TOML["block"]
SEED: int = _TOML["seed"]


@dataclass(frozen=True)
class Column:
    """One column of a study: a scenario with changes at dotted keys, under a resolver."""

    name: str
    scenario: str
    resolver: str = OWN
    set: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Scenario:
        """Return the scenario, named after the column."""
        scenario = load(self.scenario, {**self.set, "name": self.name})
        return scenario.with_resolver(self.resolver)


@dataclass(frozen=True)
class Study:
    """Columns that are run from the same sampled starts; or what is measured in every tick.

    scenario, resolver : whose ticks are measured. pairs : two resolvers, as specs, whose answers
    are compared, by column. pivots : levels of one row, whose share outside the rows above is
    measured.
    """

    name: str
    title: str
    columns: tuple[Column, ...] = ()
    scenario: str = ""
    resolver: str = ""
    pairs: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    pivots: tuple[str, ...] = ()
    starts: int = _TOML["starts"]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns."""
        return (*(column.name for column in self.columns), *self.pairs, *self.pivots)


def _study(name: str, text: Mapping[str, Any]) -> Study:
    given = dict(text)
    columns = given.pop("columns", {}) or {
        one: {"scenario": one} for one in
        (load_group(given.pop("group")).scenarios if "group" in given else ())}
    return Study(name, columns=tuple(Column(key, **value) for key, value in columns.items()),
                 **given)


STUDIES = {name: _study(name, text) for name, text in _TOML["study"].items()}
"""The studies by name."""
