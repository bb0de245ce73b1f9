"""Compiled kernels on disk: made when the package was built, or here when they were first needed.

Ahead: a file for each part, with machine code, the LLVM code of which another processor with Linux
makes its own once, and for each kernel the digest of the sources that it was made of and the types
of arguments that there is code for. Any other call, and a kernel whose sources have changed since,
is compiled when it is needed.

Then: one file for a kernel, the types of its arguments, and a machine. numba's own cache does not
notice when a helper in another file has changed. Here the name of a file carries a digest of
everything that the code depends on, so no stale one is found. The cache is a convenience: what
cannot be read is compiled, and what cannot be written is lost with the process. Files hold pickles,
so only those are read that this user or root has written and nobody else can.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, final
from zipfile import ZipFile, ZipInfo

import llvmlite
import numba
import numpy as np

from hierarchy.jit.inside import (
    CompileResult,
    Environment,
    NullCache,
    dumps,
    llvm,
    load_helpers,
    make_function,
    nrt_helpers,
)
from hierarchy.jit.linking import found, hide, machine, object_code
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
                write(file, dumps((calls, symbols, made._reduce())))
            except OSError as error:
                _say_lost(f"{file.parent}: {error.strerror}")

    def _file(self, signature: Any, context: Any) -> Path | None:
        folder, function = cache_folder(), self._function
        digest = source_digest(function)
        if folder is None or not digest:
            return None
        kinds = described(getattr(signature, "args", signature))
        about = (self._name, function.__code__.co_firstlineno, digest, kinds,
                 context.codegen().magic_tuple(), numba.__version__, llvmlite.__version__,
                 sys.version_info[:3])
        return folder / f"{self._name}-{hashlib.sha256(repr(about).encode()).hexdigest()[:32]}"


def _read(file: Path) -> bytes | None:
    """Return what `write` wrote; None if it is missing, damaged, or another's to write."""
    with suppress(OSError), file.open("rb") as opened:
        status, content = os.fstat(opened.fileno()), opened.read()
        if sys.platform == "win32" or (status.st_uid in (0, os.getuid())
                                       and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
            body = content[_CHECKSUM:]
            return body if content[:_CHECKSUM] == _checksum(file, body) else None
    return None


def write(file: Path, body: bytes) -> None:
    """Write what `_read` returns."""
    _replace(file, _checksum(file, body) + body)


def _replace(file: Path, content: bytes) -> None:
    """Write a file completely or not at all; others may read it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=file.parent)
    try:
        with os.fdopen(number, "wb") as opened:
            opened.write(content)
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


FOLDER = Path(__file__).with_name("objects")
NATIVE = "TASK_HIERARCHY_NATIVE"  # set: code is made for this very processor
PROCESSOR = "x86-64-v3"
_FEATURES = ("avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt",
             "sahf", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave")  # of x86-64-v3


class Code(NamedTuple):
    """Code for one list of types: names in the machine code, and what its environment holds.

    digest : of the sources that the code was made of.
    """

    digest: str
    wrapper: str
    environment: str
    constants: Sequence[str]


def _archive(name: str) -> ZipFile:
    return ZipFile(FOLDER / f"{name}.kernels")


def write_part(name: str, index: tuple[Any, ...], **code: bytes) -> None:
    """Write a part: the fields of `Part` from `calls` to `externals`, and both kinds of code."""
    made = BytesIO()
    with ZipFile(made, "w") as archive:
        for member, content in {"index": json.dumps(index).encode(), **code}.items():
            archive.writestr(ZipInfo(member), content)  # without the time
    _replace(FOLDER / f"{name}.kernels", made.getvalue())  # an archive has checksums of its own


@final
@dataclass(frozen=True)
class Part:
    """Kernels that were compiled together: an object file, and the LLVM code that it was made of.

    checksums : of the members of its file.
    calls : those that it was made for.
    functions : digest of the functions of C, which only the LLVM code has.
    entries : by name of the kernel and types of arguments, as `name(types)`.
    externals : the names that the object file expects to find.
    """

    name: str
    checksums: dict[str, int]
    calls: Sequence[str]
    functions: str
    entries: dict[str, Code]
    externals: Sequence[str]

    @staticmethod
    def read(name: str) -> Part | None:
        """Read a part without its code; None if its file is missing or damaged."""
        with suppress(Exception), _archive(name) as opened:  # what damage raises, or an older form
            calls, functions, entries, externals = json.loads(opened.read("index"))
            return Part(name, {one.filename: one.CRC for one in opened.infolist()}, calls,
                        functions, {call: Code(*one) for call, one in entries.items()}, externals)
        return None

    def code(self, kind: str) -> bytes:
        """Return "machine" code, that of the object file, or "llvm" code.

        Raises RuntimeError if it is damaged, or by now of another build.
        """
        with suppress(Exception), _archive(self.name) as opened:
            if opened.getinfo(kind).CRC == self.checksums[kind]:
                return opened.read(kind)
        raise RuntimeError(f"{self.name}: its {kind} code is damaged or of another build")

    @cached_property
    def engine(self) -> Any:
        """The loaded object file; None if this numba or this Python lacks what it expects."""
        load_helpers()
        register_symbols()
        if any(llvm.address_of_symbol(name) is None for name in self.externals):
            return None
        try:
            made = llvm.ObjectFileRef.from_data(
                self.code("machine") if suits() else self._made_here())
        except RuntimeError:  # or LLVM code of a newer LLVM
            return None
        target = llvm.Target.from_triple(llvm.get_process_triple())
        engine = llvm.create_mcjit_compiler(
            llvm.parse_assembly(""), target.create_target_machine(),
            use_lmm=True)  # code and data next to each other: the way between them has 32 bits
        engine.add_object_file(made)
        engine.finalize_object()
        return engine

    def _made_here(self) -> bytes:
        """Return the object file for another processor, made of the LLVM code once."""
        code, here, folder = self.code("llvm"), machine(), cache_folder()
        about = hashlib.sha256(code + repr((here, llvmlite.__version__)).encode()).hexdigest()
        file = None if folder is None else folder / f"{self.name}-{about[:32]}.o"
        kept = None if file is None else _read(file)
        if kept is not None:
            return kept
        say(f"making code for this processor, once: {self.name} ...")
        module = llvm.parse_bitcode(code)
        hide(module, {name for one in self.entries.values()
                      for name in (one.wrapper, one.environment)})
        made = object_code(module, here)
        with suppress(OSError):
            if file is not None:
                write(file, made)
        return made

    def function(self, entry: Code, kernel: Any) -> Any:
        """Return what Python calls; None if the object file cannot be loaded."""
        if self.engine is None:
            return None
        start = self.engine.get_function_address(entry.wrapper)
        place = self.engine.get_global_value_address(entry.environment)
        module = import_module(kernel.__module__)
        environment = Environment(vars(module))
        environment.env_name = entry.environment
        environment.consts.extend(map(np.dtype, entry.constants))
        ctypes.c_void_p.from_address(place).value = id(environment)
        return make_function(module, kernel.__name__, kernel.__doc__ or "", start, environment,
                             (self.engine,))


def find(kernel: Any, kinds: tuple[Any, ...]) -> Any:
    """Return what Python calls for a kernel and the types of arguments; None if there is none."""
    call = f"{kernel.__module__}.{kernel.__qualname__}({described(kinds)})"
    for part in parts():
        entry = part.entries.get(call)
        if entry is not None and entry.digest == source_digest(kernel):
            return part.function(entry, kernel)
    return None


@cache
def parts() -> tuple[Part, ...]:
    """Return what was compiled ahead, if this kind of machine can run it or make its own of it."""
    triple = llvm.get_process_triple()
    runs = triple.startswith(("x86_64", "aarch64")) and "linux" in triple
    names = sorted(file.stem for file in FOLDER.glob("*.kernels")) if runs else []
    return tuple(filter(None, map(Part.read, names)))


@cache
def suits() -> bool:
    """Whether object files are used as they are: this processor can run them."""
    features = llvm.get_host_cpu_features()
    return not os.environ.get(NATIVE) and all(features.get(name) for name in _FEATURES)
