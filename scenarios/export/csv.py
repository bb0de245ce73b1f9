"""A recording as comma-separated values: a header of names with units, then a line per tick."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from scenarios.export import new_file
from scenarios.recording.columns import columns

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording


def write(recording: Recording, path: Path) -> list[Path]:
    """Write `path`; every number has enough digits to be read back exactly.

    Numbers that are not finite are nan, inf and -inf; booleans are true and false.
    """
    table = list(columns(recording))
    with new_file(path) as partial, partial.open("w", encoding="utf-8", newline="") as stream:
        lines = csv.writer(stream, lineterminator="\n")
        lines.writerow([column.title for column in table])
        lines.writerows(zip(*(_texts(column.values) for column in table), strict=True))
    return [path]


def _texts(values: NDArray[Any]) -> list[str]:
    if values.dtype.kind == "f":
        return [repr(value) for value in values.tolist()]
    if values.dtype.kind == "b":
        return ["true" if value else "false" for value in values]
    return [str(value) for value in values]
