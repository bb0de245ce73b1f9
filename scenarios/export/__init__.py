"""Export of recordings as MCAP, with a layout for Foxglove."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from hierarchy.errors import HierarchyError
from scenarios.files import OutputError, named, written
from scenarios.recording.recording import Recording


def export(recording: Recording, path: str | Path) -> list[Path]:
    """Write a recording to an MCAP file and a layout for Foxglove; return the files written.

    The layout is `path`.layout.json. The same recording gives the same bytes. For tables there is
    `Recording.to_dataframe`.

    Raises
    ------
    OutputError : a file exists or cannot be written.
    HierarchyError : the suffix is another one, or the package mcap is not installed.
    """
    path = Path(path)
    if path.suffix != ".mcap":
        raise HierarchyError(f"{path} is no .mcap file; for CSV, Parquet and other tables: "
                             "scenarios.load_run(folder).to_dataframe()")
    if find_spec("mcap") is None:
        raise HierarchyError("mcap is not installed; pip install 'task-hierarchy[export]'")
    from scenarios.export.mcap import write

    return write(recording, path)


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield a temporary name to write to; the file is renamed once it is complete."""
    with named(path):
        if path.exists():
            raise OutputError(f"{path} exists; choose another name, or remove it first")
        path.parent.mkdir(parents=True, exist_ok=True)
    with named(path), written(path) as partial:
        partial.touch()
        yield partial
