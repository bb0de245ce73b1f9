"""The one decorator that compiles a kernel and caches it on disk.

numba caches machine code per source file but does not notice when a helper in *another* file
changed. Here the cache folder carries a digest of the kernel's own file, of every file from which
that file imports kernels, of the CONSTANTS that it knows, and of this one, so a stale kernel cannot
be loaded. What a file imports counts for all its kernels: a helper further down may use it.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from typing import Any

import numba
import numpy as np
from llvmlite import binding
from numba.core import caching, cgutils, event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.runtime import _nrt_python
from numba.extending import intrinsic

from hierarchy.jit import ahead, recording

# What makes an array; a kernel that uses another way of numpy fails to compile, and belongs here.
_MAKERS = {"empty", "empty_like", "zeros", "zeros_like", "ones", "full", "eye", "copy", "array"}
_DAMAGE = (pickle.UnpicklingError, EOFError, ValueError, AttributeError, ImportError, IndexError)
_OWN = tuple(str(Path(__file__).with_name(name)) for name in ("compiling.py", "lanes.py"))
_EVERY = 5.0  # [s] between two words on a compilation that goes on


@cache
def _prepare_compilation() -> None:
    """Import numba's array functions without scipy, which takes as long as all other imports.

    numba looks there for a BLAS when these functions are imported, and again when a kernel that
    needs one is compiled; no kernel here does.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    from numba.np import linalg

    look, linalg.ensure_blas = linalg.ensure_blas, _expect_blas
    try:
        from numba.np import arraymath
    finally:
        linalg.ensure_blas = look
    arraymath.ensure_blas = look


def _expect_blas() -> None:
    if find_spec("scipy") is None:
        raise ImportError("scipy is not installed")


# Kernels carry no annotations: their types are those of the first call.
Kernel = Callable[..., Any]


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


class Cached(CPUDispatcher):  # type: ignore[misc]
    """A kernel that looks for its files when it is first needed; most are only compiled in."""

    cached_in: Path | None = None
    kept = True  # on disk
    ready: dict[Any, Any]  # entries for Python by types of arguments, compiled ahead
    _cache: Any

    def entry(self, kinds: tuple[Any, ...]) -> Any:
        """Return what Python calls with arguments of these types, compiled ahead or now."""
        with global_compiler_lock:
            return self._ready(kinds) or self.compile(kinds)

    def _ready(self, kinds: tuple[Any, ...]) -> Any:
        if kinds not in self.ready and kinds not in self.overloads and ahead.parts():
            found = ahead.find(self, kinds, source_digest(self))
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
        if made.signature.args in self.ready:
            self.overloads[made.signature.args] = made
        else:
            super().add_overload(made)

    def compile(self, signature: Any) -> Any:
        """Return what Python calls, compiled now or on an earlier day, and kept."""
        with global_compiler_lock:
            if self.kept and self.cached_in and isinstance(self._cache, caching.NullCache):
                self._cache = _cache(self.cached_in, self.py_func)
            return super().compile(signature)


class _OnlyInlined(Cached):
    """A kernel without an entry for Python, where a call would end the process."""

    def __call__(self, *arguments: Any) -> Any:
        raise TypeError(f"{self.py_func.__name__} is compiled into other kernels; "
                        "Python calls what is `compiled`")


def _as_matrix(context: Any, numbers: Any, rows: Any, columns: Any) -> Any:
    """Return the view (rows, columns) of contiguous numbers, of which there must be so many.

    In kernels, where `reshape` costs a call of its own.
    """
    from numba.np import arrayobj

    kind = types.Array(numbers.dtype, 2, "C")

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        flat = arrayobj.make_array(numbers)(context, builder, arguments[0])
        view = arrayobj.make_array(kind)(context, builder)
        width = builder.mul(arguments[2], flat.itemsize)
        arrayobj.populate_array(view, data=flat.data, shape=arguments[1:],
                                strides=[width, flat.itemsize], itemsize=flat.itemsize,
                                meminfo=flat.meminfo, parent=flat.parent)
        if context.enable_nrt:
            context.nrt.incref(builder, kind, view._getvalue())
        return view._getvalue()

    return kind(numbers, types.intp, types.intp), write


def _as_integers(context: Any, numbers: Any) -> Any:
    """Return the view of contiguous numbers as int64; `view` is a kernel of its own to compile."""
    from numba.np import arrayobj

    kind = types.Array(types.int64, 1, "C")

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        flat = arrayobj.make_array(numbers)(context, builder, arguments[0])
        view = arrayobj.make_array(kind)(context, builder)
        data = builder.bitcast(flat.data, view.data.type)
        shape, strides = (cgutils.unpack_tuple(builder, part, 1)
                          for part in (flat.shape, flat.strides))
        arrayobj.populate_array(view, data=data, shape=shape, strides=strides,
                                itemsize=flat.itemsize, meminfo=flat.meminfo, parent=flat.parent)
        if context.enable_nrt:
            context.nrt.incref(builder, kind, view._getvalue())
        return view._getvalue()

    return kind(numbers), write


if numba.config.DISABLE_JIT:
    def as_matrix(numbers: Any, rows: int, columns: int) -> Any:
        """See `_as_matrix`."""
        return numbers.reshape((rows, columns))

    def as_integers(numbers: Any) -> Any:
        """See `_as_integers`."""
        return numbers.view(np.int64)
else:
    as_matrix, as_integers = intrinsic(_as_matrix), intrinsic(_as_integers)


