"""Robots by their names in packages of robot descriptions."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from hierarchy.errors import RobotError, UnknownNameError

PACKAGES = ("example_robot_data", "robot_descriptions")
_REMEDY = "pip install 'task-hierarchy[robots]'"


def in_package(model: str) -> bool:
    """Whether `model` is "package:name" with a known package."""
    return model.partition(":")[0] in PACKAGES and ":" in model


def file_of(model: str) -> Path:
    """Return the URDF or MJCF file of "example_robot_data:NAME" or "robot_descriptions:NAME".

    Raises RobotError if the package is not installed or its file is not available, and
    UnknownNameError for an unknown name.
    """
    package, _, name = model.partition(":")
    finder = {"example_robot_data": _in_example_robot_data,
              "robot_descriptions": _in_robot_descriptions}
    if package not in finder:
        raise UnknownNameError("package of robots", package, PACKAGES)
    return finder[package](name)


def _in_example_robot_data(name: str) -> Path:
    """Names are those of its URDF files, without the suffix."""
    try:
        files = distribution("example-robot-data").files or []
    except PackageNotFoundError as error:
        raise RobotError(f"robot 'example_robot_data:{name}' needs the package "
                         f"example-robot-data: {_REMEDY}") from error
    found = {file.name.removesuffix(".urdf"): file for file in sorted(files, reverse=True)
             if file.name.endswith(".urdf")}
    if name not in found:
        raise UnknownNameError("robot of example_robot_data", name, found)
    return Path(str(found[name].locate())).resolve()


def _in_robot_descriptions(name: str) -> Path:
    """Names are those of its modules, with or without "_description"; they download files."""
    try:
        known = import_module("robot_descriptions._descriptions").DESCRIPTIONS
    except ImportError as error:
        raise RobotError(f"robot 'robot_descriptions:{name}' needs the package "
                         f"robot-descriptions: {_REMEDY}") from error
    module = name if name in known else f"{name}_description"
    if module not in known:
        raise UnknownNameError("robot of robot_descriptions", name, known)
    try:
        description = import_module(f"robot_descriptions.{module}")
    except Exception as error:  # it clones a repository: git and the network fail in many ways
        raise RobotError(f"robot 'robot_descriptions:{name}' could not be downloaded: "
                         f"{type(error).__name__}: {str(error).strip()[:200]}") from error
    for key in ("URDF_PATH", "MJCF_PATH"):
        if hasattr(description, key):
            return Path(getattr(description, key))
    raise RobotError(f"robot 'robot_descriptions:{name}' has neither a URDF nor an MJCF file")
