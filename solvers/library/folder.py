"""The folder of the C library: static and shared library, headers, and what build tools read.

The functions become an object file through LLVM; no compiler is needed. Their LLVM code was made
with the kernels of Python when the package was built; if not, numba makes it now. Another target
gets the same code through its own back end, which splits vectors that are too wide for it.
"""

import platform
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import distribution, version
from importlib.resources import files
from pathlib import Path
from typing import Any, final

from hierarchy.errors import HierarchyError, check_name

TARGETS = ("native", "x86_64", "aarch64")
RESOLVERS = ("hcod", "tpm", "recursive", "sns", "merged")
_TRIPLES = {"x86_64": "x86_64-unknown-linux-gnu", "aarch64": "aarch64-unknown-linux-gnu"}
_PACKAGE = "task-hierarchy"
_PLACES = {"task_hierarchy.h": "include", "task_hierarchy.hpp": "include",
           "task_hierarchyConfig.cmake": "lib/cmake/task_hierarchy",
           "task_hierarchyConfigVersion.cmake": "lib/cmake/task_hierarchy",
           "task_hierarchy.pc": "lib/pkgconfig"}
_ARCHIVE, _SHARED = "lib/libtask_hierarchy.a", "lib/libtask_hierarchy.so"
_HEADER = "include/task_hierarchy.h"
_COMPILERS = ("cc", "gcc", "clang")
_MOST_FIXED = 100
_MAGIC = b"!<arch>\n"  # of a static library


_TEXT = """
@{name}_text = constant [{size} x i8] c"{text}\\00"
define ptr @{name}() {{
  ret ptr @{name}_text
}}
"""


def _emitted(resolvers: Sequence[str], target: str, fix: Sequence[int], texts: dict[str, str]
             ) -> tuple[bytes, tuple[str, ...], str]:
    """Return an object file, the names of the functions in it, and the machine that it is for.

    texts : what further functions return, by name.
    """
    import llvmlite.binding as llvm
    import numba

    from hierarchy.jit.linking import hide, object_code
    from solvers.library.entries import FUNCTIONS

    if numba.config.DISABLE_JIT:
        raise HierarchyError("kernels are not compiled: NUMBA_DISABLE_JIT is set")
    others = {f"th_solve_{name}" for name in set(RESOLVERS).difference(resolvers)}
    functions = {name: FUNCTIONS[name] for name in FUNCTIONS if name not in others}
    module, machine = _code(functions, target)
    if fix:
        _fix(module, fix)
    for name, text in texts.items():
        module.link_in(llvm.parse_assembly(_TEXT.format(name=name, text=text, size=len(text) + 1)))
    symbols = (*functions, *texts)
    hide(module, set(symbols))
    try:
        code = object_code(module, machine)
    except RuntimeError as error:
        raise HierarchyError(f"this llvmlite has no back end for {machine.triple}: {error}"
                             ) from error
    return code, symbols, f"{machine.triple}, {machine.processor}"


def _check(resolvers: Sequence[str], target: str, fix: Sequence[int]) -> None:
    """Raise a HierarchyError for a wrong name or size, or a machine without objects in ELF."""
    check_name("target", target, TARGETS)
    for name in resolvers:
        check_name("resolver of the C library", name, RESOLVERS)
    if not resolvers:
        raise HierarchyError("a C library needs at least one resolver")
    if fix and ("hcod" not in resolvers or len(fix) != 3 or not 1 <= fix[0] <= _MOST_FIXED
                or not 1 <= fix[2] <= fix[1] <= _MOST_FIXED):
        raise HierarchyError(f"{' '.join(map(str, fix))}: sizes to fix are unknowns, rows and "
                             f"levels of hcod, 1 to {_MOST_FIXED}, not more levels than rows")
    if not sys.platform.startswith("linux"):
        raise HierarchyError(f"the C library is made on Linux, not on {sys.platform}")


def digest() -> str:
    """Return the digest of the kernels' sources as they are installed."""
    from hierarchy.jit.sources import source_digest
    from solvers.library.entries import can_open

    return source_digest(can_open)[:16]


def _code(functions: dict[str, Any], target: str) -> tuple[Any, Any]:
    """Return an LLVM module with functions, made ahead or now, and the machine that it is for."""
    from hierarchy.jit import announce_compilation
    from hierarchy.jit.caching import PROCESSOR, Part, parts, suits
    from hierarchy.jit.exporting import lowered, stored
    from hierarchy.jit.linking import Machine, machine

    module = stored(Part.read("solvers"), functions)
    if module is None:
        announce_compilation()
        module = lowered(functions)
    if target != "native":
        return module, Machine(_TRIPLES[target], "generic", "")
    here = machine()
    as_python = parts() and suits()
    return module, Machine(here.triple, PROCESSOR, "") if as_python else here


def _fix(module: Any, sizes: Sequence[int]) -> None:
    """Let `th_solve_hcod` try the code for these sizes first."""
    import llvmlite.binding as llvm
    from llvmlite import ir

    from hierarchy.jit.exporting import lowered
    from hierarchy.jit.linking import merged
    from solvers.library.entries import OTHER, fixed

    name = "th_solve_hcod"
    module.link_in(merged(lowered({"th_fixed": fixed(*sizes)}), "th_fixed"))
    module.get_function(name).name = "th_any"
    chosen, number = ir.Module("fixed"), ir.IntType(32)
    kind = ir.FunctionType(number, [ir.IntType(64)] * 6)
    first, second, both = (ir.Function(chosen, kind, one) for one in ("th_fixed", "th_any", name))
    builder = ir.IRBuilder(both.append_basic_block())
    code = builder.call(first, both.args)
    with builder.if_then(builder.icmp_signed("==", code, ir.Constant(number, OTHER))):
        builder.ret(builder.call(second, both.args))
    builder.ret(code)
    module.link_in(llvm.parse_assembly(str(chosen)))


