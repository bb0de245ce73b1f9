"""The blocks of the documents that are made from rows: tables, statements, findings."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import dropwhile, takewhile
from textwrap import fill
from typing import Any

import numpy as np

from benchmark.reproduce import claims
from benchmark.reproduce.protocol import PROTOCOL
from benchmark.reproduce.studies import BLOCKS, Rows
from hierarchy.errors import HierarchyError
from scenarios.measure.statistics import Paired, wilson

_WIDTH = 100     # columns of a page
_NAMED = re.compile(r"\{(?P<study>[\w-]+) (?P<column>[\w.-]+)(?: (?P<metric>\w+))?"
                    r"(?: (?P<first>[\w.-]+))?\}")
_CELL = re.compile(r"\{(?P<output>[^{}/]+)/(?P<table>[^{}/]+)/(?P<row>[^{}/]+)/(?P<place>\d+)\}")

PROTOCOL_BLOCKS: dict[str, Callable[[], str]] = {
    "protocol-letter": lambda: "\n".join(claims.asked(PROTOCOL, "letter")),
    "protocol-own": lambda: "\n".join(claims.asked(PROTOCOL, "own")),
    "protocol-untested": lambda: "\n".join(claims.untested(PROTOCOL)),
}

Statement = Sequence[Any]  # a text, and what decides it


def block(name: str, rows: Mapping[str, Rows], output: Callable[[str], str]) -> str:
    """Return the Markdown of a block; raises KeyError for an unknown block, study or column.

    output : returns what a command has printed.
    """
    if name in PROTOCOL_BLOCKS:
        return PROTOCOL_BLOCKS[name]()
    given = BLOCKS[name]
    if "items" in given:
        outputs = given.get("outputs", {})
        texts = [_CELL.sub(lambda found: cell(output(outputs[found["output"]]), found.groupdict()),
                           item)
                 for item in given["items"]]
        return "\n".join(fill(f"- {_NAMED.sub(lambda named: _named(named, rows), text)}", _WIDTH,
                              subsequent_indent="  ") for text in texts)
    found = rows[given["study"]]
    lines = (_statements(found, given["claims"]) if "claims" in given else
             _by_metric(found, given["metrics"], given["beside"]) if "beside" in given else
             _table(found, given["metrics"], given.get("interval", False)))
    source = f"From `{found.command}` ({found.starts} starts, seed {found.seed})."
    return "\n".join([*lines, "", source])


def cell(output: str, asked: Mapping[str, str]) -> str:
    """Return a number that was printed: that at `place`, from 1, after the name of a row.

    The table begins with the line that starts as `table` does, and ends at an empty one. Of rows
    whose names begin alike, the shortest name counts, that of the row with the fewest words.
    """
    below = dropwhile(lambda line: not line.startswith(asked["table"]), output.splitlines())
    lines = [re.sub("[│|]", " ", line).strip() for line in takewhile(str.strip, below)]
    found = [line[len(asked["row"]):].split() for line in lines
             if line.startswith(f"{asked['row']} ")]
    if not found:
        raise HierarchyError(f"the output has no row {asked['row']!r} below {asked['table']!r}")
    return min(found, key=len)[int(asked["place"]) - 1]


def judged(rows: Rows, decides: Mapping[str, Any]) -> tuple[str, str]:
    """Return what rows say about a statement, in one of three sentences, and the verdict.

    of : a column. metric : of which; without one, whether every run reaches its end. below, above :
    a column whose metric is to be larger, or smaller, start by start; or least, most : bounds that
    are to be kept from every start.
    """
    column, metric = decides["of"], decides.get("metric")
    if metric is None:
        ended = rows.ended[column]
        return f"{share(ended, rows.starts)} reach the end", _always(ended, rows.starts)
    first = decides.get("below", decides.get("above"))
    if first is not None:
        pair = rows.paired(metric, first, column)
        return (f"{in_text(rows, column, metric)} against {in_text(rows, first, metric)}; {pair}",
                _agrees(pair, "below" in decides))
    values = rows.column(column, metric)
    kept = int(((values <= decides.get("most", np.inf))
                & (values >= decides.get("least", -np.inf))).sum())
    return (f"{in_text(rows, column, metric)}; kept from {share(kept, rows.starts)}",
            _always(kept, rows.starts))


def statements(study: str) -> list[Statement]:
    """Return every statement about a study."""
    return [one for given in BLOCKS.values() if given.get("study") == study
            for one in given.get("claims", ())]


def _always(met: int, of: int) -> str:
    return "true" if met == of else "false" if met == 0 else "not from every start"


def _agrees(pair: Paired, lower: bool) -> str:
    if not pair.count:
        return "not decided"
    if pair.equal or not pair.distinguishable:
        return "the same" if pair.equal else "not distinguishable"
    return "true" if (pair.lower > pair.higher) == lower else "reversed"


def in_text(rows: Rows, column: str, metric: str, unit: bool = True) -> str:
    """Return "median [lower quartile, upper quartile] unit" of a metric."""
    found = rows.spread(column, metric)
    if found is None:
        return "–"
    median, low, high = (rows.metric(metric, value).shown()
                         for value in (found.median, found.lower, found.upper))
    return f"{median} [{low}, {high}] {rows.metric(metric).shown_unit if unit else ''}".strip()


def share(met: int, of: int) -> str:
    """Return "18 of 24 (55 to 88 %)" with the 95 % Wilson interval."""
    low, high = wilson(met, of)
    return f"{met} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def _named(named: re.Match[str], rows: Mapping[str, Rows]) -> str:
    found, column, metric = rows[named["study"]], named["column"], named["metric"]
    if metric is None:
        return share(found.ended[column], found.starts)
    if named["first"]:
        return str(found.paired(metric, named["first"], column))
    return in_text(found, column, metric)


def _statements(rows: Rows, claims: Sequence[Statement]) -> list[str]:
    """Return a table of statements: what was found, and the verdict."""
    lines = ["| statement | found: median [quartiles] | verdict |", "|---|---|---|"]
    for text, decides in claims:
        found, verdict = judged(rows, decides)
        lines.append(f"| {text} | {found} | **{verdict}** |")
    return lines


def _table(rows: Rows, metrics: Sequence[str], interval: bool) -> list[str]:
    """Return a table of a study, its columns as rows: median and quartiles of metrics.

    With `interval` the share of runs that reached their end has its 95 % interval.
    """
    known = [name for name in metrics if name in rows.metrics]
    ended = share if interval else "{} of {}".format
    return [f"| | reached the end | {' | '.join(_head(rows, name) for name in known)} |",
            "|---" * (len(known) + 2) + "|",
            *(f"| `{column}` | {ended(rows.ended[column], rows.starts)} | "
              f"{' | '.join(in_text(rows, column, name, False) for name in known)} |"
              for column in rows.values)]


def _by_metric(rows: Rows, metrics: Sequence[str], columns: Sequence[str]) -> list[str]:
    """Return a table with a row per metric: median and quartiles in some columns of a study.

    Each column but the first is compared with the first, start by start.
    """
    lines = [f"| | {' | '.join(f'`{column}`' for column in columns)} |",
             "|---" * (len(columns) + 1) + "|"]
    for metric in metrics:
        cells = [in_text(rows, column, metric, False) for column in columns]
        for k, column in enumerate(columns[1:], 1):
            pair = rows.paired(metric, columns[0], column)
            cells[k] += f"; {pair}" if pair.count else ""
        lines.append(f"| {_head(rows, metric)} | {' | '.join(cells)} |")
    return lines


def _head(rows: Rows, name: str) -> str:
    metric = rows.metric(name)
    return f"{metric.label}{f' [{metric.shown_unit}]' if metric.shown_unit else ''}"
