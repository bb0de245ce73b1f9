"""Compiled kernels on disk: one file for a kernel, the types of its arguments, and a machine.

numba's own cache does not notice when a helper in another file has changed. Here the name of a file
carries a digest of everything that the code depends on, so no stale one is found. The cache is a
convenience: what cannot be read is compiled, and what cannot be written is lost with the process.
Files hold pickles, so only those are read that this user or root has written and nobody else can.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import llvmlite
import numba

from hierarchy.jit.inside import CompileResult, NullCache, dumps, llvm, nrt_helpers
from hierarchy.jit.linking import found
from hierarchy.jit.saying import say
from hierarchy.jit.sources import described, source_digest

_CHECKSUM = 32  # [B] at the beginning of a file


class KernelCache(NullCache):  # type: ignore[misc]
    """The files of one kernel."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._name = f"{function.__module__}.{function.__qualname__}"

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the stored kernel, or None.

        Without the refresh of numba's registries, which takes a third of a first solve; compiling
        refreshes them itself.
        """
        register_symbols()
        file = self._file(signature, context)
        body = None if file is None else _read(file)
        if body is not None:
            with suppress(Exception):  # whatever a pickle of another day raises: compiled anew
                calls, symbols, state = pickle.loads(body)
                for name, kinds in calls:
                    found(name).compile(kinds)
                made = [found(name).overloads[kinds] for name, kinds in calls]
                # Another process may have stored a callee since, under a symbol of its own, and
                # LLVM ends this one at a symbol that is missing.
                if symbols == [one.fndesc.llvm_func_name for one in made]:
                    loaded = CompileResult._rebuild(context, *state)
                    loaded.library.calls = {one.library: None for one in made}
                    return loaded
        _prepare_compilation()
        return None

    def save_overload(self, signature: Any, made: Any) -> None:
        """Store a compiled kernel; if that is impossible, say so once."""
        file = self._file(signature, made.target_context)
        if file is None:
            _say_lost("their sources or a home folder are not to be found")
        elif not made.library.has_dynamic_globals:  # addresses of this process
            try:
                calls = [library.kernel for library in made.library.calls]
                symbols = [found(name).overloads[kinds].fndesc.llvm_func_name
                           for name, kinds in calls]
                _write(file, dumps((calls, symbols, made._reduce())))
            except OSError as error:
                _say_lost(f"{file.parent}: {error.strerror}")

    def _file(self, signature: Any, context: Any) -> Path | None:
        folder, function = cache_folder(), self._function
        digest = source_digest(function)
        if folder is None or not digest:
            return None
        kinds = described(getattr(signature, "args", signature))
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
        about = (self._name, function.__code__.co_firstlineno, digest, kinds, dumps(cells),
                 context.codegen().magic_tuple(), numba.__version__, llvmlite.__version__,
                 sys.version_info[:3])
        return folder / f"{self._name}-{hashlib.sha256(repr(about).encode()).hexdigest()[:32]}"


def _read(file: Path) -> bytes | None:
    """Return the content of a file; None if it is missing, damaged or of another user."""
    try:
        with file.open("rb") as opened:
            if not _is_trusted(os.fstat(opened.fileno())):
                return None
            content = opened.read()
    except OSError:
        return None
    body = content[_CHECKSUM:]
    return body if content[:_CHECKSUM] == _checksum(file, body) else None


def _is_trusted(status: os.stat_result) -> bool:
    return sys.platform == "win32" or (status.st_uid in (0, os.getuid())
                                       and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _write(file: Path, body: bytes) -> None:
    """Write a file completely or not at all; others may read it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=file.parent)
    try:
        with os.fdopen(number, "wb") as opened:
            opened.write(_checksum(file, body) + body)
        Path(name).chmod(0o644)
        Path(name).replace(file)
    except BaseException:
        Path(name).unlink()
        raise


def _checksum(file: Path, body: bytes) -> bytes:
    return hashlib.sha256(file.name.encode() + body).digest()


@cache
def _say_lost(reason: str) -> None:
    say(f"compiled kernels are not kept ({reason}); each process compiles them again")


@cache
def cache_folder() -> Path | None:
    """Return the folder of compiled kernels; None if the environment names no folder for it."""
    bases = [os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME")]
    with suppress(RuntimeError):  # neither HOME nor an entry for this user
        bases.append(str(Path("~/.cache").expanduser()))
    absolute = (Path(base) for base in bases if base and Path(base).is_absolute())
    return next((base / "task-hierarchy" for base in absolute), None)


@cache
def register_symbols() -> None:
    """Let loaded code find numba's runtime and hash of strings; it calls address 0 if it cannot.

    numba registers them when it refreshes its registries, all others when it makes its context.
    """
    import_module("numba.cpython.hashing")
    for name, address in nrt_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


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
