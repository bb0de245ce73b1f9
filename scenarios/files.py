"""Output folders: refused before a run begins if they cannot take it, and written whole or not."""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hierarchy.errors import HierarchyError


class OutputError(HierarchyError):
    """A folder that exists and is not empty, or that cannot be written."""


def claim(folder: str | Path) -> Path:
    """Make sure that `folder` can be written later, and return its absolute path.

    It is not made yet, only the folders above it.

    Raises
    ------
    OutputError : it holds something, is no folder, or its parent cannot be written.
    """
    path = Path(folder).expanduser().resolve()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and any(path.iterdir()):
            raise OutputError(f"output folder {folder} exists and is not empty; "
                              "choose another, or remove it first")
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OutputError(f"output folder {folder} cannot be written: {error.strerror}") from error
    return path


def next_free(base: str | Path) -> Path:
    """Return the first of base, base-2, base-3, ... that does not exist yet."""
    base = Path(base)
    numbered = (base.with_name(f"{base.name}-{i}") for i in itertools.count(2))
    return next(path for path in itertools.chain([base], numbered) if not path.exists())


@contextmanager
def whole(folder: str | Path) -> Iterator[Path]:
    """Give a temporary sibling of `folder` to write into; it takes its name only when all is there.

    Whatever interrupts the writing leaves nothing behind. `folder` must be new or empty.
    """
    path = Path(folder).expanduser().resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield partial
        partial.chmod(0o777 & ~_umask())
        _rename(partial, path)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise


def slug(text: str) -> str:
    """Return a text as a name for a file or folder; different texts may have the same one."""
    return re.sub(r"[^A-Za-z0-9._]+", "-", text).strip("-.") or "unnamed"


def write_text(path: Path, text: str) -> None:
    """Write a file so that a reader finds the old one or the new one, never a part."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file so that a reader finds the old one or the new one, never a part."""
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        partial.write_bytes(content)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_json(path: Path, data: Any) -> None:
    """Write plain data as a JSON file; a number that is not finite raises ValueError."""
    write_text(path, json.dumps(data, indent=2, allow_nan=False) + "\n")


def _rename(partial: Path, path: Path) -> None:
    try:
        partial.rename(path)
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror}") from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
