"""The files and folders that the data of a scenario or a sweep name, wherever they stand."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hierarchy.errors import refuse
from hierarchy.robots.names import in_package, is_file_name

LIBRARY = Path(__file__).parents[1] / "library"
_CHOICE = re.compile(r"(?:variation|parameters)\.(.+)\.choice\.\d+")


def files_in(data: dict[str, Any]) -> Iterator[tuple[Any, Any]]:
    """Yield the table and the key, or the list and the index, of each name of a file or folder."""
    waiting: list[tuple[str, Any]] = [("", data)]
    for above, table in waiting:  # grows on the way
        for key, value in table.items() if isinstance(table, dict) else enumerate(table):
            if isinstance(value, dict | list):
                waiting.append((f"{above}{key}.", value))
            elif isinstance(value, str) and _is_file(table, f"{above}{key}", value):
                yield table, key


def make_absolute(data: dict[str, Any], here: Path) -> None:
    """Put the folder `here` in front of the files that the data name; refuse names not in UTF-8."""
    for table, key in files_in(data):
        table[key] = path = str((here / table[key]).absolute())
        refuse(path.encode(errors="ignore").decode() != path, f"{path!r} is not UTF-8: rename it")


def _is_file(table: Any, dotted: str, value: str) -> bool:
    """Whether the text at a dotted key, which is in this table or list, names a file or a folder.

    A recorded motion may have its kind from the file that its own one extends.
    """
    key = _CHOICE.sub(r"\1", dotted)
    if key == "robot.model":
        return not in_package(value) and is_file_name(value)
    if key == "sensor.folder":
        return not (LIBRARY / "frames" / value).is_dir()
    kind = table.get("kind") if isinstance(table, dict) else None
    return key.endswith("path.file" if kind is None else ".file") and kind in (None, "recorded")
