"""Robots by their names in packages of robot descriptions."""

import os
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from hierarchy import plugins
from hierarchy.errors import RobotError, UnknownNameError, nearest

_SUFFIXES = (".urdf", ".xml", ".mjcf",  # and those that are refused with what to give instead
             ".xacro", ".sdf", ".world", ".toml", ".dae", ".stl", ".obj", ".mjb", ".usd", ".usda")
_NEAR = 0.7  # similarity of two names, 0 to 1, from which one is meant
_REMEDY = "pip install 'task-hierarchy[descriptions]'"


def in_package(model: str) -> bool:
    """Whether `model` is "package:name" with a known package."""
    return model.partition(":")[0] in _NAMES and ":" in model


def is_file_name(model: str) -> bool:
    """Whether `model` means a file: it exists, or has a suffix or a folder."""
    return model not in plugins.own("robots") and (
        model.lower().endswith(_SUFFIXES) or "/" in model or os.sep in model
        or ("." in model and os.path.isfile(model)))  # noqa: PTH113 - raises for no name


def elsewhere(name: str) -> str:
    """Return where a robot that the package does not ship may be found, as a sentence."""
    found = list[str]()
    for package, names in _NAMES.items():
        with suppress(PackageNotFoundError, ImportError):
            found += [f"{package}:{known}" for known in nearest(name, names(), 3, _NEAR)]
    if found:
        return f"The installed packages have {', '.join(sorted(found, key=len)[:3])}."
    return ("Others: a URDF or MJCF file, or with the extra `descriptions` "
            "example_robot_data:NAME and robot_descriptions:NAME, such as "
            "example_robot_data:ur5_robot.")


# URDF files and modules by name; these raise PackageNotFoundError and ImportError.
_NAMES: dict[str, Callable[[], dict[str, Any]]] = {
    "example_robot_data": lambda: {
        file.name.removesuffix(".urdf"): file
        for file in sorted(distribution("example-robot-data").files or [], reverse=True)
        if file.name.endswith(".urdf")},
    "robot_descriptions": lambda: import_module("robot_descriptions._descriptions").DESCRIPTIONS}


def file_of(model: str) -> Path:
    """Return the URDF or MJCF file of "example_robot_data:NAME" or "robot_descriptions:NAME".

    Names are those of the URDF files of the one, without the suffix, and of the modules of the
    other, with or without "_description"; these download files. Raises RobotError if the package is
    not installed or its file is not available, and UnknownNameError for an unknown name.
    """
    package, _, name = model.partition(":")
    of_files = package == "example_robot_data"
    try:
        known = _NAMES[package]()
    except (PackageNotFoundError, ImportError) as error:
        raise RobotError(f"robot {model!r} needs the package {package.replace('_', '-')}: "
                         f"{_REMEDY}") from error
    called = name if of_files or name in known else f"{name}_description"
    if called not in known:
        raise UnknownNameError(f"robot of {package}", name, known)
    return Path(str(known[name].locate())).resolve() if of_files else _downloaded(called, model)


def _downloaded(module: str, model: str) -> Path:
    """Return the file of a module of robot_descriptions."""
    try:
        description = import_module(f"robot_descriptions.{module}")
    except Exception as error:  # it clones a repository: git and the network fail in many ways
        raise RobotError(f"robot {model!r} could not be downloaded: "
                         f"{type(error).__name__}: {str(error).strip()[:200]}") from error
    for key in ("URDF_PATH", "MJCF_PATH"):
        if hasattr(description, key):
            return Path(getattr(description, key))
    raise RobotError(f"robot {model!r} has neither a URDF nor an MJCF file")
