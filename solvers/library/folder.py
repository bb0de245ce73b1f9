"""The folder of the C library: static and shared library, headers, and what build tools read."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import distribution, version
from importlib.resources import files
from pathlib import Path
from typing import final

from hierarchy.errors import HierarchyError
from solvers.library.emission import RESOLVERS, Emitted, digest, emitted

_PACKAGE = "task-hierarchy"
_PLACES = {"task_hierarchy.h": "include", "task_hierarchy.hpp": "include",
           "task_hierarchyConfig.cmake": "lib/cmake/task_hierarchy",
           "task_hierarchyConfigVersion.cmake": "lib/cmake/task_hierarchy",
           "task_hierarchy.pc": "lib/pkgconfig"}
_ARCHIVE, _SHARED = "lib/libtask_hierarchy.a", "lib/libtask_hierarchy.so"
_HEADER = "include/task_hierarchy.h"
_COMPILERS = ("cc", "gcc", "clang")
_MAGIC = b"!<arch>\n"  # of a static library


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


def write(folder: Path, resolvers: Sequence[str] = RESOLVERS, target: str = "native") -> Written:
    """Write the library into a folder that exists; see `emitted` for what is raised."""
    made = emitted(resolvers, target, version(_PACKAGE))
    texts = {f"{place}/{name}": _filled(name, made, resolvers) for name, place in _PLACES.items()}
    texts["share/doc/task_hierarchy/LICENSE"] = _license()
    for name, text in texts.items():
        _room_for(folder / name).write_text(text, encoding="utf-8")
    content = archive("kernels.o", made.content, made.symbols)
    _room_for(folder / _ARCHIVE).write_bytes(content)
    why = _link(folder, target)
    names = (*texts, _ARCHIVE, *([] if why else [_SHARED]))
    return Written(tuple(sorted(names)), made.machine, made.digest, why)


def differs(folder: Path) -> str:
    """Return how the library in a folder differs from the installed kernels; empty if it does not.

    Raises HierarchyError if the folder holds no library.
    """
    header, code = folder / _HEADER, folder / _ARCHIVE
    for file in (header, code):
        if not file.is_file():
            raise HierarchyError(f"no C library in {folder}: {file.name} is missing")
    found = re.search(r'#define TH_DIGEST "(\w+)"', header.read_text(encoding="utf-8"))
    stated, installed = found.group(1) if found else "nothing", digest()
    if f"{stated}\0".encode() not in code.read_bytes():
        return f"{header.name} has the digest {stated}, and {code.name} another"
    if stated != installed:
        return f"made of kernels with the digest {stated}; those installed have {installed}"
    return ""


def _room_for(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    return file


def _filled(name: str, made: Emitted, resolvers: Sequence[str]) -> str:
    """Return a template with its sections and values."""
    text = (files("solvers.library") / "templates" / name).read_text(encoding="utf-8")
    text = re.sub(r"^@if (\w+)\n(.*?)^@end\n", lambda part: part[2] * (part[1] in resolvers), text,
                  flags=re.DOTALL | re.MULTILINE)
    for mark, value in (("VERSION", version(_PACKAGE)), ("DIGEST", made.digest),
                        ("MACHINE", made.machine), ("DEFAULTS", _defaults())):
        text = text.replace(f"@{mark}@", value)
    return text


def _defaults() -> str:
    """Return the default settings as an initializer of C."""
    from solvers.library.calls import DEFAULTS

    return ", ".join(str(value).replace("inf", "INFINITY") for value in DEFAULTS)


def _license() -> str:
    """Return the text of the licence, from the installed package or from a checkout."""
    found = distribution(_PACKAGE).read_text("licenses/LICENSE")
    return found or (Path(__file__).parents[2] / "LICENSE").read_text(encoding="utf-8")


def _link(folder: Path, target: str) -> str:
    """Make a shared library of the static one; return why not, empty if it was made."""
    if target == "aarch64":
        return "only the linker of this machine is used, and the code is for aarch64"
    compiler = next(filter(None, map(shutil.which, _COMPILERS)), None)
    if compiler is None:
        return f"no linker: none of {', '.join(_COMPILERS)} is found"
    done = subprocess.run(
        [compiler, "-shared", "-o", folder / _SHARED, "-Wl,-soname,libtask_hierarchy.so",
         "-Wl,--whole-archive", folder / _ARCHIVE, "-Wl,--no-whole-archive", "-lm"],
        check=False, capture_output=True, text=True)
    lines = done.stderr.strip().splitlines()
    return "" if done.returncode == 0 else f"{compiler} failed: {lines[-1] if lines else ''}"


def archive(name: str, content: bytes, symbols: Sequence[str]) -> bytes:
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