def _compiled(function: Kernel, inline: bool = False, nogil: bool = False) -> Kernel:
    allocates = _allocates(function)
    if numba.config.DISABLE_JIT:
        return recording.observed(function)
    kernel: Any = numba.njit(error_model="numpy", forceinline=inline, nogil=nogil, _nrt=allocates,
                             no_cpython_wrapper=inline, no_cfunc_wrapper=True)(function)
    if isinstance(kernel, CPUDispatcher):  # not with NUMBA_DISABLE_JIT=1
        files, constants = files_behind(function), constants_behind(function)
        kernel.__class__ = _OnlyInlined if inline else Cached
        kernel.source_files, kernel.constants, kernel.allocates = files, constants, allocates
        kernel.ready = {}
        kernel.cached_in = cache_folder() / _digest((__file__, *sorted(files)),
                                                    tuple(sorted(constants)))
    return kernel  # type: ignore[no-any-return]


def files_behind(function: Kernel) -> frozenset[str]:
    """Return the files of a kernel and of all kernels that its file knows."""
    behind = (getattr(known, "source_files", ()) for known in function.__globals__.values())
    return frozenset({function.__code__.co_filename}).union(*behind)


def constants_behind(function: Kernel) -> frozenset[str]:
    """Return the numbers that a kernel's file knows, and those behind all kernels it knows."""
    known = function.__globals__
    behind = (getattr(value, "constants", ()) for value in known.values())
    return frozenset(f"{name} = {value!r}" for name, value in known.items() if name.isupper()
                     and isinstance(value, (int, float, np.integer))).union(*behind)


def _allocates(function: Kernel) -> bool:
    """Whether a kernel, or one that it calls, makes arrays.

    One that does not needs no reference counts; without them a call costs half (7 arrays: 0.15 us
    in place of 0.3), and a view of a row nothing.
    """
    return (not _MAKERS.isdisjoint(function.__code__.co_names)
            or any(getattr(kernel, "allocates", False) for kernel in _called(function)))


def _called(function: Kernel) -> list[Any]:
    return [function.__globals__.get(name) for name in function.__code__.co_names]


@cache
def _digest(files: tuple[str, ...], constants: tuple[str, ...]) -> str:
    content = "\n".join((*map(digest_of, files), *constants, numba.__version__))
    return hashlib.sha256(content.encode()).hexdigest()[:16]


def source_digest(*functions: Any) -> str:
    """Return a digest of all sources and constants behind functions, the same on every machine."""
    plain = [getattr(function, "py_func", function) for function in functions]
    files = frozenset[str]().union(*map(files_behind, plain))
    constants = frozenset[str]().union(*map(constants_behind, plain))
    content = "\n".join((*sorted(map(digest_of, (*files, *_OWN))), *sorted(constants)))
    return hashlib.sha256(content.encode()).hexdigest()[:16]


@cache
def digest_of(file: str) -> str:
    """Return the digest of one file."""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


@cache
def _register_symbols() -> None:
    """Let loaded code find numba's runtime and hash of strings; it calls address 0 if it cannot.

    numba registers them when it refreshes its registries, all others when it makes its context.
    """
    import_module("numba.cpython.hashing")
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    """The files of a kernel. To load one, numba need not know how to compile."""

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return what is kept, or None.

        Without the refresh of numba's registries, which takes a third of a first solve; compiling
        refreshes them itself.
        """
        _register_symbols()
        with self._guard_against_spurious_io_errors():
            kept = self._load_overload(signature, context)
        if kept is None:
            _prepare_compilation()
        return kept


class _Mending(caching.IndexDataCacheFile):  # type: ignore[misc]
    """Files of compiled kernels; one that is damaged, as by a full disk, counts as missing."""

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except _DAMAGE:
            return {}

    def _load_data(self, name: str) -> Any:
        try:
            return super()._load_data(name)
        except _DAMAGE as error:
            raise OSError(f"{name} is damaged") from error  # numba then compiles anew


@cache
def cache_folder() -> Path:
    """Return the folder of compiled kernels."""
    base = os.environ.get("NUMBA_CACHE_DIR")
    if base is None:
        base = os.environ.get("XDG_CACHE_HOME", "~/.cache")
    return Path(base).expanduser() / "task-hierarchy"


def _cache(folder: Path, function: Kernel) -> _Cache:
    before = numba.config.CACHE_DIR
    try:
        folder.mkdir(parents=True, exist_ok=True)
        numba.config.CACHE_DIR = str(folder)
    except OSError:  # a home that cannot be written: numba's own choice of folder
        numba.config.CACHE_DIR = before
    try:
        kept = _Cache(function)
    finally:
        numba.config.CACHE_DIR = before
    kept._cache_file.__class__ = _Mending
    return kept


class _Compilations(event.Listener):  # type: ignore[misc]
    """Says that kernels are being compiled, and how many are; numba compiles on a cache miss."""

    def __init__(self) -> None:
        self._count, self._begun, self._said = 0, 0.0, 0.0

    def on_start(self, event: Any) -> None:
        if self._begun == 0.0 and _is_own(event):
            self._begun = self._said = monotonic()
            _say("compiling kernels for this machine, once; a scenario needs some 80, in 20 to "
                 "40 s ...")

    def on_end(self, event: Any) -> None:
        self._count += _is_own(event)
        now = monotonic()
        if self._begun > 0.0 and now - self._said > _EVERY:
            self._said = now
            _say(f"{self._count} kernels in {now - self._begun:.0f} s ...")


def _is_own(event: Any) -> bool:
    module: str = event.data["dispatcher"].py_func.__module__
    return module.partition(".")[0] in ("hierarchy", "solvers", "scenarios")


def _say(what: str) -> None:
    print(f"task-hierarchy: {what}", file=sys.stderr, flush=True)


@cache
def announce_compilation() -> None:
    """Let the compilation of kernels be announced on stderr: it makes a program wait."""
    event.register("numba:compile", _Compilations())
