"""Validate plain data as a section; errors name the key, the value and its unit."""

import re
from collections.abc import Iterator, Sequence
from math import inf, tau
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from hierarchy.errors import UnknownNameError, brief
from hierarchy.words import listed
from scenarios.config.sections import OneOf, ScenarioError, Section, Unit, kinds_of, shared

Kind = TypeVar("Kind", bound=Section)
_USUAL = {  # sizes that are not doubted, by unit
    "m": (0.0, 10.0, "lengths are in metres, not in millimetres"),
    "rad": (0.0, tau, "angles are in radians, not in degrees"),
    "rad or m": (0.0, tau, "joint angles are in radians"),
    "deg": (1.0, inf, "cones and pushes are in degrees; all other angles are in radians")}
_QUOTED = re.compile(r"'([^']*)'")
_UNIONS = ("constrained-float", "float", "str")  # what pydantic calls the parts of one in a key


def validated(kind: type[Kind], data: dict[str, Any], what: str) -> Kind:
    """Return data as a section; raises ScenarioError with the key and the nearest known one."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(f"{what}: {_said(kind, data, e)}" for e in error.errors())
                            ) from error


def tag_at(root: type[Section], path: Sequence[str]) -> tuple[str, str | None] | None:
    """Return which key says the kind of the section at a path, and the kind of one without it.

    None if there is one kind.
    """
    found = dict.fromkeys(sections_at(root, path))
    tagged = {kind: kind.model_fields.get(kind.tag) for kind in found}
    if not all(tagged.values()) or (len(found) < 2 and all(kind.tag == "kind" for kind in found)):
        return None
    defaults = [field.default for field in tagged.values() if field and not field.is_required()]
    return next(iter(found)).tag, next(iter(defaults), None)


def sections_at(root: type[Section], path: Sequence[str]) -> list[type[Section]]:
    """Return the sections allowed at a path: several if a kind selects one."""
    return [found for part in _annotations(root, path) for found in parts_of(part, Section)]


def unit_at(root: type[Section], path: Sequence[str]) -> str:
    """Return the unit of the key at a path, "" if there is none, or another for each kind."""
    return shared(unit.name for part in _annotations(root, path) for unit in parts_of(part, Unit))


def _said(root: type[Section], data: Any, error: Any) -> str:
    keys = [str(key) for key in error["loc"] if key not in _UNIONS
            and not str(key).startswith("tuple[")]
    where, found = ".".join(keys) or "file", error["input"]
    if error["type"] == "extra_forbidden":
        return _unknown(root, keys, _table(data, error["loc"][:-1]))
    text = _worded(error)
    if not isinstance(found, dict) and (
            error["type"] in ("model_type", "model_attributes_type") or (
                error["type"] == "kind" and isinstance(found, list) and sections_at(root, keys))):
        return f"{where}: expected one table, as below [{where}], got {brief(found)}"
    if isinstance(found, dict) and error["type"] in ("tuple_type", "list_type"):
        return f"{where}: expected a list: for tables write [[{where}]] above each, not [{where}]"
    if error["type"] == "dict_type":
        return f"{where}: expected a table, {{name = value}}, got {found!r}"
    if error["type"] in ("tuple_type", "list_type"):
        return f"{where}: expected a list, got {found!r}"
    if isinstance(found, dict) or error["type"] in ("kind", "literal_error"):
        return f"{where}: {text}"
    unit = next((f" {unit.name}" for part in _annotations(root, keys)
                 for unit in parts_of(part, Unit) if not isinstance(found, str)), "")
    return f"{where}: {text}, got {found!r}{unit}"


def _worded(error: Any) -> str:
    """Return what pydantic says of a value, and of a choice the nearest one."""
    if error["type"] == "literal_error" and (names := _QUOTED.findall(error["ctx"]["expected"])):
        return str(UnknownNameError("value", error["input"], names))
    if error["type"] == "too_long" and error["ctx"]["field_type"] == "Tuple":
        return f"expected {error['ctx']['max_length']} entries, not {error['ctx']['actual_length']}"
    return str(error["msg"]).removeprefix("Value error, ")


def _unknown(root: type[Section], keys: list[str], table: dict[str, Any]) -> str:
    """Return which kind has the last of some keys, or which known key is nearest to it."""
    where, beside = ".".join(keys), list(dict.fromkeys(sections_at(root, keys[:-1])))
    tag = tag_at(root, keys[:-1])
    kind = table.get("kind", tag[1] if tag else None)
    having = [one for section in beside if keys[-1] in section.model_fields
              for one in kinds_of(section)]
    if having and len(beside) > 1:
        return (f"{where}: only kind {listed([repr(one) for one in having])} has it; the kind here "
                f"is {kind!r}")
    beside = [section for section in beside if kind in kinds_of(section)] or beside
    known = dict.fromkeys(field.alias or key for section in beside
                          for key, field in section.model_fields.items())
    return str(UnknownNameError("key", keys[-1], known,
                                above="".join(f"{key}." for key in keys[:-1])))


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
    # Numbers and * are of a list, a key with dots is of [variation].
    for key in (key for key in path if not key.isdigit() and key != "*" and "." not in key):
        parts = [(field.annotation, *field.metadata) for part in parts
                 for section in parts_of(part, Section) for name, field
                 in section.model_fields.items() if key in (name, field.alias)]
    return parts


def parts_of(annotation: Any, wanted: type) -> Iterator[Any]:
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
            yield from parts_of(part, wanted)


def doubtful_units(section: Section, above: str = "") -> Iterator[str]:
    """Yield what stands in a section in another unit than its own, by its size."""
    for name, field in type(section).model_fields.items():
        key, value = f"{above}{field.alias or name}", getattr(section, name)
        unit = shared(unit.name for unit in parts_of((field.annotation, *field.metadata), Unit)
                      if unit.doubted)
        least, largest, remark = _USUAL.get(unit, (0.0, inf, ""))
        for where, one in leaves(value, key):
            if isinstance(one, Section):
                yield from doubtful_units(one, f"{where}.")
            elif isinstance(one, float) and (0.0 < abs(one) < least or largest < abs(one) < inf):
                yield f"{where} = {one:g} {unit}: {remark}"
                break


def leaves(value: Any, key: str) -> Iterator[tuple[str, Any]]:
    """Yield a value by its key, or what is in a list or a table, by its numbers or keys."""
    if isinstance(value, list | tuple | dict):
        for i, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(one, f"{key}.{i}")
    else:
        yield key, value
