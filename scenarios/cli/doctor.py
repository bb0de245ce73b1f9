"""`hierarchy doctor`: check versions, backends and kernels, and run a self-test."""

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires, version
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from packaging.requirements import Requirement

from scenarios.cli.terminal import print_json

_PACKAGE = "task-hierarchy"
_CORE = (None, "robots", "scenarios")  # extras without which there is no command
_MODULES = {"pin": "pinocchio", "pillow": "PIL"}  # that are not called as their package
_PROBLEMS = 20      # generated problems for the self-test
_MET = 1e-6         # largest difference between strict resolvers, relative to 1 + |x|


class Finding(NamedTuple):
    """The result of one check: `well` is None if it cannot fail, `remedy` says what to do."""

    part: str
    what: str
    found: str
    well: bool | None = None
    remedy: str = ""


def doctor_command(as_json: bool) -> int:
    """Print the findings and return the exit code: 0 without problems, otherwise 1."""
    found = list(examine())
    ill = [one.what for one in found if one.well is False]
    if as_json:
        print_json({"well": not ill, "findings": [one._asdict() for one in found]})
        return int(bool(ill))
    width = max(len(one.what) for one in found)
    for part, findings in groupby(found, attrgetter("part")):
        print(part)
        for one in findings:
            mark = {True: "ok  ", False: "BAD ", None: "    "}[one.well]
            print(f"  {mark}{one.what:{width}}  {one.found}" + f"; {one.remedy}" * bool(one.remedy))
    print(f"\nProblems: {', '.join(ill)}." if ill else "\nNo problems found.")
    return int(bool(ill))


def examine() -> Iterator[Finding]:
    """Run all checks."""
    for part in (_versions, _extras, _backends, _kernels, _tests):
        try:
            yield from part()
        except Exception as error:  # a broken installation may raise anything
            yield Finding("errors", part.__name__.strip("_"), f"{type(error).__name__}: {error}",
                          False)


def _versions() -> Iterator[Finding]:
    yield Finding("versions", "python", sys.version.split()[0], sys.version_info >= (3, 11))
    yield Finding("versions", _PACKAGE, version(_PACKAGE))
    for one, extra in _required():
        if extra in _CORE and one.name != _PACKAGE:
            yield _imported(one)


def _imported(one: Requirement) -> Finding:
    """Compare a package as it is imported with what is asked for; its metadata may be another's."""
    there = _version(one.name)
    if there is None:
        return Finding("versions", one.name, "missing", False, f"pip install {one.name}")
    module = import_module(_MODULES.get(one.name, one.name.replace("-", "_")))
    loaded = vars(module).get("__version__", there)  # one that is made when asked for warns
    if isinstance(loaded, str) and loaded != there:
        return Finding("versions", one.name, f"{loaded} in {module.__file__}, not the {there} that "
                       "is installed", False, "remove it from the path")
    asked = Requirement(str(one).partition(";")[0]).specifier
    return Finding("versions", one.name, there, well := asked.contains(there, prereleases=True),
                   "" if well else f"pip install '{one.name}{asked}'")


def _extras() -> Iterator[Finding]:
    extras: dict[str, list[str]] = {}
    for one, extra in _required():
        if extra not in (*_CORE, "dev") and not one.name.startswith(_PACKAGE):
            extras.setdefault(str(extra), []).append(one.name)
    for extra, packages in extras.items():
        there = [f"{package} {_version(package)}" for package in packages if _version(package)]
        yield Finding("extras (optional)", extra, ", ".join(there) or "not installed", None, "" if
                      len(there) == len(packages) else f"pip install '{_PACKAGE}[{extra}]'")


def _backends() -> Iterator[Finding]:
    from solvers.qp.backends import BACKENDS, installed

    for name in BACKENDS:
        yield Finding("backends of hqp", name, "found" if installed(name) else "not installed")


def _kernels() -> Iterator[Finding]:
    import numba

    from hierarchy.jit import cache_folder

    part, folder = "compiled kernels", cache_folder()
    jit = not numba.config.DISABLE_JIT
    yield Finding(part, "compiling", "on" if jit else "off: NUMBA_DISABLE_JIT is set", jit)
    if folder is None:
        yield Finding(part, "cache", "none: no home folder", None,
                      "set NUMBA_CACHE_DIR to a writable folder")
        return
    size = 0.0
    for file in folder.rglob("*"):
        with suppress(OSError):  # another process has just moved or removed it
            size += file.stat().st_size / 1e6
    can = os.access(next(path for path in (folder, *folder.parents) if path.exists()), os.W_OK)
    said = str(folder).replace(f"{Path.home()}/", "~/", 1)
    yield Finding(part, "cache", f"{said}, {size:.0f} MB", can,
                  "" if can else "not writable; set NUMBA_CACHE_DIR to a writable folder")


def _tests() -> Iterator[Finding]:
    for what, test in (("resolvers agree", _resolvers_agree), ("a short run", _short_run)):
        begun = perf_counter()
        try:
            said, well = test()
        except Exception as error:  # a broken installation may raise anything
            said, well = f"{type(error).__name__}: {error}", False
        yield Finding("self-test", what, f"{said} ({perf_counter() - begun:.1f} s)", well)


def _resolvers_agree() -> tuple[str, bool]:
    """Solve small well-posed stacks with three strict resolvers, and certify one's answers."""
    import numpy as np

    from hierarchy import Hierarchy
    from solvers import certify, make

    rng, worst, certified = np.random.default_rng(0), 0.0, 0
    strict = [make(name) for name in ("tpm", "recursive", "hcod")]
    for _ in range(_PROBLEMS):
        h = Hierarchy.from_levels([(rng.normal(size=(3, 7)), rng.normal(size=3))
                                   for _ in range(3)])
        x = [resolver.solve(h).x for resolver in strict]
        worst = max(worst, *(float(np.abs(x[0] - one).max() / (1 + np.abs(x[0]).max()))
                             for one in x[1:]))
        certified += certify(h, x[0]).certified
    return (f"{', '.join(str(one.label) for one in strict)} agree to {worst:.0e}; {certified} of "
            f"{_PROBLEMS} answers certified", worst < _MET and certified == _PROBLEMS)


def _short_run() -> tuple[str, bool]:
    """Simulate the first 0.2 s of the letter's task."""
    import numpy as np

    from scenarios import load, simulate

    run = simulate(load("ellipse", ["control.duration=0.2"]))
    median = float(np.median(run["time_tick"]) * 1e6)
    return f"{run.ticks} ticks of ellipse, median {median:.0f} µs", run.fault is None


def _required() -> Iterator[tuple[Requirement, str | None]]:
    """Yield every dependency, and the extra it belongs to (None for a required one)."""
    for line in requires(_PACKAGE) or ():
        one = Requirement(line)
        _, extra, name = str(one.marker or "").rpartition('extra == "')
        name = name.rstrip('"')
        if not one.marker or one.marker.evaluate({"extra": name}):
            yield one, name if extra else None


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
