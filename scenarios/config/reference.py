"""What every key of a scenario file means: for `hierarchy help` and the page of keys.

Types, bounds, units and defaults are those that files are checked against; the meaning of a key is
the text below it in its section, or behind it after "#:".
"""

import ast
import inspect
import json
from collections.abc import Iterator
from functools import cache
from itertools import zip_longest
from textwrap import dedent, fill
from typing import Any, NamedTuple

from scenarios.config.scenario import Scenario
from scenarios.config.sections import Section, Unit, kinds_of
from scenarios.config.validation import parts_of, sections_at, tag_at

_BOUNDS = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
_TYPES = {"string": "string", "boolean": "boolean", "integer": "integer", "object": "table"}


class Key(NamedTuple):
    """A key of a section: what its value is, in which unit, by default, and what it means.

    `below` has the sections that its value may be.
    """

    name: str
    value: str
    unit: str
    default: str
    meaning: str
    below: tuple[type[Section], ...]


def keys_of(section: type[Section]) -> tuple[Key, ...]:
    """Return the keys of a section, but not what says its kind if there is one choice."""
    schema, found, meanings = section.model_json_schema(), [], dict[str, str]()
    for base in reversed(section.__mro__):  # the text of each key, there or in what it derives from
        meanings |= _texts(base) if issubclass(base, Section) else {}
    for name, field in section.model_fields.items():
        key, parts = field.alias or name, (field.annotation, *field.metadata)
        if key != "kind" or len(kinds_of(section)) != 1:
            value = schema["properties"][key]
            units = dict.fromkeys(unit.name for unit in parts_of(parts, Unit))
            default = value.get("default")
            said = "required" if field.is_required() else "" if (
                default in (None, [], "") or isinstance(default, dict)) else json.dumps(default)
            found.append(Key(key, _value(value, schema.get("$defs", {})), " or ".join(units),
                             said, meanings.get(name, ""),
                             tuple(dict.fromkeys(parts_of(parts, Section)))))
    return tuple(found)


def title_of(section: type[Section], place: str) -> str:
    """Return the name of a section at a place, with its kind where there are several."""
    kinds = kinds_of(section)
    return f"{place} with kind = {json.dumps(kinds[0])}" if len(kinds) == 1 else place


def explained(dotted: str) -> list[str]:
    """Return what a dotted key means, as lines for a terminal; none for an unknown key.

    Entries of a list have numbers, or none, as in `avoidance.obstacles.path`.
    """
    path = [part for part in dotted.split(".") if not part.isdigit() and part != "*"]
    if path[-1:] == ["kind"] and (kinds := _kinds(path[:-1])):
        return kinds
    found = list(dict.fromkeys(sections_at(Scenario, path)))
    said: dict[tuple[str, ...], list[str]] = {}  # sections by what they say of the key
    for owner in dict.fromkeys(sections_at(Scenario, path[:-1])):
        for key in keys_of(owner):
            if key.name == path[-1]:
                said.setdefault(tuple(_lines(key)), []).append(
                    title_of(owner, _bracketed(path[:-1])))
    lines = [line for text, owners in said.items() for line in (*owners, *text)]
    for section in found:
        lines += ["", *_whole(section, _bracketed(path))]
    return lines


def explained_kind(dotted: str) -> list[str]:
    """Return what a kind means, such as `look-at` or `path.circle`, as lines for a terminal."""
    above, _, kind = f".{dotted}".rpartition(".")
    return [line for place, section in sections()
            if kind in kinds_of(section) and f".{place.strip('[]')}".endswith(above)
            for line in _whole(section, place)]


def _kinds(path: list[str]) -> list[str]:
    """Return the kinds of a section, and what each of them is; none if there is one."""
    tag, default = tag_at(Scenario, path) or ("", None)
    if tag != "kind":
        return []
    said = f"default {json.dumps(default)}" if default else "required"
    lines = [_bracketed(path), f"  kind: {said}"]
    for section in dict.fromkeys(sections_at(Scenario, path)):
        first = (inspect.getdoc(section) or "").partition("\n")[0]
        lines += [fill(f"{json.dumps(kind)}: {first}", 88, initial_indent="      ",
                       subsequent_indent="        ") for kind in kinds_of(section)]
    return lines


