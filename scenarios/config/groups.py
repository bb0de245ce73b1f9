"""Groups: shipped scenarios that are compared together, each under its own resolver."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from scenarios.config.errors import ScenarioError
from scenarios.config.sections import Section
from scenarios.config.validation import validated
from scenarios.toml_text import read_toml

LIBRARY = Path(__file__).parents[1] / "library" / "groups"


class Group(Section):
    """The scenarios of a group, in the order in which they are compared."""

    title: str
    """What the scenarios have in common, for lists."""
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]
    """Names of shipped scenarios."""


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
