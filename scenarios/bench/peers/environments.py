"""A virtual environment for each compared package, in the user's cache folder."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from scenarios.bench.peers.entrants import PACKAGES, Package

INSTALL = "hierarchy bench peers --install"
_LIMIT = 1200.0  # [s] for one package
_FAILED = "failed.txt"


class MissingError(Exception):
    """A package that cannot be run; the message gives the reason."""


def folder_of(package: Package) -> Path:
    """Return the folder of the package's environment, which may not exist."""
    root = os.environ.get("XDG_CACHE_HOME", "~/.cache")
    return Path(root).expanduser() / "task-hierarchy" / "peers" / package.name


def python_of(package: Package) -> str:
    """Return the interpreter that has the package: its own, or else this one.

    Raises
    ------
    MissingError : neither has it, with what pip said if it was tried.
    """
    folder = folder_of(package)
    if package.requirements and (folder / "done").is_file():
        return str(folder / "bin" / "python")
    if importlib.util.find_spec(package.module) is not None:
        return sys.executable
    if (folder / _FAILED).is_file():
        raise MissingError(f"pip failed: {(folder / _FAILED).read_text().strip()}")
    raise MissingError(f"not installed; {INSTALL if package.requirements else 'pip install daqp'}")


def install(packages: Iterable[Package] = PACKAGES) -> dict[str, str]:
    """Make missing environments; return "" or the reason of a failure by name."""
    said = {}
    for package in packages:
        folder = folder_of(package)
        said[package.name] = "" if (folder / "done").is_file() else _make(package, folder)
    return said


def _make(package: Package, folder: Path) -> str:
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    why = (_said([sys.executable, "-m", "venv", str(folder)])
           or _said([str(folder / "bin" / "python"), "-m", "pip", "install", "--quiet",
                     "--disable-pip-version-check", *package.requirements]))
    folder.mkdir(exist_ok=True)
    (folder / (_FAILED if why else "done")).write_text(why or " ".join(package.requirements))
    return why


def _said(command: list[str]) -> str:
    """Run a command and return "", or its last line of output if it failed."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    lines = (done.stderr or done.stdout).strip().splitlines()
    return "" if done.returncode == 0 else lines[-1] if lines else f"exit code {done.returncode}"
