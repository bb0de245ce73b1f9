"""Entrants, their packages from PyPI, and an environment for each in the user's cache folder."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

INSTALL = "hierarchy bench peers --install"
_LIMIT = 1200.0  # [s] for one package
_FAILED = "failed.txt"


class MissingError(Exception):
    """An entrant that cannot be run; the message gives the reason."""


@final
@dataclass(frozen=True)
class Entrant:
    """One to be compared: what adapts it to the questions, and what is known of its limits.

    label : what tables call it. adapter : MODULE:CLASS or FILE.py:CLASS; options : arguments of the
    class. limits : one sentence, printed beside its numbers. python : interpreter to run it with,
    in place of the package's environment.
    """

    label: str
    package: Package
    adapter: str
    options: Mapping[str, Any] = field(default_factory=dict)
    limits: str = ""
    python: str = ""


@final
@dataclass(frozen=True)
class Package:
    """The requirements that pip installs into an environment of that name.

    They require different versions of pinocchio, numpy and MuJoCo. `module` is what is imported. An
    empty tuple of requirements: part of this project's own environment.
    """

    name: str
    module: str
    requirements: tuple[str, ...] = ()

    def peer(self, asked: str, label: str, limits: str = "", **options: Any) -> Entrant:
        """Return an entrant: the function or class `asked` of the package's adapter."""
        return Entrant(label, self, f"benchmark.peers.adapters.{self.module}:{asked}", options,
                       limits)


OWN = Package("task-hierarchy", "hierarchy")
DAQP = Package("daqp", "daqp")
PINK = Package("pin-pink", "pink", ("pin-pink==4.4.0", "daqp==0.11.0"))
MINK = Package("mink", "mink", ("mink==1.3.0", "daqp==0.11.0"))
PLACO = Package("placo", "placo", ("placo==0.10.2",))
# 1.10.0 aborts in its first constructor with pinocchio 4.0 and 4.1. Of the older ones with wheels
# for this Python 1.7.1 is the newest, made for just these libraries, which it does not ask for.
TSID = Package("tsid", "tsid", ("tsid==1.7.1", "pin==3.4.0", "cmeel-urdfdom<5",
                                "cmeel-tinyxml2<11"))
EMBODIK = Package("embodik", "embodik", ("embodik==0.23.2",))
ROBOPLAN = Package("roboplan", "roboplan", ("roboplan==0.7.0",))
# jax as frax's own documents advise for processors.
FRAX = Package("frax", "frax", ("frax==0.1.0", "jax==0.4.30", "jaxlib==0.4.30", "numpy<2.1"))
HIGHS = Package("highspy", "highspy", ("highspy==1.15.1", "qpsolvers==4.13.0"))
PACKAGES = (PINK, MINK, PLACO, TSID, EMBODIK, ROBOPLAN, FRAX, HIGHS)
"""Those that have an environment of their own."""


def folder_of(package: Package) -> Path:
    """Return the folder of the package's environment, which may not exist."""
    root = os.environ.get("XDG_CACHE_HOME") or "~/.cache"  # an empty one is as good as none
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


def install(package: Package) -> str:
    """Make the package's environment unless it is there; return "" or the reason of a failure."""
    folder = folder_of(package)
    if (folder / "done").is_file():
        return ""
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
