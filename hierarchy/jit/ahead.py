"""Kernels that were compiled when the package was built: object files, each with an index.

An index has, for each kernel, the digest of the sources that it was made of and the types of
arguments that there is code for. Any other call, and a kernel whose sources have changed since, is
compiled when it is needed.
"""

from __future__ import annotations

import ctypes
import json
import os
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, final

import numpy as np

from hierarchy.jit.caching import register_symbols
from hierarchy.jit.inside import Environment, llvm, load_helpers, make_function
from hierarchy.jit.sources import described, source_digest

FOLDER = Path(__file__).with_name("objects")
NATIVE = "TASK_HIERARCHY_NATIVE"  # set: every kernel is compiled for this very processor
PROCESSOR = "x86-64-v3"
_FEATURES = ("avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt",
             "sahf", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave")  # of x86-64-v3


@final
@dataclass(frozen=True)
class Code:
    """Code for one list of types: names in the object file, and what its environment holds.

    digest : of the sources that the code was made of.
    """

    digest: str
    wrapper: str
    environment: str
    constants: tuple[str, ...]


@final
@dataclass(frozen=True)
class Part:
    """An object file and its index.

    calls : digest of the list of calls that it was made for.
    entries : by name of the kernel and types of arguments, as `name(types)`.
    externals : the names that the object file expects to find.
    """

    file: Path
    calls: str
    entries: dict[str, Code]
    externals: tuple[str, ...]

    @staticmethod
    def read(file: Path) -> Part | None:
        """Read the index beside an object file; None if it is missing or damaged."""
        try:
            index = json.loads(file.with_suffix(".json").read_text())
            return Part(file, index["calls"],
                        {call: Code(**entry) for call, entry in index["entries"].items()},
                        tuple(index["externals"]))
        except (OSError, ValueError, LookupError, TypeError, AttributeError):
            return None

    def write(self, code: bytes) -> None:
        """Write both files, the object first."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        self.file.write_bytes(code)
        index = {"calls": self.calls, "externals": self.externals,
                 "entries": {call: vars(entry) for call, entry in self.entries.items()}}
        self.file.with_suffix(".json").write_text(json.dumps(index, indent=1))

    @cached_property
    def engine(self) -> Any:
        """The loaded object file; None if this numba or this Python lacks what it expects."""
        load_helpers()
        register_symbols()
        if any(llvm.address_of_symbol(name) is None for name in self.externals):
            return None
        target = llvm.Target.from_triple(llvm.get_process_triple())
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target.create_target_machine())
        engine.add_object_file(llvm.ObjectFileRef.from_path(str(self.file)))
        engine.finalize_object()
        return engine

    def function(self, entry: Code, kernel: Any) -> Any:
        """Return what Python calls; None if the object file cannot be loaded."""
        if self.engine is None:
            return None
        module, address = import_module(kernel.__module__), self.engine.get_function_address
        environment = Environment(vars(module))
        environment.env_name = entry.environment
        environment.consts.extend(map(np.dtype, entry.constants))
        place = self.engine.get_global_value_address(entry.environment)
        ctypes.c_void_p.from_address(place).value = id(environment)
        return make_function(module, kernel.__name__, kernel.__doc__ or "",
                                      address(entry.wrapper), environment, (self.engine,))


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
    """Return the object files that this processor can run."""
    files = sorted(FOLDER.glob("*.o"))
    if not files or os.environ.get(NATIVE) or not _suits():
        return ()
    return tuple(filter(None, map(Part.read, files)))


def _suits() -> bool:
    features = llvm.get_host_cpu_features()
    triple = llvm.get_process_triple()
    return (triple.startswith("x86_64") and "linux" in triple
            and all(features.get(name) for name in _FEATURES))
