"""Export of recordings as CSV, Parquet, or MCAP with a layout for Foxglove."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from hierarchy.errors import HierarchyError, UnknownNameError
from scenarios.files import OutputError, named, written

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

# Each is a module of this package with write(recording, path): its package, and the extra of it.
FORMATS: dict[str, tuple[str, str]] = {"csv": ("csv", ""), "parquet": ("pyarrow", "export"),
                                       "mcap": ("mcap", "export")}


def export(recording: Recording, path: str | Path, format: str | None = None) -> list[Path]:
    """Write a recording to a file of `format`, by default its suffix; return the files written.

    With "mcap" a layout for Foxglove is written next to it, as `path`.layout.json. The same
    recording gives the same bytes.

    Raises
    ------
    UnknownNameError : the format does not exist; names the closest one.
    OutputError : the file exists or cannot be written.
    HierarchyError : a package is not installed; names the extra that installs it.
    """
    path = Path(path)
    name = path.suffix.removeprefix(".") if format is None else format
    if name not in FORMATS:
        raise UnknownNameError("format", name, FORMATS)
    package, extra = FORMATS[name]
    try:
        import_module(package)
    except ImportError:
        raise HierarchyError(f"{name} needs the package {package}; "
                             f"pip install 'task-hierarchy[{extra}]'") from None
    written: list[Path] = import_module(f"scenarios.export.{name}").write(recording, path)
    return written


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
