"""Files and folders: output is written whole or not at all, and a bad file is named."""

from __future__ import annotations

import atexit
import glob
import itertools
import json
import os
import re
import shutil
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hierarchy.errors import HierarchyError

_VARIANT = re.compile(r"(?m)^\[variants\.([\w-]+)\]")


class OutputError(HierarchyError):
    """A folder that exists and is not empty, or that cannot be written."""


def claim(folder: str | Path) -> Path:
    """Make sure that `folder` can be written later, and return its absolute path.

    It is not made yet, only the folders above it, and a hidden file beside it that keeps it for
    this process until its end. What killed processes left there is removed.

    Raises
    ------
    OutputError : it holds something, is no folder, its parent cannot be written, or another process
        is going to write it.
    """
    path = Path(folder).expanduser().resolve()
    with named(f"output folder {folder}"):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and any(path.iterdir()):
            raise OutputError(f"output folder {folder} exists and is not empty; "
                              "choose another, or remove it first")
        _keep(path)
    return path


def _keep(path: Path) -> None:
    """Lock a folder for this process; raises OutputError if another process has locked it."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*"):
        owner = _owner(left, path.name)
        if owner is not None and not _is_alive(owner):
            shutil.rmtree(left) if left.is_dir() else left.unlink(missing_ok=True)
        elif owner not in (None, os.getpid()):
            raise OutputError(f"output folder {path} is going to be written by process {owner}; "
                              "choose another, or wait for it to end")
    _mark(path).touch()
    atexit.register(_mark(path).unlink, missing_ok=True)


def _mark(path: Path) -> Path:
    """Return the hidden file that keeps a folder for this process."""
    return path.with_name(f".{path.name}.{os.getpid()}.kept")


def _owner(left: Path, name: str) -> int | None:
    """Return the process that made a hidden file or folder beside a folder called `name`."""
    found = re.fullmatch(re.escape(f".{name}.") + r"(\d+)\..*", left.name)
    return int(found[1]) if found else None


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # another user's
        return True
    return True


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
    with named(path):
        prefix = f".{path.name}.{os.getpid()}."
        partial = Path(tempfile.mkdtemp(prefix=prefix, dir=path.parent))
    try:
        with named(path):
            yield partial
            partial.chmod(0o777 & ~_umask())
            partial.rename(path)
    except OutputError as error:
        raise OutputError(str(error).replace(str(partial), str(path))) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        _mark(path).unlink(missing_ok=True)


@contextmanager
def written(file: Path, *, synced: bool = False) -> Iterator[Path]:
    """Give a temporary sibling of a file to write to; it takes the file's name only when whole.

    A reader finds the old file or the new one, never a part. With `synced` it is on the disk before
    it takes its name, so that it survives a loss of power.
    """
    partial = file.with_name(f".{os.getpid()}-{file.name}")
    try:
        yield partial
        if synced:
            with partial.open("rb") as stream:
                os.fsync(stream.fileno())
        partial.replace(file)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def added_to(folder: Path) -> Iterator[Path]:
    """Give a temporary folder to write into; its files move into `folder` once all are there.

    Files of the same names are replaced, others stay.
    """
    with tempfile.TemporaryDirectory(prefix=".adding.", dir=folder) as partial:
        yield Path(partial)
        for file in sorted(Path(partial).iterdir()):
            file.replace(folder / file.name)


@contextmanager
def named(path: str | Path) -> Iterator[None]:
    """Turn an OSError into an OutputError that says which path cannot be written."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {reason(error)}") from error


def reason(error: OSError) -> str:
    """Return why a file or folder cannot be written, naming a file where a folder should be."""
    if isinstance(error, FileExistsError | NotADirectoryError) and error.filename:
        asked = Path(error.filename)
        return f"{next((one for one in (asked, *asked.parents) if one.is_file()), asked)} is a file"
    return error.strerror or str(error)


def make_folder(folder: Path) -> Path:
    """Make a folder unless it is there, and return it; raises OutputError."""
    with named(f"output folder {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with written(path) as partial:
        partial.write_bytes(content)


def write_json(path: Path, data: Any) -> None:
    """Write plain data as a JSON file; raises ValueError for a number that is not finite."""
    write_text(path, json.dumps(data, indent=2, allow_nan=False) + "\n")


def read_toml(path: Path, what: str, error: type[HierarchyError]) -> dict[str, Any]:
    """Return the content of a TOML file; raises `error`, naming the file, if it cannot be read.

    `what` is the kind of file in the message, such as "scenario file".
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as cause:
        raise error(f"{what} {str(path)!r} does not exist") from cause
    except OSError as cause:
        raise error(f"{what} {str(path)!r}: {cause.strerror}") from cause
    except UnicodeDecodeError as cause:
        raise error(f"{what} {str(path)!r} is not UTF-8 text") from cause
    except tomllib.TOMLDecodeError as cause:  # its text gives line and column
        raise error(f"{what} {str(path)!r}: {cause}") from cause
    except RecursionError as cause:
        raise error(f"{what} {str(path)!r} is nested too deep") from cause
    except ValueError as cause:
        raise error(f"{what} {str(path)!r} has an integer of thousands of digits") from cause


def scenarios_in(folder: Path) -> dict[str, tuple[Path, str]]:
    """Return file and variant ("" for the file itself) of each scenario in a library, by name.

    The files are not parsed: a scenario has its own name, a variant its own table.
    """
    found: dict[str, tuple[Path, str]] = {}
    for path in sorted(folder.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        found |= {path.stem: (path, "")} if f'\nname = "{path.stem}"' in f"\n{text}" else {}
        found |= {f"{path.stem}-{key}": (path, key) for key in _VARIANT.findall(text)}
    return dict(sorted(found.items()))


def slug(text: str) -> str:
    """Return a text as a name for a file or folder; different texts may have the same one."""
    return re.sub(r"[^A-Za-z0-9._]+", "-", text).strip("-.") or "unnamed"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
