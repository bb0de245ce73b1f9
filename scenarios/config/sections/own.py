"""Sections that make a part; of plug-in kinds, whose keys are the parameters of what makes it.

A task of `[[tasks]]`, [plant] and [sensor] may have a kind that the package lacks. Its maker is the
class or function that a plugin registered under that name. The parameters of the maker are the keys
of the section, except for those that the scenario provides (`GIVEN`). A parameter annotated `Frame`
is the name of a frame in the file, one annotated `Path` a table as in `position.path`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pkgutil import resolve_name
from types import UnionType
from typing import TYPE_CHECKING, Any, ClassVar, Self, Union, get_args, get_origin, get_type_hints

from pydantic import ConfigDict, Field, create_model

from hierarchy import plugins
from hierarchy.errors import of_user
from hierarchy.paths import Path
from hierarchy.plugins import Group
from scenarios.config.sections import Finite, Flag, ScenarioError, Section, Whole, naming
from scenarios.config.sections.paths import AnyPath, PathSection

if TYPE_CHECKING:
    from hierarchy import Robot

GIVEN: dict[Group, tuple[str, ...]] = {
    "tasks": ("robot", "state", "name"),
    "plants": ("robot", "q", "v", "period", "level", "obstacles"),
    "sensors": ("robot", "exact", "body", "tip")}
Maker = Callable[..., Any]
_KEY = "key_"  # in front of the names of fields


class PartSection(Section):
    """A section of a task, [plant] or [sensor]; `made_by`, "module:name", makes the part.

    Reading a file loads no robot, so that its maker stands here by name.
    """

    made_by: ClassVar[str]

    def made(self, robot: Robot, **given: Any) -> Any:
        """Call the maker with those of the keys, this `section`, `robot` and `given` it takes."""
        keys = {key: getattr(self, key) for key in type(self).model_fields if key != "kind"}
        return _called(resolve_name(self.made_by),
                       {"section": self, "robot": robot, **keys, **given})


class OwnSection(PartSection):
    """A section whose kind and keys are those of a plugin; `of` adds the keys.

    `unit` is that of a task's error and `rows` their kind, as the plugin's class says.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)
    group: ClassVar[Group]
    maker: ClassVar[Maker]
    unit: ClassVar[str] = ""
    rows: ClassVar[str] = "equality"
    kind: str  #: Which kind it is.

    @classmethod
    @cache
    def of(cls, maker: Maker) -> type[Self]:
        """Return the section of a plugin's kind: the keys of this one, and its own parameters.

        A key is the alias of a field, so that it may have any name. One that the file leaves out is
        left to the maker.
        """
        fields: dict[str, Any] = {
            f"{_KEY}{name}": (kind, Field(alias=name)) if parameter.default is parameter.empty
            else (kind | None, Field(None, alias=name, json_schema_extra={
                "default": parameter.default} if isinstance(
                    parameter.default, bool | int | float | str) else {}))
            for name, parameter in _parameters(maker).items()
            if name not in (*GIVEN[cls.group], *cls.model_fields)
            for kind in (_in_a_file(parameter.annotation),)}
        made = create_model(cls.__name__, __base__=cls, __doc__=maker.__doc__ or cls.__doc__,
                            **fields)
        unit = getattr(maker, "unit", "")  # a property, which only a task has, says none
        made.maker, made.unit = maker, unit if isinstance(unit, str) else ""
        made.rows = str(getattr(maker, "kind", "equality"))
        return made

    def __reduce__(self) -> Any:  # a class that was made has no module to be unpickled from
        return _again, (type(self).__mro__[1], self.kind, self.model_dump())

    def made(self, robot: Robot, **given: Any) -> Any:
        """Call the maker with the keys in the file and what it takes of the scenario.

        Raises ScenarioError, naming the kind, for whatever goes wrong in it: it is the user's code.
        """
        keys = {name.removeprefix(_KEY): value for name, value in self
                if name.startswith(_KEY) and value is not None}
        provided = {name: value for name, value in given.items() if name in GIVEN[self.group]}
        with of_user(f"{self.group[:-1]} of kind {self.kind!r}", ScenarioError):
            return _called(type(self).maker, {"robot": robot, **keys, **provided})


def _again(own: type[OwnSection], kind: str, data: dict[str, Any]) -> OwnSection:
    return own.of(plugins.find(own.group, kind)).model_validate(data)


def _called(maker: Maker, given: dict[str, Any]) -> Any:
    """Call a maker with those of `given` that it has parameters for."""
    return maker(**{name: _made(name, parameter.annotation, given[name], given["robot"])
                    for name, parameter in _parameters(maker).items() if name in given})


def _made(key: str, annotation: Any, value: Any, robot: Robot) -> Any:
    """Return the value of a key as the maker wants it: frames by name, paths by their table."""
    if type(value) in (list, tuple):
        return type(value)(_made(key, annotation, one, robot) for one in value)
    if isinstance(value, str) and _has_frame(annotation):
        with naming(key):
            return robot.frame(value)
    return value.make() if isinstance(value, AnyPath) else value


def _has_frame(annotation: Any) -> bool:
    from hierarchy.robot import Frame

    return annotation is Frame or any(map(_has_frame, get_args(annotation)))


def _parameters(maker: Maker) -> dict[str, inspect.Parameter]:
    """Return the parameters of a maker by name, with annotations that are not text."""
    hints: dict[str, Any] = {}
    for source in (maker, inspect.getattr_static(maker, "__init__", None)):
        with suppress(Exception):  # such as a name that only type checkers import: user's code
            hints |= get_type_hints(source)  # a dataclass knows the modules of its bases
    return {name: parameter.replace(annotation=hints.get(name, Any))
            for name, parameter in inspect.signature(maker).parameters.items()
            if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)}


def _in_a_file(annotation: Any) -> Any:
    """Return the type that the value of a parameter has in a file, with strict numbers."""
    from hierarchy.robot import Frame  # loads pinocchio, which reading a file does not need

    kinds: dict[Any, Any] = {Frame: str, Path: PathSection, float: Finite, int: Whole, bool: Flag}
    if isinstance(annotation, type) and annotation in kinds:
        return kinds[annotation]
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin in (tuple, list, dict, Union, UnionType):
        of = Union if origin is UnionType else origin
        return of[tuple(part if part is ... else _in_a_file(part) for part in inside)]
    return annotation
