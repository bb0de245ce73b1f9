"""Outcomes of a sweep's runs as Parquet files, each written whole or not at all."""

from __future__ import annotations

import fcntl
import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as parquet

from hierarchy.errors import HierarchyError
from scenarios import files
from scenarios.files import written
from scenarios.measure.metrics import Metric
from scenarios.sweep.run import Outcome

_FIXED = (("key", pa.string()), ("ticks", pa.int64()), ("fault", pa.string()),
          ("error", pa.string()), ("wall_seconds", pa.float64()), ("versions", pa.string()))


class StoreError(HierarchyError):
    """A folder that is in use or not a sweep's, or a part that cannot be read."""


class FullError(OSError):
    """A file that cannot be written, such as on a full disk; files written before are kept."""


@dataclass(frozen=True)
class Store:
    """The folder of a sweep: `parts/` with one file per batch of runs, and the results.

    Columns of a part are named after metrics, in SI units; their metadata have label and unit.
    """

    folder: Path

    @property
    def parts(self) -> list[Path]:
        """The files of the parts."""
        return sorted((self.folder / "parts").glob("[!.]*.parquet"))

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Lock the folder for this process; make it if it is new.

        Raises
        ------
        StoreError : it has other content, or another process writes into it.
        OutputError : it cannot be made.
        """
        if self.folder.is_dir() and not self._is_free():
            raise StoreError(f"output folder {self.folder} is not empty and is not a sweep's; "
                             "choose another, or remove it first")
        files.make_folder(self.folder / "parts")
        with files.named(self.folder):
            lock = (self.folder / ".lock").open("w")
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the system releases it
            except OSError:
                raise StoreError(f"another sweep is writing into {self.folder}") from None
            for left in (self.folder / "parts").glob(".*"):
                left.unlink()
            yield

    def _is_free(self) -> bool:
        return (self.folder / "parts").is_dir() or not any(self.folder.iterdir())

    def keys(self) -> set[str]:
        """Return the keys of all stored runs; raises StoreError for a damaged part."""
        return {key for part in self.parts for key in _read(part, ["key"])["key"].to_pylist()}

    def add(self, outcomes: Sequence[Outcome]) -> Path:
        """Write one part, whole or not at all, and return its path; raises FullError."""
        name = hashlib.sha256("".join(one.key for one in outcomes).encode()).hexdigest()[:16]
        path = self.folder / "parts" / f"{name}.parquet"
        write_table(_as_table(outcomes), path)
        return path

    def table(self) -> pa.Table:
        """Return all parts as one table; raises StoreError for a damaged part."""
        parts = [_read(part) for part in self.parts]
        return pa.concat_tables(parts, promote_options="default") if parts else _as_table([])


def write_table(table: pa.Table, path: Path) -> None:
    """Write a Parquet file, whole or not at all; raises FullError."""
    with _named(path), written(path, synced=True) as partial:
        parquet.write_table(table, partial)


def write_text(text: str, path: Path) -> None:
    """Write a text file, whole or not at all; raises FullError."""
    with _named(path):
        files.write_text(path, text)


def metrics_of(table: pa.Table) -> dict[str, Metric]:
    """Return the metrics that a table has columns for, by name and without values."""
    found = {}
    for field in table.schema:
        if field.metadata and b"label" in field.metadata:
            said = {key.decode(): value.decode() for key, value in field.metadata.items()}
            lower = {"yes": True, "no": False}.get(said["lower_is_better"])
            found[field.name] = Metric(field.name, said["label"], None, said["unit"], lower,
                                       said["group"], detail=said["detail"] == "yes")
    return found


def _as_table(outcomes: Sequence[Outcome]) -> pa.Table:
    found = {metric.name: metric for one in outcomes for metric in one.metrics}
    fields = [*(pa.field(*fixed) for fixed in _FIXED), *(map(_field, found.values()))]
    values = [{metric.name: metric.value for metric in one.metrics} for one in outcomes]
    columns = [[getattr(one, name) for one in outcomes] for name, _ in _FIXED]
    columns += [[row.get(name) for row in values] for name in found]
    return pa.table([pa.array(column, field.type) for column, field in
                     zip(columns, fields, strict=True)], schema=pa.schema(fields))


def _field(metric: Metric) -> pa.Field:
    lower = {True: "yes", False: "no", None: "neither"}[metric.lower_is_better]
    return pa.field(metric.name, pa.float64(), metadata={
        "label": metric.label, "unit": metric.unit, "group": metric.group,
        "lower_is_better": lower, "detail": "yes" if metric.detail else "no"})


def _read(part: Path, columns: Sequence[str] | None = None) -> Any:
    try:
        return parquet.read_table(part, columns=columns, partitioning=None)
    except (OSError, pa.ArrowException) as error:
        raise StoreError(f"{part} cannot be read ({error}); remove it to repeat "
                         "its runs") from error


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Turn an OSError into a FullError that names the file."""
    try:
        yield
    except OSError as error:
        raise FullError(f"{path} cannot be written: {files.reason(error)}; finished runs are "
                        "kept, and the same command continues from there") from error
