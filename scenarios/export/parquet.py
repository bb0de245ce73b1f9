"""A recording as a Parquet table with units in the fields' metadata."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenarios.export import new_file
from scenarios.export.numbers import plain
from scenarios.recording.columns import Column, columns, constants

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording


def write(recording: Recording, path: Path) -> list[Path]:
    """Write `path`: one column per number, of the type it was recorded in, with metadata `unit`.

    The table's metadata has `scenario` (TOML as run), `joints` (the name of each velocity),
    `orders`, `tasks` (those of the columns level_fate and level_violation), `limits` (JSON; null
    for a missing limit) and `fault`.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = list(columns(recording))
    limits = {name: plain(values) for name, values in constants(recording).items()}
    metadata = {"scenario": recording.scenario.to_toml(),
                "joints": json.dumps(recording.facts.robot.velocity_names),
                "orders": json.dumps(recording.orders),
                "tasks": json.dumps(recording.task_names), "limits": json.dumps(limits),
                "fault": recording.fault or ""}
    schema = pa.schema([_field(pa, column) for column in table], metadata)
    arrays = [pa.array(column.values.tolist() if column.values.dtype.kind == "U"
                       else column.values) for column in table]
    with new_file(path) as partial:
        pq.write_table(pa.Table.from_arrays(arrays, schema=schema), partial)
    return [path]


def _field(pa: Any, column: Column) -> Any:
    kind = pa.string() if column.values.dtype.kind == "U" else pa.from_numpy_dtype(
        column.values.dtype)
    return pa.field(column.name, kind, metadata={"unit": column.unit})