@final
@dataclass(frozen=True)
class Written:
    """What was written.

    files : paths in the folder. machine : what the code is for. shared : why there is no shared
    library; empty where there is one.
    """

    files: tuple[str, ...]
    machine: str
    digest: str
    shared: str


def write(folder: Path, resolvers: Sequence[str] = RESOLVERS, target: str = "native",
          fix: Sequence[int] = ()) -> Written:
    """Write the library into a folder that exists.

    fix : sizes (n, m, levels) for which `hcod` has code of its own, see `fixed`.

    Raises HierarchyError: an unknown or missing resolver or target, kernels are not compiled, or
    this LLVM or this machine cannot make code for the target.
    """
    from solvers.library.entries import DEFAULTS

    _check(resolvers, target, fix)
    number, kernels = version(_PACKAGE), digest()
    code, symbols, machine = _emitted(
        resolvers, target, fix, {"th_version": number, "th_digest": kernels})
    values = {"VERSION": number, "DIGEST": kernels, "MACHINE": machine, "DEFAULTS": ", ".join(
        str(value).replace("inf", "INFINITY") for value in DEFAULTS)}
    texts = {f"{place}/{name}": _filled(name, values, resolvers)
             for name, place in _PLACES.items()}
    licence = distribution(_PACKAGE).read_text("licenses/LICENSE")  # None in a checkout
    texts["share/doc/task_hierarchy/LICENSE"] = licence or (
        Path(__file__).parents[2] / "LICENSE").read_text(encoding="utf-8")
    for name, text in texts.items():
        _room_for(folder / name).write_text(text, encoding="utf-8")
    _room_for(folder / _ARCHIVE).write_bytes(_archive("kernels.o", code, symbols))
    why = _link(folder, target)
    names = (*texts, _ARCHIVE, *([] if why else [_SHARED]))
    return Written(tuple(sorted(names)), machine, kernels, why)


def differs(folder: Path) -> str:
    """Return how the library in a folder differs from the installed kernels; empty if it does not.

    Raises HierarchyError if the folder holds no library.
    """
    header, code = folder / _HEADER, folder / _ARCHIVE
    for file in (header, code):
        if not file.is_file():
            raise HierarchyError(f"no C library in {folder}: {file.name} is missing")
    found = re.search(rb'#define TH_DIGEST "(\w+)"', header.read_bytes())
    stated, installed = found.group(1).decode() if found else "nothing", digest()
    if f"{stated}\0".encode() not in code.read_bytes():
        return f"{header.name} has the digest {stated}, and {code.name} another"
    if stated != installed:
        return f"made of kernels with the digest {stated}; those installed have {installed}"
    return ""


def _room_for(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    return file


def _filled(name: str, values: dict[str, str], resolvers: Sequence[str]) -> str:
    """Return a template with its sections and values."""
    text = (files("solvers.library") / "templates" / name).read_text(encoding="utf-8")
    text = re.sub(r"^@if (\w+)\n(.*?)^@end\n", lambda part: part[2] * (part[1] in resolvers), text,
                  flags=re.DOTALL | re.MULTILINE)
    return re.sub(f"@({'|'.join(values)})@", lambda mark: values[mark[1]], text)


def _link(folder: Path, target: str) -> str:
    """Make a shared library of the static one; return why not, empty if it was made."""
    names = _COMPILERS if target in ("native", platform.machine()) else (f"{target}-linux-gnu-gcc",)
    compiler = next(filter(None, map(shutil.which, names)), None)
    if compiler is None:
        return f"no linker: none of {', '.join(names)} is found"
    done = subprocess.run(
        [compiler, "-shared", "-o", folder / _SHARED, "-Wl,-soname,libtask_hierarchy.so",
         "-Wl,--whole-archive", folder / _ARCHIVE, "-Wl,--no-whole-archive", "-lm"],
        check=False, capture_output=True, text=True)
    lines = done.stderr.strip().splitlines()
    return "" if done.returncode == 0 else f"{compiler} failed: {lines[-1] if lines else ''}"


def _archive(name: str, content: bytes, symbols: Sequence[str]) -> bytes:
    """Return a static library of one object, in which a linker finds these symbols.

    Its format is that of `ar` with a symbol table, as GNU and LLVM tools read it. The same object
    gives the same bytes: no time, no owner. name : at most 15 characters.
    """
    table = "".join(f"{symbol}\0" for symbol in symbols).encode()
    index_size = 4 + 4 * len(symbols) + len(table)
    at = len(_MAGIC) + 60 + index_size + index_size % 2
    index = struct.pack(f">{1 + len(symbols)}I", len(symbols), *[at] * len(symbols)) + table
    return _MAGIC + _member("/", index) + _member(f"{name}/", content)


def _member(name: str, content: bytes) -> bytes:
    """Return a member with its header of 60 bytes; the next one starts at an even offset."""
    header = f"{name:16}{0:<12}{0:<6}{0:<6}{'100644':8}{len(content):<10}`\n"
    return header.encode() + content + b"\n" * (len(content) % 2)
