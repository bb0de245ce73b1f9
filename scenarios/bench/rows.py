"""Rows of a benchmark as CSV and on the screen."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from scenarios.files import make_folder, named, written


def write_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows as CSV; rows may have different columns."""
    make_folder(path.parent)
    with (named(path), written(path) as partial,
          partial.open("w", newline="", encoding="utf-8") as file):
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows(rows)


def table_of_numbers(heads: Iterable[str], title: str | None = None, first: str = "") -> Table:
    """Return an empty table: a column `first` for names, and one of numbers for each head."""
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column(first, no_wrap=True)
    for head in heads:
        table.add_column(head, justify="right", no_wrap=True)
    return table
