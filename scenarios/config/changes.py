"""Changes to a scenario as text: dotted keys and TOML values."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any

from scenarios.config.errors import ScenarioError


def changed(data: dict[str, Any], changes: Sequence[str]) -> dict[str, Any]:
    """Apply "dotted.key=value" texts to `data` in place, and return it."""
    for key, value in parse_changes(changes, what="--set").items():
        change(data, key, value)
    return data


def parse_changes(changes: Sequence[str], what: str) -> dict[str, Any]:
    """Return keys and values of "key=value" texts; a ScenarioError starts with `what`."""
    parsed = {}
    for change in changes:
        key, equals, text = change.partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"{what}: expected key=value, got {change!r}")
        parsed[key.strip()] = _value(text.strip(), f"{what} {change!r}")
    return parsed


def _value(text: str, what: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        if text and all(c.isalnum() or c in "_-./" for c in text):
            return text  # a bare word needs no quotes on a command line
        raise ScenarioError(f"{what}: {text!r} is not a TOML value") from error


def change(data: dict[str, Any], dotted: str, value: Any) -> None:
    """Set the value at a dotted key of `data` in place."""
    *path, last = dotted.split(".")
    table = data
    for key in path:
        table = table.setdefault(key, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"{dotted}: {key!r} is not a table")
    table[last] = value


def without_none(data: Any) -> Any:
    """Return data without keys whose value is None, which TOML does not have."""
    if isinstance(data, dict):
        return {key: without_none(value) for key, value in data.items() if value is not None}
    if isinstance(data, list):
        return [without_none(value) for value in data]
    return data
