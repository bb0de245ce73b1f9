"""The one decorator that makes a kernel of a function."""

from __future__ import annotations

from typing import Any

import numba

from hierarchy.jit.dispatching import Cached, OnlyInlined
from hierarchy.jit.sources import Kernel

# What makes an array; a kernel that uses another way of numpy fails to compile, and belongs here.
_MAKERS = {"empty", "empty_like", "zeros", "zeros_like", "ones", "full", "eye", "copy", "array"}


def compiled(function: Kernel) -> Kernel:
    """Compile `function` for the types it is first called with, and keep the result on disk.

    IEEE arithmetic as written (no fastmath), division by zero gives inf or NaN as in numpy.
    With `NUMBA_DISABLE_JIT=1` the plain function runs, for debugging.
    """
    return _compiled(function)


def unlocked(function: Kernel) -> Kernel:
    """Like `compiled`, and other threads of Python run meanwhile: for calls of milliseconds."""
    return _compiled(function, nogil=True)


def inlined(function: Kernel) -> Kernel:
    """Compile `function` into the kernels that call it: for what an inner loop calls.

    A call between compiled functions costs some 2 ns for each array handed over. Python cannot
    call it: the code for that takes longer to compile than most of these functions.
    """
    return _compiled(function, inline=True)


def _compiled(function: Kernel, inline: bool = False, nogil: bool = False) -> Kernel:
    if numba.config.DISABLE_JIT:
        return function
    allocates = _allocates(function)
    kernel: Any = numba.njit(error_model="numpy", forceinline=inline, nogil=nogil, _nrt=allocates,
                             no_cpython_wrapper=inline, no_cfunc_wrapper=True)(function)
    kernel.__class__ = OnlyInlined if inline else Cached
    kernel.allocates, kernel.ready = allocates, {}
    return kernel  # type: ignore[no-any-return]


def _allocates(function: Kernel) -> bool:
    """Whether a kernel, or one that it calls, makes arrays.

    One that does not needs no reference counts; without them a call costs half (7 arrays: 0.15 us
    in place of 0.3), and a view of a row nothing.
    """
    return (not _MAKERS.isdisjoint(function.__code__.co_names)
            or any(getattr(kernel, "allocates", False) for kernel in _called(function)))


def _called(function: Kernel) -> list[Any]:
    return [function.__globals__.get(name) for name in function.__code__.co_names]
