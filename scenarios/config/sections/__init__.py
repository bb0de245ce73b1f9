"""Common parts of sections: numbers with bounds and units, what says a kind, and the error."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Self, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError, core_schema

from hierarchy import errors, plugins
from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.words import listed


class ScenarioError(HierarchyError):
    """An invalid scenario file or change; the message names the file and the key."""


naming = partial(errors.naming, error=ScenarioError)  # of a key or a file


@dataclass(frozen=True)
class Unit:
    """The unit of a key, for messages and for the page of keys.

    `doubted` says whether `check` asks if a value of an unusual size is in another unit.
    """

    name: str
    doubted: bool = True


def shared(units: Iterable[str]) -> str:
    """Return the unit that all of them are, "" where there are several."""
    found = {*units}
    return found.pop() if len(found) == 1 else ""


# Strict: true is not 1.0, and "5" is not 5. A whole number may be given for a float.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
Count = Annotated[int, Field(strict=True, ge=0)]
Number = Annotated[int, Field(strict=True, ge=1)]  # of a thing, from 1
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
JointPosition = Annotated[Finite, Unit("rad or m")]
JointVelocity = Annotated[Finite, Unit("rad/s or m/s")]
JointValue = JointPosition | tuple[JointPosition, ...]  # see hierarchy.Robot.configuration
Vector3 = tuple[Finite, Finite, Finite]
Rows3 = tuple[Vector3, Vector3, Vector3]
Coordinate = Annotated[Finite, Unit("m")]
Length = Annotated[Positive, Unit("m")]
Distance = Annotated[NotNegative, Unit("m")]
Span = Annotated[Positive, Unit("s")]
Time = Annotated[NotNegative, Unit("s")]
Rate = Annotated[Positive, Unit("1/s")]
Speed = Annotated[NotNegative, Unit("m/s")]
Frequency = Annotated[Positive, Unit("Hz")]
Angle = Annotated[Finite, Unit("rad")]
Arc = Annotated[NotNegative, Unit("rad")]
PositiveAngle = Annotated[Positive, Unit("rad")]
AngularRate = Annotated[Finite, Unit("rad/s")]
Gain = Annotated[NotNegative, Unit("1/s")]
Stiffness = Annotated[NotNegative, Unit("1/s^2")]
Force = Annotated[NotNegative, Unit("N")]
Point = Annotated[Vector3, Unit("m")]


def _spelt(pattern: str, rule: str) -> AfterValidator:
    def check(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise ValueError(rule)
        return text

    return AfterValidator(check)


Name = Annotated[str, Field(max_length=100), _spelt(
    r"[^\W_][\w.-]*", "a name has letters, digits, \".\", \"_\" and \"-\", and begins with a "
                      "letter or a digit")]
TaskName = Annotated[str, _spelt(
    r"[^\W\d_][\w -]*", "a task's name has letters, digits, spaces, \"_\" and \"-\", and begins "
                        "with a letter")]


class Section(BaseModel):
    """A table of a scenario file: unknown keys are rejected, and it is immutable.

    `tag` is the key that says its kind, where there are several.
    """

    tag: ClassVar[str] = "kind"
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False,
                              serialize_by_alias=True)

    def _wrong(self) -> Iterator[str]:
        """Yield what is wrong with the values of the section together."""
        yield from ()

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        for reason in self._wrong():
            raise ValueError(reason)
        return self


@dataclass(frozen=True)
class OneOf:
    """Makes `Annotated[A | B, OneOf()]` the section whose kind the table names.

    Without a key "kind" it is the `default`. With `own` the kinds are those of `own.group`:
    sections, or what `own.of` makes of something else. Keys in messages are those of the file,
    without the kinds that a union of pydantic puts between them.
    """

    default: str | None = None
    own: Any = None

    def sections(self, annotation: Any) -> tuple[type[Section], ...]:
        """Return the sections of all kinds."""
        return *self._kinds(annotation).values(), *(() if self.own is None else (self.own,))

    def _kinds(self, annotation: Any) -> dict[str, type[Section]]:
        if self.own is None:
            return {kind: one for one in get_args(annotation) for kind in kinds_of(one)}
        found = {}
        for kind, one in plugins.registered(self.own.group).items():
            with errors.of_user(f"{self.own.group[:-1]} of kind {kind!r}"):
                found[kind] = one if isinstance(one, type) and issubclass(
                    one, Section) else self.own.of(one)
        return found

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        kinds = [handler.generate_schema(section) for section in self.sections(source)]
        return core_schema.no_info_wrap_validator_function(  # the union is for the page of keys
            lambda table, _: self._section(source, table), core_schema.union_schema(kinds),
            serialization=core_schema.simple_ser_schema("any"))

    def _section(self, source: Any, table: Any) -> Section:
        if isinstance(table, Section):
            return table
        kind = table.get("kind", self.default) if isinstance(table, dict) else None
        if self.own is not None and isinstance(kind, str):
            plugins.find(self.own.group, kind)  # loads the entry point of that name only
        kinds = self._kinds(source)
        found = kinds.get(kind) if isinstance(kind, str) else None
        if found is None:
            names = kinds if self.own is None else plugins.known(self.own.group)
            text = str(UnknownNameError("kind", kind, names)) if isinstance(kind, str) else (
                f"expected a table with a kind, {listed([repr(name) for name in names], 'or')}")
            raise PydanticCustomError("kind", "{text}", {"text": text})
        return found.model_validate(table)


def kinds_of(section: type[Section]) -> tuple[str, ...]:
    """Return the kinds that a section is for: as its key "kind" allows, or as it is registered."""
    field = section.model_fields.get("kind")
    return get_args(field.annotation if field else None) or tuple(
        kind for group in plugins.GROUPS for kind, one in plugins.registered(group).items()
        if one in (section, getattr(section, "maker", None)))
