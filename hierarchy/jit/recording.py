"""Which kernels Python calls, and with which types: noted while they run as plain functions.

Kernels that other kernels call are not noted. It takes NUMBA_DISABLE_JIT=1, and `begin` before the
first kernel is imported.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numba

_calls: dict[tuple[str, tuple[Any, ...]], None] | None = None
_depth = 0


def begin() -> None:
    """Note calls from now on."""
    global _calls
    _calls = {}


def calls() -> list[tuple[str, tuple[Any, ...]]]:
    """Return the name and the types of arguments of each kernel that Python called."""
    return list(_calls or ())


def note(kernel: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Note a call, unless another kernel makes it."""
    if _calls is not None and _depth == 0 and hasattr(kernel, "py_func"):
        name = f"{kernel.__module__}.{kernel.__qualname__}"
        _calls[name, tuple(map(numba.typeof, arguments))] = None


def observed(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function whose calls are noted; the function itself if nothing is.

    Its `unnoted` runs the same, for whom has noted it.
    """
    if _calls is None:
        return function

    @wraps(function)
    def unnoted(*arguments: Any) -> Any:
        global _depth
        _depth += 1
        try:
            return function(*arguments)
        finally:
            _depth -= 1

    @wraps(function)
    def noted(*arguments: Any) -> Any:
        note(noted, arguments)
        return unnoted(*arguments)

    vars(noted).update(py_func=function, unnoted=unnoted)
    return noted
