"""From the functions of the library to an object file, through LLVM; no compiler is needed.

Kernels are compiled as they are for Python: by numba, for the processor that LLVM detects. For
another one numba is told so by its environment when a process starts, so `emitted` starts one. Code
for another kind of processor is the code without extensions for this one, whose vectors have the
same width, translated by the back end of the other.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from hierarchy.errors import HierarchyError, UnknownNameError

TARGETS = ("native", "x86_64", "aarch64")
RESOLVERS = ("hcod", "tpm", "recursive", "sns", "merged")
_TRIPLES = {"x86_64": "x86_64-unknown-linux-gnu", "aarch64": "aarch64-unknown-linux-gnu"}
_WORKER = ("import pickle, sys; from solvers.library.emission import emit; "
           "pickle.dump(emit(sys.argv[3:], *sys.argv[1:3]), sys.stdout.buffer)")
_TEXTS = ("th_version", "th_digest")


@final
@dataclass(frozen=True)
class Emitted:
    """An object file, the names of the functions in it, and the machine that it is for.

    digest : of the sources of the kernels, see `source_digest`.
    """

    content: bytes
    symbols: tuple[str, ...]
    machine: str
    digest: str


def emitted(resolvers: Sequence[str], target: str, version: str) -> Emitted:
    """Return the object file of these resolvers for a target.

    Raises
    ------
    HierarchyError : an unknown or missing resolver or target, kernels are not compiled, or this
        LLVM or this machine cannot make code for the target.
    """
    check(resolvers, target)
    if target == "native":
        return emit(resolvers, target, version)
    done = subprocess.run([sys.executable, "-c", _WORKER, target, version, *resolvers],
                          env={**os.environ, "NUMBA_CPU_NAME": "generic"}, check=False,
                          capture_output=True)
    if done.returncode != 0:
        lines = done.stderr.decode().strip().splitlines()
        raise HierarchyError(f"no code for {target}: {lines[-1] if lines else 'no reason'}")
    made: Emitted = pickle.loads(done.stdout)
    return made


def check(resolvers: Sequence[str], target: str) -> None:
    """Raise a HierarchyError for an unknown name, or for a machine that has no objects in ELF."""
    if target not in TARGETS:
        raise UnknownNameError("target", target, TARGETS)
    for name in resolvers:
        if name not in RESOLVERS:
            raise UnknownNameError("resolver of the C library", name, RESOLVERS)
    if not resolvers:
        raise HierarchyError("a C library needs at least one resolver")
    if not sys.platform.startswith("linux"):
        raise HierarchyError(f"the C library is made on Linux, not on {sys.platform}")


def digest() -> str:
    """Return the digest of the kernels' sources as they are installed."""
    from hierarchy.jit.sources import source_digest
    from solvers.library.entries import solve_hcod

    return source_digest(solve_hcod)[:16]


def emit(resolvers: Sequence[str], target: str, version: str) -> Emitted:
    """Return the object file for what this process compiles for, see `emitted`."""
    import llvmlite.binding as llvm

    from hierarchy.jit import announce_compilation
    from hierarchy.jit.exporting import compiles, lowered, machine, object_code
    from hierarchy.jit.linking import hide
    from solvers.library import entries

    if not compiles():
        raise HierarchyError("kernels are not compiled: NUMBA_DISABLE_JIT is set")
    announce_compilation()
    functions = {f"th_solve_{name}": entries.RESOLVERS[name] for name in resolvers}
    functions |= entries.ALWAYS
    module, found = lowered(functions), digest()
    module.link_in(llvm.parse_assembly(_texts(dict(zip(_TEXTS, (version, found), strict=True)))))
    symbols = (*functions, *_TEXTS)
    hide(module, set(symbols))
    here = machine()
    if target == "native":
        triple, processor, features = here.triple, here.processor, here.features
    else:
        triple, processor, features = _TRIPLES[target], "generic", ""
    try:
        code = object_code(module, triple, processor, features)
    except RuntimeError as error:
        raise HierarchyError(f"this llvmlite has no back end for {triple}: {error}") from error
    return Emitted(code, symbols, f"{triple}, {processor}", found)


def _texts(texts: dict[str, str]) -> str:
    """Return LLVM code of functions without arguments that return constant texts."""
    from llvmlite import ir

    module, byte = ir.Module("texts"), ir.IntType(8)
    for name, text in texts.items():
        content = ir.Constant(ir.ArrayType(byte, len(text) + 1), bytearray(text.encode() + b"\0"))
        constant = ir.GlobalVariable(module, content.type, f"{name}_text")
        constant.initializer, constant.global_constant = content, True
        function = ir.Function(module, ir.FunctionType(byte.as_pointer(), []), name)
        builder = ir.IRBuilder(function.append_basic_block())
        builder.ret(builder.bitcast(constant, byte.as_pointer()))
    return str(module)

