"""Raw rows as Parquet files: one for each entrant and file of problems, written whole or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from hierarchy.errors import HierarchyError
from scenarios.files import named, slug, written

_TEXT = ("entrant", "version", "family", "half", "sha256", "refused", "raised", "ended", "why")
_WHOLE = ("seed", "problem", "iterations", "warm_iterations", "rss_kib", "start_kib",
          "yardstick_ns")
_TRUE = ("solved", "warm_solved", "same")
_LISTS = {"x": "f", "warm_x": "f", "without": "f", "cold_ns": "i", "warm_ns": "i",
          "cold_inside_ns": "i", "warm_inside_ns": "i"}
COLUMNS = (*_TEXT, *_WHOLE, *_TRUE, *_LISTS)
"""The columns of a row; docs/open-benchmark.md describes them."""

RawRow = dict[str, Any]


class StoreError(HierarchyError):
    """A file of rows that cannot be read, or the missing package that reads it."""


@final
@dataclass(frozen=True)
class Store:
    """The folder of a benchmark: `problems/` and `rows/`."""

    folder: Path

    @property
    def problems(self) -> Path:
        """The folder of the files of problems."""
        return self.folder / "problems"

    @property
    def files(self) -> list[Path]:
        """The files of rows."""
        return sorted((self.folder / "rows").glob("[!.]*.parquet"))

    def file_of(self, entrant: str, problems: Path) -> Path:
        """Return where the rows of an entrant on a file of problems belong."""
        return self.folder / "rows" / f"{slug(entrant)}--{problems.stem}.parquet"

    def add(self, rows: Sequence[RawRow], file: Path) -> None:
        """Write the rows of one entrant on one file of problems; raises OutputError."""
        arrow, parquet = _pyarrow()
        columns = [arrow.array([row.get(name) for row in rows], kind)
                   for name, kind in _types(arrow).items()]
        with named(file):
            file.parent.mkdir(parents=True, exist_ok=True)
        with named(file), written(file) as partial:
            parquet.write_table(arrow.table(columns, names=list(COLUMNS)), partial)

    def rows(self) -> list[RawRow]:
        """Return all rows; raises StoreError for a file that is damaged."""
        return [row for file in self.files for row in read_rows(file)]


def read_rows(file: Path) -> list[RawRow]:
    """Return the rows of a file; raises StoreError."""
    arrow, parquet = _pyarrow()
    try:
        rows: list[RawRow] = parquet.read_table(file, partitioning=None).to_pylist()
    except (OSError, arrow.ArrowException) as error:
        raise StoreError(f"{file} cannot be read ({error}); remove it to run its entrant again"
                         ) from error
    if rows and rows[0].keys() != set(COLUMNS):
        raise StoreError(f"{file} has the columns of another version; remove it to run its entrant "
                         "again")
    return rows


def _types(arrow: Any) -> dict[str, Any]:
    lists = {"f": arrow.list_(arrow.float64()), "i": arrow.list_(arrow.int64())}
    return {**dict.fromkeys(_TEXT, arrow.string()), **dict.fromkeys(_WHOLE, arrow.int64()),
            **dict.fromkeys(_TRUE, arrow.bool_()),
            **{name: lists[kind] for name, kind in _LISTS.items()}}


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise StoreError("rows are kept as Parquet, which needs pyarrow: pip install "
                         "'task-hierarchy[bench]'") from error
    return pyarrow, pyarrow.parquet
