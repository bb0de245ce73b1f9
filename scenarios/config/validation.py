"""Validate plain data as a section; errors name the key and the value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from hierarchy import plugins
from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.words import listed
from scenarios.config.changes import Tag
from scenarios.config.errors import ScenarioError
from scenarios.config.sections import PLUGIN, Section

Kind = TypeVar("Kind", bound=Section)


def validated(kind: type[Kind], data: dict[str, Any], what: str) -> Kind:
    """Return data as a section; raises ScenarioError with the key and the nearest known one."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(_say(kind, what, e) for e in error.errors())) from error
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


def _say(root: type[Section], what: str, error: Any) -> str:
    keys = _without_kinds(root, [str(key) for key in error["loc"]])
    where = ".".join(keys) or "file"
    if error["type"] == "extra_forbidden":
        if (having := _kinds_with(root, keys)) and len(keys) < len(error["loc"]):
            kinds = listed([repr(kind) for kind in having])
            return (f"{what}: {where}: only kind {kinds} has it; the kind here is "
                    f"{str(error['loc'][-2])!r}")
        beside = _keys_beside(root, keys, str(error["loc"][-2:][0]))
        return f"{what}: {UnknownNameError('key', where, beside)}"
    if error["type"] in ("union_tag_invalid", "union_tag_not_found"):
        tag = error["ctx"].get("tag")
        found = sorted(_kinds_at(root, [key for key in keys if not key.isdigit()]) - {PLUGIN})
        known = _with_own(root, keys, error["ctx"].get("expected_tags")) or ", ".join(
            map(repr, found))
        return f"{what}: {where}: expected a kind, {known}" + (f"; got {tag!r}" if tag else "")
    text = error["msg"].removeprefix("Value error, ")
    value = "" if isinstance(error["input"], dict) else f", got {error['input']!r}"
    return f"{what}: {where}: {text}{value}"


def _with_own(root: type[Section], keys: list[str], tags: str | None) -> str | None:
    """Return the kinds that pydantic lists, with those of plugins in place of their tag."""
    groups = [section.group for section in sections_at(root, keys) if hasattr(section, "group")]
    own = "".join(f", {kind!r}" for group in groups[:1] for kind in plugins.own(group))
    return tags and tags.replace(f", {PLUGIN!r}", own)


def _without_kinds(root: type[Section], loc: list[str]) -> list[str]:
    """Drop the kinds of sections that pydantic inserts into the location of an error."""
    kept: list[str] = []
    dropped = False  # the key before: a kind is followed by a key
    for i, key in enumerate(loc):
        last = i == len(loc) - 1 and key != PLUGIN
        dropped = not (dropped or i == 0 or last) and key in _kinds_at(root, kept)
        if not dropped:
            kept.append(key)
    return kept


def _kinds_with(root: type[Section], keys: list[str]) -> list[str]:
    """Return the kinds of sections that have the last of `keys`."""
    return [kind for section in dict.fromkeys(sections_at(root, keys[:-1]))
            if keys[-1] in section.model_fields for kind in _kinds_of(section)]


def _kinds_of(section: type[Section]) -> tuple[str, ...]:
    field = section.model_fields.get("kind")
    kinds: tuple[str, ...] = getattr(field.annotation, "__args__", ()) if field else ()
    return kinds


def _keys_beside(root: type[Section], keys: list[str], kind: str) -> list[str]:
    """Return the full names of the keys allowed in place of the last of `keys`.

    Those of a section of this kind, if there is one, else of all that may stand there.
    """
    beside = sections_at(root, keys[:-1])
    beside = [section for section in beside if kind in _kinds_of(section)] or beside
    known = dict.fromkeys(field.alias or key for section in beside
                          for key, field in section.model_fields.items())
    return [".".join([*keys[:-1], key]) for key in known]


def _kinds_at(root: type[Section], path: list[str]) -> set[str]:
    named = {kind for section in sections_at(root, path) for kind in _kinds_of(section)}
    return named | {PLUGIN} if named else named


def sections_at(root: type[Section], path: Sequence[str]) -> list[Any]:
    """Return the sections allowed at a path: several if a kind selects one."""
    sections: list[Any] = [root]
    for key in (key for key in path if not key.isdigit()):  # a list index is not a key
        fields = [section.model_fields[key] for section in sections if key in section.model_fields]
        sections = [found for field in fields for found in _sections_in(field.annotation)]
    return sections


def _sections_in(annotation: Any) -> list[Any]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [found for part in getattr(annotation, "__args__", ()) for found in _sections_in(part)]
