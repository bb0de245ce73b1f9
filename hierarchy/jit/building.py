"""From calls of kernels to an object file and its index, for `ahead` to load.

Each kernel is compiled as it would be when called, for a processor that numba is told by its
environment when this process starts; only the machine code is made once, of all of them together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hierarchy.jit.ahead import PROCESSOR, Entry, Part
from hierarchy.jit.dispatching import Cached
from hierarchy.jit.exporting import machine, object_code
from hierarchy.jit.inside import global_compiler_lock, registry
from hierarchy.jit.linking import Call, found, linked
from hierarchy.jit.sources import described, source_digest

ENVIRONMENT = {"NUMBA_CPU_NAME": PROCESSOR, "NUMBA_CPU_FEATURES": "",
               "NUMBA_DISABLE_INTEL_SVML": "1"}  # of a process that builds


@global_compiler_lock  # type: ignore[untyped-decorator]
def build(file: Path, jobs: str, calls: Sequence[Call], say: Callable[[int], None]) -> None:
    """Write an object file with these calls, and its index; `say` takes the number compiled."""
    _without_machine_code()
    libraries: list[Any] = []
    kernels: dict[str, tuple[str, dict[str, Entry]]] = {}
    for count, (name, kinds) in enumerate(calls):
        say(count)
        kernel = found(name)
        kernel.compile(kinds)
        made = kernel.overloads[kinds]
        if (entry := _entry(made)) is not None:
            libraries.append(made.library)
            kernels.setdefault(name, (source_digest(kernel), {}))[1][described(kinds)] = entry
    entries = [entry for _, those in kernels.values() for entry in those.values()]
    whole = linked(libraries, {name for one in entries for name in (one.wrapper, one.environment)})
    here = machine()
    code = object_code(whole, here.triple, here.processor, here.features)
    Part(file, jobs, kernels, _externals(whole)).write(code)


def is_current(file: Path, jobs: str) -> bool:
    """Whether an object file was made by these jobs from the sources as they are."""
    try:
        part = Part.read(file)
        return part.jobs == jobs and all(digest == source_digest(found(name))
                                         for name, (digest, _) in part.kernels.items())
    except (OSError, ValueError, LookupError, ImportError, AttributeError):
        return False


def _entry(made: Any) -> Entry | None:
    """Return how to find a compiled call; None if its environment holds other than number types."""
    constants = made.environment.consts
    if not all(isinstance(one, np.dtype) and one.fields is None for one in constants):
        return None
    return Entry(made.fndesc.llvm_cpython_wrapper_name, made.fndesc.env_name,
                 tuple(one.str for one in constants))


def _externals(module: Any) -> tuple[str, ...]:
    return tuple(sorted(one.name for one in (*module.functions, *module.global_variables)
                        if one.is_declaration and not one.name.startswith("llvm.")))


def _without_machine_code() -> None:
    """Let numba stop at optimised LLVM code, and keep none of it in the cache."""
    context = registry.cpu_target.target_context
    context.refresh()
    context.codegen()._add_module = lambda module: None
    context.get_executable = lambda library, about, environment: [].append  # any builtin, unlike
    Cached.kept = False
