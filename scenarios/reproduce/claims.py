"""Statements about the runs of a study, each judged by its rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from scenarios.measure.statistics import Paired, wilson
from scenarios.reproduce.rows import Rows

Direction = Literal["lower", "higher"]


@dataclass(frozen=True)
class Judgement:
    """What was found about a statement, and whether it stands."""

    found: str
    verdict: str


class Claim(Protocol):
    """A statement about one study."""

    @property
    def text(self) -> str:
        """The statement."""

    @property
    def study(self) -> str:
        """The name of the study that decides it."""

    def judge(self, rows: Rows) -> Judgement:
        """Return what the rows say about it."""


@dataclass(frozen=True)
class Compares:
    """A metric is lower (or higher) in the column `second` than in `first`, start by start."""

    text: str
    study: str
    metric: str
    first: str
    second: str
    expected: Direction

    def judge(self, rows: Rows) -> Judgement:
        """Return the medians of both columns and the result of the paired test."""
        pair = rows.paired(self.metric, self.first, self.second)
        found = (f"{in_text(rows, self.second, self.metric)} against "
                 f"{in_text(rows, self.first, self.metric)}; {pair}")
        return Judgement(found, _agrees(pair, self.expected))


@dataclass(frozen=True)
class Keeps:
    """A metric stays within a bound from every start; one of `most` and `least` is given."""

    text: str
    study: str
    metric: str
    column: str
    most: float = np.inf
    least: float = -np.inf

    def judge(self, rows: Rows) -> Judgement:
        """Return the spread, and from how many starts the bound is kept."""
        values = rows.column(self.column, self.metric)
        kept = int(((values <= self.most) & (values >= self.least)).sum())
        found = f"{in_text(rows, self.column, self.metric)}; kept from {share(kept, rows.starts)}"
        return Judgement(found, _always(kept, rows.starts))


@dataclass(frozen=True)
class Ends:
    """Runs of a column reach their end from every start."""

    text: str
    study: str
    column: str

    def judge(self, rows: Rows) -> Judgement:
        """Return from how many starts the run reached its end."""
        ended = rows.ended[self.column]
        return Judgement(f"{share(ended, rows.starts)} reach the end", _always(ended, rows.starts))


def _always(met: int, of: int) -> str:
    return "true" if met == of else "false" if met == 0 else "not from every start"


def _agrees(pair: Paired, expected: Direction) -> str:
    if not pair.count:
        return "not decided"
    if pair.equal:
        return "the same"
    if not pair.distinguishable:
        return "not distinguishable"
    return "true" if (pair.lower > pair.higher) == (expected == "lower") else "reversed"


def in_text(rows: Rows, column: str, metric: str) -> str:
    """Return "median [lower quartile, upper quartile] unit" of a metric."""
    found = rows.spread(column, metric)
    if found is None:
        return "–"
    median, low, high = (rows.metric(metric, value).shown()
                         for value in (found.median, found.lower, found.upper))
    unit = rows.metric(metric).shown_unit
    return f"{median} [{low}, {high}] {unit}".strip()


def share(met: int, of: int) -> str:
    """Return "18 of 24 (55 to 88 %)" with the 95 % Wilson interval."""
    low, high = wilson(met, of)
    return f"{met} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"
