"""Changes to the data of a scenario: dotted keys, and sections of another kind.

A key is dotted, `control.period`; in a list an entry has its number from 0, and `*` stands for
every entry: `avoidance.obstacles.*.radius`. `--set`, sweeps and `[variation]` have the same keys.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from hierarchy.errors import UnknownNameError, brief, expect
from scenarios.config.distributions import flat
from scenarios.config.errors import ScenarioError
from scenarios.toml_text import parse


class Tag(NamedTuple):
    """The key that says which kind a section is of, and the kind of one without it."""

    key: str
    default: str | None


TagAt = Callable[[Sequence[str]], Tag | None]
"""Gives the tag of the section at a path, None if there is one kind only."""


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
        return parse(f"value = {text}", what, ScenarioError)["value"]
    except ScenarioError:
        if text and all(c.isalnum() or c in "_-./" for c in text):
            return text  # a bare word needs no quotes on a command line
        raise


def change(data: dict[str, Any], dotted: str, value: Any) -> None:
    """Set the value at a dotted key of `data` in place; absent tables are added.

    Raises ScenarioError for a key within something that is no table, or outside a list.
    """
    try:
        for key in matching(data, dotted):
            table, last = place(data, key, add=True)
            table[last] = value
    except ValueError as error:
        raise ScenarioError(f"{dotted}: {error}") from None


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
    *path, last = dotted.split(".")
    for i, key in enumerate(path):
        above = ".".join(path[:i])
        found = within(data, key, above, add)
        if add and isinstance(data, dict) and data.get(key) is None:
            data[key] = {}
        data = data[found]
    return data, within(data, last, ".".join(path), add)


def within(data: Any, key: str, above: str, add: bool = False) -> Any:
    """Return the key of a table or the index of a list; raises ValueError if it has none."""
    where = f"[{above}]" if above else "the file"
    if isinstance(data, list):
        if not (key.isdigit() and int(key) < len(data)):
            raise ValueError(f"{where} has {len(data)} entries, numbered from 0, and no {key!r}")
        return int(key)
    if not isinstance(data, dict):
        raise ValueError(f"{where} is missing" if data is None else f"{where} is not a table")
    if key not in data and not add and above != "control.options":
        raise UnknownNameError("key", key, data, above=f"{above}." if above else "")
    return key


def change_all(data: dict[str, Any], changes: Mapping[str, Any], tag_at: TagAt) -> None:
    """Apply changes in place; a section that gets another kind starts anew, wherever that stands.

    Raises ScenarioError like `change`.
    """
    expect("changes", changes, Mapping, "give {\"section.key\": value, ...}")
    for key in changes:
        expect("changes: a key", key, str, "such as \"control.period\"")
    kinds = {key for key in changes if _says_kind(key, tag_at)}
    for key in sorted(changes, key=lambda key: key not in kinds):  # kinds first, else as given
        if key in kinds:
            _begin_anew(data, key, changes[key], tag_at)
        change(data, key, changes[key])


def laid_over(below: Mapping[str, Any], above: Mapping[str, Any], tag_at: TagAt) -> dict[str, Any]:
    """Return a file's tables over those of the file that it extends.

    A section of another kind replaces the one below it, and what varies there goes with it.
    """
    gone: list[str] = []
    merged = _merged(below, above, tag_at, (), gone)
    for section in gone:
        _vary_no_more(merged, section)
    return merged


def _merged(below: Mapping[str, Any], above: Mapping[str, Any], tag_at: TagAt,
            at: tuple[str, ...], gone: list[str]) -> dict[str, Any]:
    merged = dict(below)
    for key, value in above.items():
        under, where = merged.get(key), (*at, key)
        if not (isinstance(value, dict) and isinstance(under, dict)):
            merged[key] = value
        elif _is_another_kind(under, value, tag_at(where)):
            merged[key] = value
            gone.append(".".join(where))
        else:
            merged[key] = _merged(under, value, tag_at, where, gone)
    return merged


def _is_another_kind(below: Mapping[str, Any], above: Mapping[str, Any], tag: Tag | None) -> bool:
    return tag is not None and tag.key in above and (
        above[tag.key] != below.get(tag.key, tag.default))


def _says_kind(dotted: str, tag_at: TagAt) -> bool:
    *path, last = dotted.split(".")
    tag = tag_at(path)
    return tag is not None and tag.key == last


def _begin_anew(data: dict[str, Any], dotted: str, kind: Any, tag_at: TagAt) -> None:
    """Empty the sections whose kind a change replaces by another one."""
    *path, last = dotted.split(".")
    try:
        for section in matching(data, ".".join(path)):
            above, key = place(data, section, add=True)
            under = above.get(key) if isinstance(above, dict) else above[key]
            if isinstance(under, dict) and _is_another_kind(under, {last: kind}, tag_at(path)):
                above[key] = {}
                _vary_no_more(data, section)
    except ValueError as error:
        raise ScenarioError(f"{dotted}: {error}") from None


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
