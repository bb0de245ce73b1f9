"""Print a sweep's results as tables of at most 80 columns."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from scenarios.measure.metrics import Metric
from scenarios.sweep.results import Results, compared, summary
from scenarios.sweep.verdict import verdict

_WIDTH = 80    # columns of a terminal
_LABELS = 26   # columns of it for the names of metrics


def show(name: str, results: Results, console: Console | None = None) -> None:
    """Print the verdict, success rates, and the spread of each metric by resolver."""
    console = console or Console(markup=False, highlight=False)
    console.print(f"\n{name}: {results.samples} samples, paired", *verdict(results), sep="\n")
    beside = _beside(results)
    for first in range(0, len(results.labels), beside):
        console.print()
        console.print(_table(results, results.labels[first:first + beside]))


def _beside(results: Results) -> int:
    """Return how many columns stand beside each other, in tables that are about equally wide."""
    widest = max((len(line) for metric in results.shown() for label in results.labels
                  for line in _cell(results, metric, label, False).plain.splitlines()), default=1)
    fit = max(1, (_WIDTH - _LABELS) // (widest + 1))
    return -(-len(results.labels) // -(-len(results.labels) // fit))


def _table(results: Results, labels: Sequence[str]) -> Table:
    laid_out = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    laid_out.add_column("median [quartiles]", overflow="fold")
    for label in labels:
        laid_out.add_column(Text(re.sub(r"(?<=[^ :-])[ :-]", lambda m: m[0].strip() + "\n", label)),
                            justify="right", no_wrap=True)
    for criterion in results.criteria():
        laid_out.add_row(Text(criterion.label),
                         *(str(results.share(criterion, label)) for label in labels))
    for metric in results.shown():
        unit = f" [{metric.shown_unit}]" if metric.shown_unit else ""
        best = results.best(metric)
        laid_out.add_row(Text(metric.label + unit), *(
            _cell(results, metric, label, label in best) for label in labels))
    return laid_out


def _cell(results: Results, metric: Metric, label: str, best: bool) -> Text:
    """Return the spread of a metric, a star if it is best, and how it compares with the first."""
    text = Text(f"{summary(results, metric, label)}{'*' if best else ' '}", "bold" if best else "")
    said = compared(results, metric, label)
    return text.append(f"\n{said} ", "not bold dim") if said else text
