"""Tasks of a robot in order of priority, and the problem that a stack of them makes.

Names other than `Hierarchy` and `HierarchyError` are imported when first used, so that a program
that has only arrays does not load pinocchio.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from hierarchy.errors import HierarchyError
from hierarchy.problem import Hierarchy

if TYPE_CHECKING:
    from hierarchy.robot import Robot
    from hierarchy.stack import Stack
    from hierarchy.state import State
    from hierarchy.task import Task

__all__ = ["Hierarchy", "HierarchyError", "Robot", "Stack", "State", "Task"]

_PARTS = ("activation", "allocation", "avoidance", "kinematics", "limits", "loop", "paths",
          "measured", "robots", "tasks")  # modules that are public


def __getattr__(name: str) -> Any:
    if name in _PARTS:
        return import_module(f"hierarchy.{name}")
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"hierarchy.{name.lower()}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name[:2] == "__"), *__all__, *_PARTS})
