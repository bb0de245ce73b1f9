"""Read a scenario by name or file, with what it extends and with changes; groups of scenarios."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError, check_name, file_path
from hierarchy.robots.names import in_package
from scenarios.config.changes import change_all, lay_over, parse_changes
from scenarios.config.files import LIBRARY, make_absolute
from scenarios.config.scenario import Scenario
from scenarios.config.sections import ScenarioError, Section, naming
from scenarios.config.sections.avoidance import as_table
from scenarios.config.validation import validated
from scenarios.files import scenarios_in
from scenarios.toml_text import read_toml

GROUPS = LIBRARY / "groups"
WANTED = "A scenario is a name of `hierarchy list`, or a .toml file."
_ROBOTS = (".urdf", ".xml", ".mjcf", ".xacro", ".sdf")
_DEEPEST = 50  # files that may extend each other


class Source(NamedTuple):
    """A scenario in a file: the file's own, or one of its `[variants]`."""

    path: Path
    variant: str = ""

    def __str__(self) -> str:
        name = f"{self.path.stem}-{self.variant}" if self.variant else self.path.stem
        if self.path.parent == LIBRARY:
            return f"scenario {name!r}"
        return f"{self.path}:{self.variant}" if self.variant else str(self.path)


@cache
def _library() -> dict[str, Source]:
    """Return the shipped scenarios by name: FILE, and FILE-VARIANT of each variant in it."""
    return {name: Source(*place) for name, place in scenarios_in(LIBRARY).items()}


def shipped() -> tuple[str, ...]:
    """Return the names of the scenarios shipped with the package."""
    return tuple(_library())


def is_shipped(name: str) -> bool:
    """Whether a scenario of this name is shipped; a variant is FILE:VARIANT or FILE-VARIANT."""
    return name.replace(":", "-", 1) in _library()


def load(name_or_path: str | Path, changes: Sequence[str] | Mapping[str, Any] = ()) -> Scenario:
    """Read a shipped scenario by name, or a scenario file by path, and apply changes to it.

    A file with `extends = "ellipse"` (a shipped name or a relative path) contains only the
    differences. A table `[variants.wide]` in ellipse.toml is such a file by itself, over the
    scenario of its own file unless it `extends` another, or none with `extends = false`; its name
    is "ellipse:wide" or "ellipse-wide", in a file of your own FILE.toml:wide. Nothing is taken over
    of a section of another kind, nor of those named in `replaces = ["avoidance"]`, and a
    `[variation]` replaces the other one. `changes` are "dotted.key=value" texts with TOML values,
    or a mapping of dotted keys, see scenarios.config.changes. Raises ScenarioError, naming the file
    and the key, and UnknownNameError for an unknown name.
    """
    source = _found(str(file_path("load", name_or_path)))
    path, what = source.path, str(source)
    data = _read_extended(source)
    if "samples" in data:
        raise ScenarioError(f"{what} is a sweep, to be run by `hierarchy sweep {path}`")
    if not isinstance(changes, Mapping):
        changes = parse_changes(changes, what="--set")
    _list_points_as_tables(data)
    change_all(data, changes, Scenario)
    make_absolute(data, Path())
    _require_plugins(data, what)
    return validated(Scenario, data, what)


def _require_plugins(data: dict[str, Any], what: str) -> None:
    """Check the plugins of a file before its sections, and add those that the user named."""
    asked = data.get("plugins", [])
    if not isinstance(asked, list) or not all(isinstance(module, str) for module in asked):
        raise ScenarioError(f"{what}: plugins: expected a list of modules, got {asked!r}")
    with naming(what):
        plugins.require(asked)
    if named := [*asked, *plugins.allowed()]:  # a run says what it needs
        data["plugins"] = list(dict.fromkeys(named))


def _found(name: str, here: Path = Path()) -> Source:
    """Return where a scenario is, by its name or its file in the folder `here`."""
    file, colon, variant = name.rpartition(".toml:")
    if colon:
        return Source(here / f"{file}.toml", variant)
    if Path(name).suffix == ".toml":
        return Source(here / name)
    if is_shipped(name):
        return _library()[name.replace(":", "-", 1)]
    raise no_scenario(name)


def _read(source: Source) -> dict[str, Any]:
    """Read one scenario of a file, without what it extends."""
    data = read_toml(source.path, "scenario file", ScenarioError)
    variants = data.pop("variants", {})
    if not isinstance(variants, dict) or not all(isinstance(v, dict) for v in variants.values()):
        raise ScenarioError(f"{source.path}: variants: expected a table of tables")
    if source.variant:
        with naming(str(source.path)):
            check_name("variant", source.variant, variants)
        data = {"name": f"{source.path.stem}-{source.variant}", "extends": Source(source.path),
                **variants[source.variant]}
    make_absolute(data, source.path.parent.resolve())
    return data


