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
from hierarchy.jit.inside import global_compiler_lock
from hierarchy.jit.linking import Library, found, linked
from hierarchy.jit.sources import kinds_in, source_digest

ENVIRONMENT = {"NUMBA_CPU_NAME": PROCESSOR, "NUMBA_CPU_FEATURES": "",
               "NUMBA_DISABLE_INTEL_SVML": "1"}  # of a process that builds


@global_compiler_lock  # type: ignore[untyped-decorator]
def build(file: Path, of: str, calls: Sequence[str], say: Callable[[int], None]) -> None:
    """Write an object file with these calls, whose list has the digest `of`.

    calls : each `name(types)`, as `described` writes types. say : takes the number compiled.
    """
    Library.running = Cached.kept = False
    libraries: list[Any] = []
    entries: dict[str, Entry] = {}
    for count, call in enumerate(calls):
        say(count)
        name, _, text = call.removesuffix(")").partition("(")
        kernel, kinds = found(name), kinds_in(text)
        kernel.compile(kinds)
        made = kernel.overloads[kinds]
        if (entry := _entry(made, source_digest(kernel))) is not None:
            libraries.append(made.library)
            entries[call] = entry
    whole = linked(libraries, {name for entry in entries.values()
                               for name in (entry.wrapper, entry.environment)})
    here = machine()
    code = object_code(whole, here.triple, here.processor, here.features)
    Part(file, of, entries, _externals(whole)).write(code)


def is_current(file: Path, of: str) -> bool:
    """Whether an object file was made of this list of calls from the sources as they are."""
    part = Part.read(file)
    return part is not None and part.calls == of and all(
        entry.digest == source_digest(found(call.partition("(")[0]))
        for call, entry in part.entries.items())


def _entry(made: Any, digest: str) -> Entry | None:
    """Return how to find a compiled call; None if its environment holds other than number types."""
    constants = made.environment.consts
    if not all(isinstance(one, np.dtype) and one.fields is None for one in constants):
        return None
    return Entry(digest, made.fndesc.llvm_cpython_wrapper_name, made.fndesc.env_name,
                 tuple(one.str for one in constants))


def _externals(module: Any) -> tuple[str, ...]:
    return tuple(sorted(one.name for one in (*module.functions, *module.global_variables)
                        if one.is_declaration and not one.name.startswith("llvm.")))
