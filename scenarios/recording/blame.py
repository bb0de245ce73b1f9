"""Whose fault an error is that ended a run."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from traceback import walk_tb

from hierarchy import plugins
from hierarchy.errors import HierarchyError
from hierarchy.task import Task
from solvers import Resolver

_NOT_THEIRS = {"hierarchy", "solvers", "scenarios", *sys.stdlib_module_names}


@contextmanager
def blaming() -> Iterator[None]:
    """Make any error that is raised within a HierarchyError that says whose fault it is."""
    try:
        yield
    except HierarchyError:
        raise
    except (Exception, SystemExit) as error:  # a user's code, which may fail in any way
        raise HierarchyError(blamed(error)) from error


def blamed(error: BaseException) -> str:
    """Return what an error says, whose it is, and its line in the user's file."""
    if isinstance(error, HierarchyError):
        return str(error)
    whose = theirs = where = ""
    for frame, line in walk_tb(error.__traceback__):
        file, module = frame.f_code.co_filename, frame.f_globals.get("__name__", "")
        whose = _whose(frame.f_locals.get("self")) or whose
        if not theirs and module.partition(".")[0] not in _NOT_THEIRS:
            theirs = file
        if theirs in ("", file):
            where = f" ({file}, line {line})"
    said = " ".join(str(error).split())
    return f"{whose}{type(error).__name__}{said and ': '}{said}{where}"


def _whose(one: object) -> str:
    """Return which task, resolver, or plant or sensor of a plug-in it is, with a colon, or ""."""
    if isinstance(one, Task | Resolver):
        return f"{'task' if isinstance(one, Task) else 'resolver'} {one.name!r}: "
    groups: tuple[plugins.Group, ...] = ("plants", "sensors")
    return next((f"{group[:-1]} of kind {name!r}: " for group in groups
                 for name, thing in plugins.registered(group).items() if thing is type(one)), "")
