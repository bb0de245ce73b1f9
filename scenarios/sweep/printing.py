"""Print a sweep's results as tables of at most 80 columns."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from scenarios.sweep.results import Results, summary
from scenarios.sweep.success import success

_BESIDE = 3  # resolvers that fit into 80 columns


def show(name: str, results: Results, console: Console | None = None) -> None:
    """Print success rates and the median and worst value of each metric, by resolver."""
    console = console or Console(markup=False, highlight=False)
    console.print(f"\n{name}: {success(results)}")
    beside = -(-len(results.labels) // -(-len(results.labels) // _BESIDE))
    for first in range(0, len(results.labels), beside):
        console.print()
        console.print(_table(results, results.labels[first:first + beside]))


def _table(results: Results, labels: Sequence[str]) -> Table:
    laid_out = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    laid_out.add_column("median (worst)", overflow="fold")
    for label in labels:
        laid_out.add_column(Text(re.sub(r"(?<=[^ :-])[ :-]", lambda m: m[0].strip() + "\n", label)),
                            justify="right", no_wrap=True)
    for criterion in results.criteria():
        laid_out.add_row(Text(criterion.label),
                         *(str(results.share(criterion, label)) for label in labels))
    for metric in results.shown():
        unit = f" [{metric.shown_unit}]" if metric.shown_unit else ""
        laid_out.add_row(Text(metric.label + unit),
                         *(summary(results, metric, label) for label in labels))
    return laid_out
