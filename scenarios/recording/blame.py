"""Whose fault an error is that ended a run."""

from collections.abc import Iterator
from contextlib import contextmanager
from traceback import walk_tb

from hierarchy.errors import HierarchyError
from hierarchy.task import Task
from solvers import Resolver

_OURS = ("hierarchy", "solvers", "scenarios")


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
    """Return what an error says, of which task or resolver, and its line in the user's file."""
    if isinstance(error, HierarchyError):
        return str(error)
    whose = theirs = where = ""
    for frame, line in walk_tb(error.__traceback__):
        one, file = frame.f_locals.get("self"), frame.f_code.co_filename
        if isinstance(one, Task | Resolver):
            whose = f"{'task' if isinstance(one, Task) else 'resolver'} {one.name!r}: "
        if not theirs and frame.f_globals.get("__name__", "").partition(".")[0] not in _OURS:
            theirs = file
        if theirs in ("", file):
            where = f" ({file}, line {line})"
    said = " ".join(str(error).split())
    return f"{whose}{type(error).__name__}{said and ': '}{said}{where}"