def _whole(section: type[Section], place: str) -> Iterator[str]:
    """Yield what a section is, and its keys."""
    yield title_of(section, place)
    for text in (inspect.getdoc(section) or "").split("\n\n"):
        yield fill(text, 88, initial_indent="  ", subsequent_indent="  ")
    for key in keys_of(section):
        yield from _lines(key)


def _bracketed(path: list[str]) -> str:
    """Return a place as a file has it: [control], [[tasks]]."""
    if not path:
        return "top of the file"
    dotted = f"[{'.'.join(path)}]"
    return f"[{dotted}]" if any(
        key.value.startswith("list") for owner in sections_at(Scenario, path[:-1])
        for key in keys_of(owner) if key.name == path[-1]) else dotted


def places_of(name: str | None = None) -> list[str]:
    """Return the dotted keys with a last part, or all; of those in several sections the first."""
    return list(dict.fromkeys(
        f"{place.strip('[]')}.{key}".lstrip(".") for place, section in sections()
        for key in (*["kind"] * (len(kinds_of(section)) == 1),
                    *(one.name for one in keys_of(section))) if name in (None, key)))


def sections() -> Iterator[tuple[str, type[Section]]]:
    """Yield every section with the place, "[control]", where its key is met first."""
    waiting: list[tuple[str, type[Section]]] = [("", Scenario)]
    met: set[type[Section]] = {Scenario}
    for place, section in waiting:  # grows on the way
        yield place, section
        for key in keys_of(section):
            dotted = f"{place.strip('[]')}.{key.name}".lstrip(".")
            new = [one for one in key.below if one not in met]
            waiting += [(f"[[{dotted}]]" if key.value.startswith("list") else f"[{dotted}]", one)
                        for one in new]
            met |= set(new)


def _lines(key: Key) -> Iterator[str]:
    unit = f" [{key.unit}]" if key.unit else ""
    default = key.default if key.default in ("", "required") else f"default {key.default}"
    yield f"  {key.name}: {', '.join(filter(None, (f'{key.value}{unit}', default)))}"
    if key.meaning:
        yield fill(key.meaning, 88, initial_indent="      ", subsequent_indent="      ")


@cache
def _texts(section: type[Section]) -> dict[str, str]:
    try:
        source = dedent(inspect.getsource(section))
    except (OSError, TypeError):  # a plugin without a source
        return {}
    lines, body = source.splitlines(), getattr(ast.parse(source).body[0], "body", ())
    found: dict[str, str] = {}
    for key, below in zip_longest(body, body[1:]):
        if isinstance(key, ast.AnnAssign) and isinstance(key.target, ast.Name):
            text = lines[(key.end_lineno or 0) - 1].partition("  #: ")[2]
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                text = str(below.value.value)
            found |= {key.target.id: " ".join(text.split())} if text else {}
    return found


def _value(value: dict[str, Any], schemas: dict[str, Any]) -> str:
    """Return what a value may be, in words."""
    if "$ref" in value:
        schema = schemas[value["$ref"].rpartition("/")[2]]
        return "table" if "properties" in schema else _value(schema, schemas)
    several = value.get("anyOf") or value.get("oneOf") or []
    if choices := [one for one in several if one.get("type") != "null"]:
        return " or ".join(dict.fromkeys(_value(one, schemas) for one in choices))
    if "const" in value or "enum" in value:
        return ", ".join(map(json.dumps, value.get("enum", [value.get("const")])))
    if "prefixItems" in value:
        return f"{len(value['prefixItems'])} × {_value(value['prefixItems'][0], schemas)}"
    if value.get("type") == "array":
        return f"list: {_value(value.get('items', {}), schemas)}"
    bounds = "".join(f" {sign} {value[name]:g}" for name, sign in _BOUNDS if name in value)
    return _TYPES.get(value.get("type", ""), "number") + bounds
