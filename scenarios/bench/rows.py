"""Rows of a benchmark as CSV."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scenarios.files import make_folder, named, written


def write_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows as CSV; rows may have different columns."""
    make_folder(path.parent)
    with (named(path), written(path) as partial,
          partial.open("w", newline="", encoding="utf-8") as file):
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows(rows)
