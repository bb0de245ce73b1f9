"""Changes to the data of a scenario: dotted keys, and sections of another kind.

A key is dotted, `control.period`; in a list an entry has its number from 0, and `*` stands for
every entry: `avoidance.obstacles.*.radius`. `--set`, sweeps and `[variation]` have the same keys.
"""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any

from hierarchy.errors import UnknownNameError, brief, expect
from scenarios.config.distributions import flat
from scenarios.config.sections import ScenarioError, Section, naming
from scenarios.config.validation import tag_at
from scenarios.toml_text import parse


def parse_changes(changes: Sequence[str], what: str) -> dict[str, Any]:
    """Return keys and values of "key=value" texts; a ScenarioError starts with `what`."""
    parsed = {}
    if isinstance(changes, str) or not isinstance(changes, Sequence):
        raise ScenarioError(f"{what}: expected a list of \"key=value\", got {brief(changes)}")
    for change in changes:
        if not isinstance(change, str):
            raise ScenarioError(f"{what}: expected \"key=value\", got {brief(change)}")
        key, equals, text = change.partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"{what}: expected key=value, got {change!r}")
        parsed[key.strip()] = _value(text.strip(), f"{what} {change!r}")
    return parsed


def _value(text: str, what: str) -> Any:
    try:
        value, *others = parse(f"value = {text}", what, ScenarioError).values()
    except ScenarioError:
        if text and all(c.isalnum() or c in "_-./" for c in text):
            return text  # a bare word needs no quotes on a command line
        raise
    if others:
        raise ScenarioError(f"{what}: expected one value")
    return value


def change_all(data: dict[str, Any], changes: Mapping[str, Any], root: type[Section]) -> None:
    """Set values at dotted keys of the `data` of a `root` in place; absent tables are added.

    A section that gets another kind starts anew, wherever that stands, and what varied in it or in
    one that becomes None varies no more. Raises ScenarioError for a key within something that is no
    table, or outside a list.
    """
    expect("changes", changes, Mapping, "give {\"section.key\": value, ...}")
    tags = {}
    for key in changes:
        expect("changes: a key", key, str, "such as \"control.period\"")
        *path, last = key.split(".")
        tag = tag_at(root, path)
        tags[key] = tag if tag is not None and tag[0] == last else None
    for key in sorted(changes, key=lambda key: (tags[key] is None, key.startswith("variation"))):
        with naming(key, of=ValueError):
            for one in matching(data, key):
                table, last = place(data, one, add=True)
                if table and _is_another_kind(table, {last: changes[key]}, tags[key]):
                    table.clear()
                    _vary_no_more(data, one.rpartition(".")[0])
                below = table.get(last) if isinstance(table, dict) else None
                if isinstance(below, dict) and _leaves(below, changes[key], root, key):
                    _vary_no_more(data, one)
                table[last] = deepcopy(changes[key])


def matching(data: Any, pattern: str) -> Iterator[str]:
    """Yield the dotted keys that a pattern stands for: itself, if it has no `*`.

    Raises ValueError if a `*` is not within a list.
    """
    before, star, after = pattern.partition("*")
    if not star:
        yield pattern
        return
    above = before.rstrip(".")
    table, last = place(data, above)
    if not isinstance(table[last], list):
        raise ValueError(f"[{above}] is not a list")
    for i in range(len(table[last])):
        yield from matching(data, f"{before}{i}{after}")


def place(data: Any, dotted: str, add: bool = False) -> tuple[Any, Any]:
    """Return the table or list that contains a dotted key, and the key or index in it.

    With `add` keys that a table does not have are allowed, and absent tables are made. Raises
    ValueError if there is no such key.
    """
    above, (key, rest) = "", _first(data, dotted)
    while rest:
        found = _within(data, key, above, add)
        if add and isinstance(data, dict) and data.get(key) is None:
            data[key] = {}
        data = data[found] if isinstance(data, list) else data.get(found)
        above = f"{above}.{key}" if above else key
        # [variation] has dotted keys for nested ones
        key, rest = _first({} if above == "variation" else data, rest)
    return data, _within(data, key, above, add)


def _first(data: Any, dotted: str) -> tuple[str, str]:
    """Return the first part of a dotted key, and the rest; a name in a table may have dots."""
    names = [key for key in data if f"{dotted}.".startswith(f"{key}.")] if isinstance(
        data, dict) else []
    first = max(names, key=len, default=dotted.partition(".")[0])
    return first, dotted[len(first) + 1:]


def _within(data: Any, key: str, above: str, add: bool) -> Any:
    """Return the key of a table or the index of a list; raises ValueError if it has none."""
    where = f"[{above}]" if above else "the file"
    if isinstance(data, list):
        if not (key.isdecimal() and int(key) < len(data)):
            raise ValueError(f"{where} has {len(data)} entries, numbered from 0, and no {key!r}")
        return int(key)
    if not isinstance(data, dict):
        raise ValueError(f"{where} is missing" if data is None else f"{where} is not a table")
    if key not in data and not add and above != "control.options":
        raise UnknownNameError("key", key, data, above=f"{above}." if above else "")
    return key


def lay_over(below: dict[str, Any], above: Mapping[str, Any], root: type[Section],
             replaced: Sequence[str]) -> None:
    """Lay a file's tables over those of the file that it extends, in place.

    Sections that are `replaced` go first. A section of another kind replaces the one below it, and
    what varied there goes with it, as with one that has no successor. So does [variation], whose
    keys belong together.
    """
    for section in (*replaced, *(("variation",) if "variation" in above else ())):
        below.pop(section, None)
    gone = [section for section in replaced if section not in above]
    for section in [*gone, *_lay(below, above, root, ())]:
        if "variation" not in above:
            _vary_no_more(below, section)


def _lay(below: dict[str, Any], above: Mapping[str, Any], root: type[Section],
         at: tuple[str, ...]) -> Iterator[str]:
    """Lay tables over others; yield the sections that have got another kind."""
    for key, value in above.items():
        under, where = below.get(key), (*at, key)
        if not (isinstance(value, dict) and isinstance(under, dict)):
            below[key] = value
        elif _is_another_kind(under, value, tag_at(root, where)):
            below[key] = value
            yield ".".join(where)
        else:
            yield from _lay(under, value, root, where)


def _leaves(below: Mapping[str, Any], value: Any, root: type[Section], key: str) -> bool:
    return value is None or (isinstance(value, Mapping) and
                             _is_another_kind(below, value, tag_at(root, key.split("."))))


def _is_another_kind(below: Mapping[str, Any], above: Mapping[str, Any],
                     tag: tuple[str, str | None] | None) -> bool:
    return tag is not None and tag[0] in above and above[tag[0]] != below.get(*tag)


def _vary_no_more(data: dict[str, Any], section: str) -> None:
    """Drop the distributions of a section's keys."""
    if isinstance(varied := data.get("variation"), dict):
        data["variation"] = {key: value for key, value in flat(varied).items()
                             if not f"{key}.".startswith(f"{section}.")}


def without_none(data: Any) -> Any:
    """Return data without keys whose value is None, which TOML does not have."""
    if isinstance(data, dict):
        return {key: without_none(value) for key, value in data.items() if value is not None}
    if isinstance(data, list):
        return [without_none(value) for value in data]
    return data
