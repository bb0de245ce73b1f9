"""The one decorator that makes a kernel, and kernels as Python calls them: bound to arrays."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

import numba
import numpy as np

from hierarchy.jit.caching import KernelCache, find
from hierarchy.jit.inside import CPUDispatcher, NumbaError, global_compiler_lock
from hierarchy.jit.linking import name_of, naming
from hierarchy.jit.sources import Kernel, described, digest_of

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


def internal(function: Kernel) -> Kernel:
    """Like `compiled`, for kernels to call; Python cannot.

    The code for that takes as long to compile as many a function.
    """
    return _compiled(function, Internal)


def inlined(function: Kernel) -> Kernel:
    """Like `internal`, compiled into the kernels that call it: for what an inner loop calls.

    A call between compiled functions costs some 2 ns for each array handed over.
    """
    return _compiled(function, OnlyInlined)


def _compiled(function: Kernel, kind: type[Cached] | None = None, nogil: bool = False) -> Kernel:
    if numba.config.DISABLE_JIT:
        return function
    with suppress(OSError):  # the file may change before the kernel is needed
        function.digest = digest_of(function)  # type: ignore[attr-defined]
    allocates = _allocates(function)
    kernel: Any = numba.njit(error_model="numpy", forceinline=kind is OnlyInlined, nogil=nogil,
                             _nrt=allocates, no_cpython_wrapper=kind is not None,
                             no_cfunc_wrapper=True)(function)
    kernel.__class__ = kind or Cached
    kernel.allocates, kernel.ready, kernel.bound = allocates, {}, {}
    return kernel  # type: ignore[no-any-return]


def _allocates(function: Kernel) -> bool:
    """Whether a kernel, or one that it calls, makes arrays.

    One that does not needs no reference counts; without them a call costs half (7 arrays: 0.15 us
    in place of 0.3), and a view of a row nothing.
    """
    names, known = set(function.__code__.co_names), function.__globals__
    kernels = {name for name in names if hasattr(known.get(name), "allocates")}
    return (not _MAKERS.isdisjoint(names - kernels)
            or any(known[name].allocates for name in kernels))


if hasattr(os, "register_at_fork"):  # a child of a thread that waits would wait for ever
    os.register_at_fork(before=global_compiler_lock.acquire,
                        after_in_parent=global_compiler_lock.release,
                        after_in_child=global_compiler_lock.release)

asked: set[str] = set()  # what Python has called, or bound, in this process: `name(types)`


class Cached(CPUDispatcher):  # type: ignore[misc]
    """A kernel that looks for its files when it is first needed; most are only compiled in."""

    kept = True  # on disk
    is_named = True  # in code that calls it, not linked into it
    ready: dict[Any, Any]  # entries for Python by types of arguments, compiled ahead
    bound: dict[Any, Any]  # entries by what types depend on, as `bind` has asked for them
    _cache: Any

    def entry(self, kinds: tuple[Any, ...]) -> Any:
        """Return what Python calls with arguments of these types, compiled ahead or now."""
        with global_compiler_lock:
            return self._ready(kinds) or self.compile(kinds)

    def _ready(self, kinds: tuple[Any, ...]) -> Any:
        if name := name_of(self):
            asked.add(f"{name}({described(kinds)})")
        if kinds not in self.ready and kinds not in self.overloads:
            found = find(self, kinds)
            if found is not None:
                self.ready[kinds] = found
                self._insert([kind._code for kind in kinds], found, False)
        return self.ready.get(kinds)

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        with global_compiler_lock, suppress(ValueError, NumbaError):
            found = self._ready(tuple(map(numba.typeof, arguments)))
            if found is not None:
                return found
        return super()._compile_for_args(*arguments, **named)

    def add_overload(self, made: Any) -> None:
        """Take code in; where there is an entry compiled ahead, only for kernels that call this."""
        if self.is_named and (name := name_of(self)):
            made.library.kernel = name, made.signature.args
        if made.signature.args in self.ready:
            self.overloads[made.signature.args] = made
        else:
            super().add_overload(made)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Return what numba infers a call from: a constant is a number like any other."""
        return super().get_call_template(tuple(map(numba.types.unliteral, arguments)), named)

    def compile(self, signature: Any) -> Any:
        """Return the function that Python calls, compiled now or loaded from the cache."""
        with global_compiler_lock:
            if self.kept and not isinstance(self._cache, KernelCache):
                self._cache = KernelCache(self.py_func)
            with naming(None if self.is_named else self.py_func):
                return super().compile(signature)


class Internal(Cached):
    """A kernel without an entry for Python, where a call would end the process."""

    def __call__(self, *arguments: Any) -> Any:
        """Raise a TypeError."""
        raise TypeError(f"{self.py_func.__name__} is compiled for other kernels; "
                        "Python calls what is `compiled`")


class OnlyInlined(Internal):
    """A kernel whose code is linked into its callers."""

    is_named = kept = False


def bind(kernel: Kernel, *arguments: Any, then: tuple[Any, ...] = ()) -> Callable[..., Any]:
    """Return `kernel` bound to its first arguments; a call gives the rest: numbers, tuples of them.

    A call of a kernel looks at the type of every argument, each time (20 arrays: 0.4 us). Here that
    is done once, and a call costs a third. `then` has an example of each argument of a call; where
    it has a number, a call may give any that Python can convert.
    """
    dispatcher: Any = kernel
    if not hasattr(dispatcher, "overloads"):  # NUMBA_DISABLE_JIT
        return partial(kernel, *arguments)
    given = *arguments, *then
    types = tuple(map(_type_of, given))
    entry = dispatcher.bound.get(types)
    if entry is None:
        entry = dispatcher.bound[types] = dispatcher.entry(tuple(map(numba.typeof, given)))
    return partial(entry, *arguments) if arguments else entry


def _type_of(value: Any) -> Any:
    """Return what numba's type of a value depends on, since making the type takes 4 us an array."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num
    if isinstance(value, tuple):
        return type(value), *map(_type_of, value)
    return numba.typeof(value)
