"""The files and folders that the data of a scenario or a sweep name, wherever they stand."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hierarchy.errors import refuse
from hierarchy.robots.names import in_package, is_file_name
from scenarios.config.distributions import flat

LIBRARY = Path(__file__).parents[1] / "library"


def files_in(data: dict[str, Any]) -> Iterator[tuple[Any, Any]]:
    """Yield the table and the key, or the list and the index, of each name of a file or folder."""
    for section, key in (("robot", "model"), ("sensor", "folder")):
        table = data.get(section)
        if isinstance(table, dict) and _is_file(f"{section}.{key}", table.get(key)):
            yield table, key
    yield from _recorded(data)
    for parameters in map(data.get, ("variation", "parameters")):
        for at, one in flat(parameters).items() if isinstance(parameters, dict) else ():
            choices = one.get("choice") if isinstance(one, dict) else None
            for i, choice in enumerate(choices if isinstance(choices, list) else ()):
                if _is_file(at, choice):
                    yield choices, i


def make_absolute(data: dict[str, Any], here: Path) -> None:
    """Put the folder `here` in front of the files that the data name; refuse names not in UTF-8."""
    for table, key in files_in(data):
        table[key] = path = str((here / table[key]).absolute())
        refuse(path.encode(errors="ignore").decode() != path, f"{path!r} is not UTF-8: rename it")


def _recorded(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the files of recorded motions, wherever a scenario has them."""
    inside = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    for one in inside:
        yield from _recorded(one)
    if isinstance(data, dict) and data.get("kind") == "recorded" and (
            isinstance(data.get("file"), str)):
        yield data, "file"


def _is_file(key: str, value: Any) -> bool:
    """Whether the value at a dotted key names a file or a folder."""
    if not isinstance(value, str):
        return False
    if key == "robot.model":
        return not in_package(value) and is_file_name(value)
    if key == "sensor.folder":
        return not (LIBRARY / "frames" / value).is_dir()
    return key.endswith("path.file")
