"""Common parts of sections: numbers, and what says their kind."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from hierarchy import plugins
from hierarchy.plugins import Group

# Strict: true is not 1.0, and "5" is not 5. A whole number may be given for a float.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
Count = Annotated[int, Field(strict=True, ge=0)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
JointValue = Finite | tuple[Finite, ...]  # see hierarchy.Robot.configuration
Vector3 = tuple[Finite, Finite, Finite]
Rows3 = tuple[Vector3, Vector3, Vector3]


class Section(BaseModel):
    """A table of a scenario file: unknown keys are rejected, and it is immutable.

    `tag` is the key that says its kind, where there are several.
    """

    tag: ClassVar[str] = "kind"
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False,
                              serialize_by_alias=True)


PLUGIN = "plugin"  # the tag of sections whose kind a plugin has registered


def kind_or(default: str | None, group: Group | None = None) -> Callable[[Any], str | None]:
    """Return a function that reads the kind of a table or section, `default` if it has none.

    With a `group` the kind is PLUGIN for one that is not shipped, but registered there.
    """
    def kind(section: Any) -> str | None:
        found = (section.get("kind", default) if isinstance(section, dict)
                 else getattr(section, "kind", default))
        if not isinstance(found, str):
            return None if found is None else str(found)
        own = group and found not in plugins.shipped(group) and plugins.find(group, found)
        return PLUGIN if own else found

    return kind


def any_kind(group: Group, own: type[Section], default: str | None = None) -> Any:
    """Return the type of a section of any kind that is registered so far, or of a plugin's.

    `own` is the section of a plugin's kind; without a key "kind" it is the `default`.
    """
    tagged: list[Any] = [Annotated[section, Tag(kind)]
                         for kind, section in plugins.shipped(group).items()]
    return Annotated[reduce(or_, [*tagged, Annotated[own, Tag(PLUGIN)]]),
                     Discriminator(kind_or(default, group))]
