"""The public names of `hierarchy`, `solvers` and `scenarios`, each imported when first used.

Other packages may have these three names too; importing this one says so if one has taken the place
of ours.
"""

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State, Task
    from scenarios import (
        Comparison,
        Recording,
        Scenario,
        compare,
        load,
        load_run,
        save,
        shipped,
        simulate,
    )
    from solvers import (
        Certificate,
        Resolution,
        Resolver,
        Status,
        certify,
        explain,
        make,
        names,
        solve_ik,
        variants,
    )

__all__ = [
    "Certificate", "Comparison", "Hierarchy", "HierarchyError", "Recording", "Resolution",
    "Resolver", "Robot", "Scenario", "Stack", "State", "Status", "Task", "certify", "compare",
    "explain", "load", "load_run", "make", "names", "save", "shipped", "simulate", "solve_ik",
    "variants"]

_PACKAGES = ("hierarchy", "solvers", "scenarios")
_INSIDE = Path(__file__).with_name("inside")  # where a wheel may have the three, see setup.py
_HOME = _INSIDE if _INSIDE.is_dir() else _INSIDE.parents[1]


def foreign() -> str | None:
    """Return whose file stands in for one of the three packages, in one line, or None."""
    for name in _PACKAGES:
        there = find_spec(name)
        if there is None or _file(there).resolve() != (_HOME / name / "__init__.py").resolve():
            whose = f"is {_file(there)}, not task-hierarchy's" if there else "is missing"
            return (f"the package {name!r} {whose}; remove what has the same name, and install "
                    "task-hierarchy again")
    return None


def _file(spec: ModuleSpec) -> Path:
    return Path(spec.origin or next(iter(spec.submodule_search_locations or ()), "unknown"))


def main() -> None:
    """Run the command `hierarchy`."""
    import_module("scenarios.cli.start").main()


def __getattr__(name: str) -> Any:
    if name in __all__:
        home = next(found for package in _PACKAGES
                    if name in (found := import_module(package)).__all__)
        value = globals()[name] = getattr(home, name)
        return value
    if name in _PACKAGES:
        return import_module(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name[:2] == "__"), *__all__})


if _INSIDE.is_dir():
    sys.path.insert(0, str(_INSIDE))
if _wrong := foreign():
    if Path(sys.argv[0]).stem == "hierarchy":  # the command, which imports its entry from here
        sys.exit(f"hierarchy: error: {_wrong}")
    raise ImportError(_wrong)
