"""Groups of scenarios, and what was given in place of a scenario, with what to do with it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.robots.names import in_package
from scenarios.config.errors import ScenarioError
from scenarios.config.sections import Section
from scenarios.config.validation import validated
from scenarios.toml_text import read_toml

LIBRARY = Path(__file__).parents[1] / "library" / "groups"


class Group(Section):
    """The scenarios of a group, in the order in which they are compared."""

    title: str  #: What the scenarios have in common, for lists.
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]  #: Names of shipped scenarios.


def shipped_groups() -> tuple[str, ...]:
    """Return the names of the groups shipped with the package."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml")))


def load_group(name: str) -> Group:
    """Read a shipped group; raises ScenarioError, naming the file and the key."""
    path = LIBRARY / f"{name}.toml"
    return validated(Group, read_toml(path, "group file", ScenarioError), f"group {name!r}")


def members(asked: Iterable[Any]) -> list[Any]:
    """Return what was asked for, each name of a group replaced by its scenarios."""
    return [one for some in asked
            for one in (load_group(some).scenarios if some in shipped_groups() else (some,))]


WANTED = "A scenario is a name of `hierarchy list`, or a .toml file."
_SWEEPS = Path(__file__).parents[1] / "library" / "sweeps"
_ROBOTS = (".urdf", ".xml", ".mjcf", ".xacro", ".sdf")


def no_scenario(text: str, shipped: tuple[str, ...]) -> HierarchyError:
    """Return the error of a text that names no scenario: what it names instead, or the nearest."""
    found = _something_else(Path(text)) or _other_name(text)
    return ScenarioError(f"{text!r} is {found}") if found else UnknownNameError(
        "scenario", text, shipped, WANTED)


def _something_else(path: Path) -> str:
    """Return what a file or folder is, and what to do with it; "" if there is none."""
    if path.is_dir():
        return f"a folder{_of_folder(path)}"
    if path.suffix.lower() in _ROBOTS or in_package(str(path)):
        return (f"a robot, not a scenario. `hierarchy check {path}` shows it, with its [robot] "
                f"section for a scenario file. {WANTED}")
    if path.suffix == ".py":
        return (f"a program, to be run by `python {path}`; a module of kinds of your own goes "
                f"with --plugin {path.stem}. {WANTED}")
    return f"a file of another kind than .toml. {WANTED}" if path.is_file() else ""


def _of_folder(path: Path) -> str:
    if (path / "run.npz").is_file():
        return (f" of a finished run: `hierarchy view {path}` shows it, and `hierarchy run "
                f"{path / 'scenario.toml'}` runs it again")
    if files := sorted(path.glob("*.toml")):
        return f" with {', '.join(map(str, files[:5]))}: give one of them"
    return f". {WANTED}"


def _other_name(name: str) -> str:
    """Return what a name of something else than a scenario is for; "" if it is unknown."""
    from hierarchy.robots import TABLES
    from solvers import names, variants

    if name in shipped_groups():
        return (f"a group of scenarios, to be run by `hierarchy compare {name}`; its scenarios are "
                f"{', '.join(load_group(name).scenarios)}")
    if (_SWEEPS / f"{name}.toml").is_file():
        return f"a sweep, to be run by `hierarchy sweep {name}`. {WANTED}"
    if name in TABLES or name in plugins.registered("robots"):
        return f"a robot, the `robot.model` of a scenario. {WANTED}"
    if name in (*names(), *variants()):
        return f"a resolver, as in `hierarchy run ellipse --resolver {name}`. {WANTED}"
    if name in plugins.registered("tasks"):
        return f"a kind of task, for the [[tasks]] of a scenario file. {WANTED}"
    return ""