def _read_extended(source: Source, below: tuple[Source, ...] = ()) -> dict[str, Any]:
    """Read a scenario, merged over the scenario or file that its `extends` names."""
    data, path = _read(source), source.path
    base, replaced = data.pop("extends", None), data.pop("replaces", None)
    if base is None or (base is False and source.variant):
        if replaced is not None:
            raise ScenarioError(f"{path}: replaces: goes with extends")
        return data
    if not isinstance(base, str | Source):
        raise ScenarioError(f"{path}: extends: expected a name or a path, got {base!r}")
    with naming(f"{path}: extends"):
        under = base if isinstance(base, Source) else _found(base, path.parent)
    here = (*below, Source(path.resolve(), source.variant))
    if Source(under.path.resolve(), under.variant) in here:
        raise ScenarioError(f"{path}: extends: {base!r} extends this file in turn")
    if len(below) >= _DEEPEST:
        raise ScenarioError(f"{path}: extends: more than {_DEEPEST} files, one over the other")
    found, replaced = _read_extended(under, here), replaced or []
    if not isinstance(replaced, list):
        raise ScenarioError(f"{path}: replaces: expected a list of sections, got {replaced!r}")
    with naming(f"{path}: replaces"):
        for section in replaced:
            check_name("section", section, found)
    lay_over(found, data, Scenario, replaced)
    return found


def _list_points_as_tables(data: dict[str, Any]) -> None:
    """Write obstacles given as [x, y, z] as tables, so that changes find their keys."""
    section = data.get("avoidance")
    if isinstance(section, dict) and isinstance(section.get("obstacles"), list):
        section["obstacles"] = [as_table(obstacle) for obstacle in section["obstacles"]]


class Group(Section):
    """The scenarios of a group, in the order in which they are compared."""

    title: str  #: What the scenarios have in common, for lists.
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]  #: Names of shipped scenarios.


def shipped_groups() -> tuple[str, ...]:
    """Return the names of the groups shipped with the package."""
    return tuple(sorted(path.stem for path in GROUPS.glob("*.toml")))


def load_group(name: str) -> Group:
    """Read a shipped group; raises ScenarioError, naming the file and the key."""
    path = GROUPS / f"{name}.toml"
    return validated(Group, read_toml(path, "group file", ScenarioError), f"group {name!r}")


def members(asked: Iterable[Any]) -> list[Any]:
    """Return what was asked for, each name of a group replaced by its scenarios."""
    return [one for some in asked
            for one in (load_group(some).scenarios if some in shipped_groups() else (some,))]


def no_scenario(text: str) -> HierarchyError:
    """Return the error of a text that names no scenario: what it names instead, or the nearest."""
    found = _something_else(Path(text)) or _other_name(text)
    return ScenarioError(f"{text!r} is {found}") if found else UnknownNameError(
        "scenario", text, shipped(), WANTED)


def _something_else(path: Path) -> str:
    """Return what a file or folder is, and what to do with it; "" if there is none."""
    if (path / "run.npz").is_file():
        return (f"a folder of a finished run: `hierarchy view {path}` shows it, and `hierarchy run "
                f"{path / 'scenario.toml'}` runs it again")
    if path.is_dir():
        files = sorted(path.glob("*.toml"))
        return (f"a folder with {', '.join(map(str, files[:5]))}: give one of them" if files
                else f"a folder. {WANTED}")
    if path.suffix.lower() in _ROBOTS or in_package(str(path)):
        return (f"a robot, not a scenario. `hierarchy check {path}` shows it, with its [robot] "
                f"section for a scenario file. {WANTED}")
    if path.suffix == ".py":
        return (f"a program, to be run by `python {path}`; a module of kinds of your own goes "
                f"with --plugin {path.stem}. {WANTED}")
    return f"a file of another kind than .toml. {WANTED}" if path.is_file() else ""


def _other_name(name: str) -> str:
    """Return what a name of something else than a scenario is for; "" if it is unknown."""
    from hierarchy.robots import TABLES
    from solvers import names, variants

    if name in shipped_groups():
        return (f"a group of scenarios, to be run by `hierarchy compare {name}`; its scenarios are "
                f"{', '.join(load_group(name).scenarios)}")
    if (LIBRARY / "sweeps" / f"{name}.toml").is_file():
        return f"a sweep, to be run by `hierarchy sweep {name}`. {WANTED}"
    if name in TABLES or name in plugins.registered("robots"):
        return f"a robot, the `robot.model` of a scenario. {WANTED}"
    if name in (*names(), *variants()):
        return f"a resolver, as in `hierarchy run ellipse --resolver {name}`. {WANTED}"
    if name in plugins.registered("tasks"):
        return f"a kind of task, for the [[tasks]] of a scenario file. {WANTED}"
    return ""
