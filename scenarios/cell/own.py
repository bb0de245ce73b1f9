"""Make what a section of an own kind asks for, with the plugin's class or function."""

from __future__ import annotations

from inspect import signature
from typing import Any, get_args

from hierarchy import HierarchyError, Robot
from hierarchy.paths import Path
from hierarchy.robot import Frame
from scenarios.cell.paths import make_path
from scenarios.config import ScenarioError
from scenarios.config.own import OwnSection


def make_own(section: OwnSection, robot: Robot, **given: Any) -> Any:
    """Call the maker of a section with its keys and those of `given` that it has a parameter for.

    Raises ScenarioError, naming the kind, for whatever goes wrong in it: it is the user's code.
    """
    wanted = {"robot": robot, **given}
    maker = section.maker
    what = f"{section.group[:-1]} of kind {section.kind!r}"
    try:
        values = {key: _made(annotation, value, robot)
                  for key, (annotation, value) in section.settings().items()}
        provided = {name: value for name, value in wanted.items()
                    if name in signature(maker).parameters}
        return maker(**provided, **values)
    except HierarchyError as error:
        raise ScenarioError(f"{what}: {error}") from error
    except Exception as error:
        raise ScenarioError(f"{what}: {type(error).__name__}: {error}") from error


def _made(annotation: Any, value: Any, robot: Robot) -> Any:
    """Return the value of a key as the maker wants it: frames by name, paths by their table."""
    kinds = (annotation, *get_args(annotation))
    if Frame in kinds and isinstance(value, str):
        return robot.frame(value)
    return make_path(value) if Path in kinds and value is not None else value
