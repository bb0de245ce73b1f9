"""Files and folders: output is written whole or not at all."""

import atexit
import glob
import hashlib
import json
import os
import platform
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import Any, TextIO

from hierarchy.errors import HierarchyError

_NAME = 200  # bytes of a name: file systems take 255, and hidden files beside it add theirs
_VARIANT = re.compile(r"(?m)^\[variants\.([\w-]+)\]")


class OutputError(HierarchyError):
    """A folder that exists and is not empty, or that cannot be written."""


class TakenError(OutputError):
    """A folder that another process is going to write."""


_HELD: dict[Path, TextIO] = {}  # lock files of this process, by what they lock


def claim(folder: str | Path) -> Path:
    """Lock `folder`, which must be new or empty, for this process, and return its absolute path.

    It is not made yet, only the folders above it. What a process that was killed left beside it is
    removed.

    Raises
    ------
    OutputError : it holds something, is no folder, its parent cannot be written, or another process
        is going to write it.
    """
    path = _absolute(folder)
    with named(f"output folder {folder}"):
        if not path.parent.exists():
            atexit.register(remove_empty, path.parent)  # if nothing is written in the end
        path.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            if os.listdir(path):  # noqa: PTH208 - raises for a loop of links, a name too long
                raise OutputError(f"output folder {folder} exists and is not empty; "
                                  "choose another, or remove it first")
        lock(path)
        for left in path.parent.glob(f"{glob.escape(_hidden(path))}.????????.partial"):
            shutil.rmtree(left)
        _partial(path).rmdir()  # what `whole` will need
    return path


def remove_empty(folder: Path) -> None:
    """Remove a folder if there is nothing in it."""
    with suppress(OSError):
        folder.rmdir()


def _partial(path: Path) -> Path:
    """Make and return a hidden folder beside a path."""
    made = path.with_name(f"{_hidden(path)}.{secrets.token_hex(4)}.partial")
    made.mkdir()
    return made


def lock(path: Path) -> None:
    """Lock a path for this process until its end or `unlock`; raises TakenError if it is locked.

    The system holds the lock and releases it however the process ends, in containers that share the
    folder too. The hidden file beside the path only says whose it is.
    """
    while path not in _HELD:
        file = _lock_file(path)
        stream = file.open("a+", encoding="utf-8")
        if not _locked(stream):
            with stream:
                stream.seek(0)
                owner = stream.read().strip() or "another process"
            raise TakenError(f"output folder {path} is going to be written by {owner}; choose "
                             "another, or wait for it to end")
        if file.exists() and file.stat().st_ino == os.fstat(stream.fileno()).st_ino:
            stream.truncate(0)
            stream.write(f"process {os.getpid()} on {platform.node()}")
            stream.flush()
            _HELD[path] = stream
            atexit.register(unlock, path)
        else:  # whoever held it has just removed the file
            stream.close()


def unlock(path: Path) -> None:
    """Release what `lock` has locked, if it has."""
    if path in _HELD:
        _lock_file(path).unlink(missing_ok=True)
        _HELD.pop(path).close()


def _lock_file(path: Path) -> Path:
    return path.with_name(f"{_hidden(path)}.lock")


def _hidden(path: Path) -> str:
    """Return the beginning of the names of hidden files beside a path, cut to leave room."""
    return f".{os.fsdecode(os.fsencode(path.name)[:_NAME])}"


def _absolute(path: str | Path) -> Path:
    """Return a path without links; a loop of links and an unknown ~user stay as they are."""
    return Path(os.path.realpath(os.path.expanduser(path)))  # noqa: PTH111 - raises for no user


def _locked(stream: TextIO) -> bool:
    """Whether the lock of an open file could be had; a file system without locks has none."""
    with suppress(ImportError, OSError):  # Windows has no fcntl
        import fcntl

        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def in_runs(name: str) -> Path:
    """Return the folder of a name in `runs`, which is where output goes by default."""
    return Path("runs") / slug(name)


def next_free(base: str | Path) -> Path:
    """Return the first of base, base-2, base-3, ... that does not exist yet, claimed."""
    path, number = Path(base), 1
    while True:
        with suppress(TakenError):
            if not path.exists():
                return claim(path)
        number += 1
        path = path.with_name(f"{Path(base).name}-{number}")


@contextmanager
def whole(folder: str | Path) -> Iterator[Path]:
    """Give a temporary sibling of `folder` to write into; it takes its name only when all is there.

    Whatever interrupts the writing leaves nothing behind. `folder` must be new or empty.
    """
    path = _absolute(folder)
    with named(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = _partial(path)
    try:
        with named(path):
            yield partial
            partial.rename(path)
    except OutputError as error:
        raise OutputError(str(error).replace(str(partial), str(path))) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        unlock(path)


@contextmanager
def written(file: Path) -> Iterator[Path]:
    """Give a temporary sibling of a file to write to; it takes the file's name only when whole.

    A reader finds the old file or the new one, never a part.
    """
    partial = file.with_name(f".{os.getpid()}-{file.name}")
    try:
        yield partial
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
def named(path: str | Path, error: type[Exception] = OutputError, more: str = ""
          ) -> Iterator[None]:
    """Turn an OSError into an error that says which path cannot be written, and `more`."""
    try:
        yield
    except OSError as found:
        raise error(f"{path} cannot be written: {reason(found)}{more}") from found


def reason(error: OSError) -> str:
    """Return why a file or folder cannot be written, naming what stands in its place."""
    if isinstance(error, FileExistsError | NotADirectoryError) and error.filename:
        asked = Path(error.filename)
        there = next((one for one in (asked, *asked.parents) if one.is_file()), asked)
        return f"{there} is no folder"
    return error.strerror or str(error)


def make_folder(folder: Path) -> Path:
    """Make a folder unless it is there, and return it; raises OutputError."""
    with named(f"output folder {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8", "backslashreplace"))  # paths may not be UTF-8


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    with written(path) as partial:
        partial.write_bytes(content)


def finite(data: Any) -> Any:
    """Return plain data with None for each number that is not finite, which JSON does not have."""
    if isinstance(data, dict):
        return {key: finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite(value) for value in data]
    return None if isinstance(data, float) and not isfinite(data) else data


def write_json(path: Path, data: Any) -> None:
    """Write plain data as a JSON file; raises ValueError for a number that is not finite."""
    write_text(path, json.dumps(data, indent=2, allow_nan=False) + "\n")


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
    """Return a text as a name for a file or folder; different texts may have the same one.

    A long one ends in a digest.
    """
    name = re.sub(r"[^\w.]+", "-", text.replace("=-", "=minus")).strip("-.") or "unnamed"
    digest, whole = hashlib.sha256(name.encode()).hexdigest(), name.encode()
    return name if len(whole) <= _NAME else (
        f"{whole[:_NAME - 9].decode(errors='ignore')}-{digest[:8]}")
