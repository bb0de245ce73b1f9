"""Kinds by name: tasks, resolvers, robots, plants, sensors, signals, metrics and figures.

What the package ships registers itself here too. A plugin is a module that registers what it adds
when it is imported:

    from hierarchy.plugins import register

    @register("tasks", "elbow")
    class Elbow(Task): ...

Which modules are imported is the user's decision, never that of a file. A module is allowed by
`allow` (on the command line `--plugin MODULE`), or by an entry point of an installed package in the
group `task_hierarchy.tasks`, or another of `GROUPS`. A file may say with
`plugins = ["my_module"]` what it needs; `require` refuses it where that is not allowed.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args

from hierarchy.errors import HierarchyError, check_name, expect, naming, of_user, refuse, text

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Group = Literal["tasks", "resolvers", "robots", "plants", "sensors", "signals", "metrics",
                "figures"]
GROUPS: tuple[Group, ...] = get_args(Group)
_MADE = ("tasks", "resolvers", "plants", "sensors", "metrics")  # of settings, by a call
_PREFIX = "task_hierarchy"
_Thing = TypeVar("_Thing")

_shipped: dict[str, dict[str, Any]] = {group: {} for group in GROUPS}
_registered: dict[str, dict[str, Any]] = {group: {} for group in GROUPS}
_loaded: dict[str, None] = {}   # names of the modules that were allowed, by whatever rule
_flagged: dict[str, None] = {}  # those of `allow`


def register(group: Group, name: str, *, shipped: bool = False) -> Callable[[_Thing], _Thing]:
    """Return a decorator that makes a thing available under a name.

    `shipped` is for what this package brings. Raises UnknownNameError for an unknown group,
    HierarchyError if the name is no text or taken, or the thing is not of the group's kind.
    """
    check_name("group", group, GROUPS)
    text(f"{group}: name", name)

    def keep(thing: _Thing) -> _Thing:
        before = _shipped[group].get(name, _registered[group].get(name, thing))
        refuse(thing is None, f"{group}: {name!r} is None")
        refuse(group in _MADE and not callable(thing),
               f"{group}: {name!r} is {thing!r:.80}; register a class or a function")
        refuse(_origin(before) != _origin(thing),  # a module may be imported again
               f"{group}: {name!r} is already {_origin(before)[:80]}")
        (_shipped if shipped else _registered)[group][name] = thing
        return thing

    return keep


def own(group: Group) -> dict[str, Any]:
    """Return what plugins register in a group by name, and what installed packages offer in it."""
    check_name("group", group, GROUPS)
    for point in _points(group):
        _load(point, group)
    return dict(_registered[group])


def registered(group: Group) -> dict[str, Any]:
    """Return what is registered in a group so far, without loading what packages offer in it."""
    check_name("group", group, GROUPS)
    return {**_shipped[group], **_registered[group]}


def known(group: Group) -> dict[str, Any]:
    """Return all of a group by name: what this package brings, then what plugins do."""
    return {**registered(group), **own(group)}


def find(group: Group, name: str) -> Any | None:
    """Return what has a name in a group, or None; loads an entry point of that name."""
    expect("plugins.find: name", name, str, "give a name")
    if name not in registered(group):
        for point in _points(group):
            if point.name == name:
                _load(point, group)
    return registered(group).get(name)


def allow(module: str) -> None:
    """Import a plugin, also from the working directory: the user says that it may run.

    Raises HierarchyError with the cause if it cannot be imported.
    """
    refuse(module.endswith(".py") or not all(map(str.isidentifier, module.split("."))),
           f"plugin {module!r}: give the name of a module, such as my_module for my_module.py")
    path = list(sys.path)
    sys.path.append(str(Path.cwd()))  # at the end, where it hides no installed module
    try:
        _import(module, f"plugin {module!r}")
    finally:
        sys.path[:] = path
    _loaded.setdefault(module)
    _flagged.setdefault(module)


def allowed() -> tuple[str, ...]:
    """Return the modules of `allow`, in its order."""
    return tuple(_flagged)


def loaded() -> tuple[str, ...]:
    """Return all plugins that this process uses, which its workers need too."""
    return tuple(_loaded)


def require(modules: Iterable[str]) -> None:
    """Make sure that the plugins which a file names may run, and import them.

    Raises HierarchyError with the remedy for one that was not allowed. One that this process has
    imported already is allowed, since nothing is loaded for it.
    """
    for module in modules:
        if module not in _loaded and module not in sys.modules:
            if not any(point.module == module for group in GROUPS for point in _points(group)):
                raise HierarchyError(
                    f"plugin {module!r} is not allowed: a file alone loads no code. If you trust "
                    f"it, add --plugin {module} to the command (in Python: import {module}), or "
                    f"install a package with an entry point {_PREFIX}.* into it")
            _import(module, f"plugin {module!r}")
        _loaded.setdefault(module)


def fingerprint() -> str:
    """Return a digest of the source of the plugins loaded so far, "" without plugins."""
    if not _loaded:
        return ""
    found = hashlib.sha256()
    for module in sorted(_loaded):
        if file := getattr(sys.modules[module], "__file__", None):
            path = Path(file)
            package = path.name == "__init__.py"
            for source in sorted(path.parent.rglob("*.py")) if package else [path]:
                found.update(source.name.encode() + source.read_bytes())
    return found.hexdigest()[:16]


def _load(point: EntryPoint, group: Group) -> None:
    what = f"entry point {point.name!r} of {_PREFIX}.{group}"
    _import(point.module, what)
    if point.name not in _registered[group]:  # unless the module registers it itself
        with naming(what, of=AttributeError):
            register(group, point.name)(point.load())
    _loaded.setdefault(point.module)


@cache
def _points(group: Group) -> tuple[EntryPoint, ...]:
    from importlib.metadata import entry_points

    return tuple(entry_points(group=f"{_PREFIX}.{group}"))


def _import(module: str, what: str) -> None:
    with of_user(f"{what} cannot be imported"):
        import_module(module)


def _origin(thing: Any) -> str:
    seen = re.sub(" at 0x[0-9a-f]+", "", repr(thing))  # of a function that it holds
    return f"{getattr(thing, '__module__', '')}.{getattr(thing, '__qualname__', seen)}"
