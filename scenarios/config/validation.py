"""Validate plain data as a section; errors name the key, the value and its unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.words import listed
from scenarios.config.changes import Tag
from scenarios.config.errors import ScenarioError
from scenarios.config.sections import OneOf, Section, Unit, kinds_of

Kind = TypeVar("Kind", bound=Section)
_UNIONS = ("constrained-float", "float", "str")  # what pydantic calls the parts of one in a key


def validated(kind: type[Kind], data: dict[str, Any], what: str) -> Kind:
    """Return data as a section; raises ScenarioError with the key and the nearest known one."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(f"{what}: {_said(kind, data, e)}" for e in error.errors())
                            ) from error
    except HierarchyError as error:  # what a resolver says of its settings
        raise ScenarioError(f"{what}: control: {error}") from error


def tag_at(root: type[Section], path: Sequence[str]) -> Tag | None:
    """Return which key says the kind of the section at a path, None if there is one kind."""
    found = dict.fromkeys(sections_at(root, path))
    tagged = {kind: kind.model_fields.get(kind.tag) for kind in found}
    if not all(tagged.values()) or (len(found) < 2 and all(kind.tag == "kind" for kind in found)):
        return None
    key = next(iter(found)).tag if found else ""
    defaults = [field.default for field in tagged.values() if field and not field.is_required()]
    return Tag(key, defaults[0] if defaults else None) if found else None


def sections_at(root: type[Section], path: Sequence[str]) -> list[type[Section]]:
    """Return the sections allowed at a path: several if a kind selects one."""
    return [found for part in _annotations(root, path) for found in _within(part, Section)]


def _said(root: type[Section], data: Any, error: Any) -> str:
    keys = [str(key) for key in error["loc"] if key not in _UNIONS
            and not str(key).startswith("tuple[")]
    where = ".".join(keys) or "file"
    if error["type"] == "extra_forbidden":
        return _unknown(root, keys, _table(data, error["loc"][:-1]))
    text = error["msg"].removeprefix("Value error, ")
    if isinstance(error["input"], dict) or error["type"] == "kind":
        return f"{where}: {text}"
    unit = next((f" {unit.name}" for part in _annotations(root, keys)
                 for unit in _within(part, Unit)), "")
    return f"{where}: {text}, got {error['input']!r}{unit}"


def _unknown(root: type[Section], keys: list[str], table: dict[str, Any]) -> str:
    """Return which kind has the last of some keys, or which known key is nearest to it."""
    where, beside = ".".join(keys), list(dict.fromkeys(sections_at(root, keys[:-1])))
    tag = tag_at(root, keys[:-1])
    kind = table.get("kind", tag.default if tag else None)
    having = [one for section in beside if keys[-1] in section.model_fields
              for one in kinds_of(section)]
    if having and len(beside) > 1:
        return (f"{where}: only kind {listed([repr(one) for one in having])} has it; the kind here "
                f"is {kind!r}")
    beside = [section for section in beside if kind in kinds_of(section)] or beside
    known = dict.fromkeys(field.alias or key for section in beside
                          for key, field in section.model_fields.items())
    return str(UnknownNameError("key", where, [".".join([*keys[:-1], key]) for key in known]))


def _table(data: Any, path: Sequence[int | str]) -> dict[str, Any]:
    """Return the table at a path; an empty one where data became a table on the way."""
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return {}
    return data if isinstance(data, dict) else {}


def _annotations(root: type[Section], path: Sequence[str]) -> list[Any]:
    """Return the annotations of the keys at a path, in all sections that it may lead through."""
    parts: list[Any] = [root]
    for key in (key for key in path if not key.isdigit()):  # a list index is not a key
        parts = [(field.annotation, *field.metadata) for part in parts
                 for section in _within(part, Section) for name, field
                 in section.model_fields.items() if key in (name, field.alias)]
    return parts


def _within(annotation: Any, wanted: type) -> Iterator[Any]:
    """Yield what an annotation has of a type: classes of sections, or units."""
    if isinstance(annotation, wanted) or (
            isinstance(annotation, type) and issubclass(annotation, wanted)):
        yield annotation
    else:
        parts = annotation if isinstance(annotation, tuple) else get_args(annotation)
        choice = next((part for part in parts if isinstance(part, OneOf)), None)
        if choice is not None and wanted is Section:
            yield from choice.sections(parts[0])
            return
        for part in parts:
            yield from _within(part, wanted)
