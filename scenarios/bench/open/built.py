"""Entrants compiled here: soth and LexLS from checkouts that the user names, and our C library.

Nothing of others is in this project. A shim of ours is compiled with the user's compiler against
the user's copy, into the cache folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from hierarchy.errors import HierarchyError
from scenarios.bench.open.table import OWN, Row
from solvers.library import differs, write

_SHIMS = Path(__file__).parent / "entrants" / "shims"
_TIMED = _SHIMS / "timed.h"
_IN_C = "Answers in doubt are not certified."
_COMPILED = "scenarios.bench.open.entrants.compiled:Compiled"
_OPTIONS = ("-std=c++14", "-O3", "-march=native", "-DNDEBUG", "-fPIC", "-shared", "-w",
            "-fpermissive")
_EIGEN = ("/usr/include/eigen3", "/usr/local/include/eigen3", "/opt/homebrew/include/eigen3")
_LIMIT = 1800.0  # [s] for the compiler
_SOURCES = ("Allocator", "Algebra", "Bound", "BaseY", "HCOD", "Givens", "debug", "Stage",
            "BasicStage", "Random")  # of soth
_DEBUG = re.compile(r"^\s*#\s*define SOTH_(TEMPLATE_)?DEBUG.*$", re.MULTILINE)


class BuildError(HierarchyError):
    """A checkout without the expected files, or what the compiler said."""


def ours() -> list[Row]:
    """Write our C library and return its resolvers as entrants; raises BuildError."""
    folder = _cache("library")
    try:
        stale = differs(folder)
    except HierarchyError:
        stale = "not written yet"
    if stale:
        print("compiling our C library ...", file=sys.stderr, flush=True)
        write(folder)
    return rows_from(folder)


def rows_from(library: Path) -> list[Row]:
    """Compile entrants from the folder of our C library and return them; raises BuildError."""
    return [_own(library, "hcod"), _own(library, "tpm", equalities=True)]


def _own(library: Path, resolver: str, equalities: bool = False) -> Row:
    more = [f"-I{library / 'include'}", f"-DSOLVE=th_solve_{resolver}"]
    code = library / "lib" / "libtask_hierarchy.a"
    return Row(f"{resolver} in C", OWN, _COMPILED, _IN_C + equalities * " Asked equalities only.", {
        "library": str(_compiled(library, "ours", more, resolver, code)),
        "equalities": equalities, "name": f"{OWN.name} {version(OWN.name)}, C library"})


def rows_of(name: str, checkout: Path) -> list[Row]:
    """Compile a package from its checkout and return its entrants; raises BuildError."""
    return {"soth": _soth, "lexls": _lexls}[name](checkout)


def _soth(checkout: Path) -> list[Row]:
    _demand(checkout / "src" / "HCOD.cpp", "soth")
    folder = _folder("soth", checkout)
    sources = folder / "soth"
    sources.mkdir(parents=True, exist_ok=True)
    for file in sorted((checkout / "src").glob("*.?pp")):
        text = file.read_text(errors="replace")
        # As shipped, its sources switch traces on, which makes them a hundred times slower.
        (sources / file.name).write_text(text if file.name == "debug.hpp" else _DEBUG.sub("", text))
    own = [str(sources / f"{name}.cpp") for name in _SOURCES]
    library = _compiled(folder, "soth", [f"-I{folder}", *own])
    limits = "LGPL-3.0, compiled without its debug defines. Cycles now and then."
    return [_row("soth", checkout, library, limits)]


def _lexls(checkout: Path) -> list[Row]:
    _demand(checkout / "include" / "lexls" / "lexlsi.h", "LexLS")
    folder, include = _folder("lexls", checkout), f"-I{checkout / 'include'}"
    limits = "BSD-2-Clause. Absolute tolerances; the reference is one more level."
    return [_row("LexLS", checkout, _compiled(folder, "lexls", [include]), limits),
            _row("LexLS bounds", checkout,
                 _compiled(folder, "lexls", [include, "-DBOUNDS"], "bounds"),
                 f"{limits} Bounds in a first level are given as such."),
            _row("LexLSE", checkout, _compiled(folder, "lexlse", [include]),
                 "BSD-2-Clause. The kernel for equalities.", equalities=True)]


def _row(label: str, checkout: Path, library: Path, limits: str, equalities: bool = False) -> Row:
    return Row(label, OWN, _COMPILED, limits, {"library": str(library), "equalities": equalities,
                                               "name": f"{label} {_version(checkout)}"})


def _demand(file: Path, name: str) -> None:
    if not file.is_file():
        raise BuildError(f"no checkout of {name} there: {file} does not exist")


def _folder(name: str, checkout: Path) -> Path:
    mark = hashlib.sha256(str(checkout.resolve()).encode()).hexdigest()[:8]
    return _cache(f"{name}-{mark}")


def _cache(name: str) -> Path:
    root = Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser()
    folder = root / "task-hierarchy" / "open" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _compiled(folder: Path, shim: str, more: Sequence[str], variant: str = "",
              archive: Path | None = None) -> Path:
    """Return the shared library of a shim, compiled anew if its text or command has changed.

    archive : a static library that it is linked with, which counts as part of its text.
    """
    compiler = os.environ.get("CXX", "c++")
    source = _SHIMS / f"{shim}.cpp"
    command = [compiler, *_OPTIONS, *(f"-I{path}" for path in _EIGEN if Path(path).is_dir()), *more]
    text = b"".join([" ".join(command).encode(), source.read_bytes(), _TIMED.read_bytes(),
                     archive.read_bytes() if archive else b""])
    key = hashlib.sha256(text).hexdigest()[:8]
    library = folder / f"{shim}{variant}-{key}.so"
    if not library.is_file():
        if shutil.which(compiler) is None:
            raise BuildError(f"no C++ compiler {compiler!r}; install one, or name yours in CXX")
        print(f"compiling {shim}{variant and f' {variant}'} ...", file=sys.stderr, flush=True)
        partial = library.with_suffix(".partial")
        try:
            done = subprocess.run([*command, str(source), *([str(archive)] if archive else []),
                                   "-o", str(partial)],
                                  capture_output=True, text=True, timeout=_LIMIT, check=False)
        except subprocess.TimeoutExpired as error:
            raise BuildError(f"{shim} was not compiled within {_LIMIT:g} s") from error
        if done.returncode:
            said = [line for line in done.stderr.splitlines() if "error" in line]
            raise BuildError(f"{shim} could not be compiled: {(said or ['no message'])[0]}")
        partial.replace(library)
    return library


def _version(checkout: Path) -> str:
    """Return the commit of a checkout, or "of an unknown commit"."""
    done = subprocess.run(["git", "-C", str(checkout), "rev-parse", "--short=12", "HEAD"],
                          capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else "of an unknown commit"
