"""Sections of own kinds: their keys are the parameters of what a plugin registered.

A task of `[[tasks]]`, [plant] and [sensor] may have a kind that the package lacks. Its maker is the
class or function that a plugin registered under that name. The parameters of the maker are the keys
of the section, except for those that the scenario provides (`GIVEN`). A parameter annotated `Frame`
is the name of a frame in the file, one annotated `Path` a table as in `position.path`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.plugins import Group
from scenarios.config.errors import ScenarioError
from scenarios.config.paths import PathSection
from scenarios.config.sections import Finite, Flag, Section, Whole

if TYPE_CHECKING:
    from hierarchy import Robot

GIVEN: dict[Group, tuple[str, ...]] = {
    "tasks": ("robot", "state", "name", "kind"),
    "plants": ("robot", "q", "v", "period", "level", "obstacles"),
    "sensors": ("robot", "exact", "body", "tip")}
Maker = Callable[..., Any]


class PartSection(Section):
    """A section of [plant] or [sensor]; `made_by`, "module:name", makes the part.

    Reading a file loads no robot, so that its maker stands here by name.
    """

    made_by: ClassVar[str]
    kind: str

    def made(self, robot: Robot, **given: Any) -> Any:
        """Call the maker with those of this `section`, `robot` and `given` that it takes."""
        maker = resolve_name(self.made_by)
        return maker(**_taken(maker, {"section": self, "robot": robot, **given}))


class OwnSection(PartSection):
    """A section whose kind and keys are those of a plugin."""

    model_config = ConfigDict(extra="allow")
    group: ClassVar[Group]

    @model_validator(mode="after")
    def _fits_its_maker(self) -> Self:
        self.settings()
        return self

    @property
    def maker(self) -> Maker:
        """What the plugin registered under this kind."""
        found = plugins.find(self.group, self.kind)
        assert found is not None, "the kind was found when the section was read"
        return cast(Maker, found)

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """Return annotation and value of each key; raises ValueError for a wrong one."""
        given = dict(self.model_extra or {})
        known = _parameters(self.maker, self.group)
        try:
            values = _model(known).model_validate(given)
        except ValidationError as error:
            raise ValueError(_said(self.kind, error.errors()[0], known)) from None
        return {key: (known[key].annotation, getattr(values, key)) for key in given}

    def made(self, robot: Robot, **given: Any) -> Any:
        """Call the maker with the keys and those of `given` that it has a parameter for.

        Raises ScenarioError, naming the kind, for whatever goes wrong in it: it is the user's code.
        """
        wanted = {name: value for name, value in {"robot": robot, **given}.items()
                  if name in GIVEN[self.group]}
        what = f"{self.group[:-1]} of kind {self.kind!r}"
        try:
            values = {key: _made(annotation, value, robot)
                      for key, (annotation, value) in self.settings().items()}
            return self.maker(**_taken(self.maker, wanted), **values)
        except HierarchyError as error:
            raise ScenarioError(f"{what}: {error}") from error
        except Exception as error:
            raise ScenarioError(f"{what}: {type(error).__name__}: {error}") from error


def _taken(maker: Maker, given: dict[str, Any]) -> dict[str, Any]:
    """Return what of some arguments a maker has parameters for."""
    known = inspect.signature(maker).parameters
    return {name: value for name, value in given.items() if name in known}


def _made(annotation: Any, value: Any, robot: Robot) -> Any:
    """Return the value of a key as the maker wants it: frames by name, paths by their table."""
    from hierarchy.paths import Path
    from hierarchy.robot import Frame

    kinds = (annotation, *get_args(annotation))
    if Frame in kinds and isinstance(value, str):
        return robot.frame(value)
    return value.make() if Path in kinds and value is not None else value


def _said(kind: str, error: Any, known: dict[str, inspect.Parameter]) -> str:
    key = ".".join(str(part) for part in error["loc"])
    if error["type"] == "extra_forbidden":
        return str(UnknownNameError(f"key of kind {kind!r}", key, known))
    value = "" if isinstance(error["input"], dict) else f", got {error['input']!r}"
    return f"{key}: {error['msg']}{value}"


def _parameters(maker: Maker, group: Group) -> dict[str, inspect.Parameter]:
    """Return the parameters of a maker that are keys, with annotations that are not text."""
    try:
        hints = get_type_hints(inspect.getattr_static(maker, "__init__")
                               if isinstance(maker, type) else maker)
    except NameError:  # a name that is imported for type checkers only
        hints = {}
    return {name: parameter.replace(annotation=hints.get(name, Any))
            for name, parameter in inspect.signature(maker).parameters.items()
            if name not in GIVEN[group] and parameter.kind not in (
                inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)}


def _model(parameters: dict[str, inspect.Parameter]) -> type[BaseModel]:
    fields: dict[str, Any] = {
        name: (_in_a_file(parameter.annotation),
               Field() if parameter.default is parameter.empty else Field(parameter.default))
        for name, parameter in parameters.items()}
    return create_model("Own", __config__=ConfigDict(
        extra="forbid", arbitrary_types_allowed=True, protected_namespaces=()), **fields)


def _in_a_file(annotation: Any) -> Any:
    """Return the type that the value of a parameter has in a file, with strict numbers."""
    from hierarchy.paths import Path
    from hierarchy.robot import Frame  # loads pinocchio, which reading a file does not need

    kinds: dict[Any, Any] = {Frame: str, Path: PathSection, float: Finite, int: Whole, bool: Flag}
    if isinstance(annotation, type) and annotation in kinds:
        return kinds[annotation]
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin in (tuple, list):
        return origin[tuple(part if part is ... else _in_a_file(part) for part in inside)]
    return annotation
