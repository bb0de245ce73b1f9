"""Errors for a caller's mistakes; each names what was wrong and where."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_NEAR = 0.6  # similarity of two names, 0 to 1, from which one is suggested


class HierarchyError(ValueError):
    """A caller's mistake; the text names the task or level, the row and the value."""


class UnknownNameError(HierarchyError):
    """An unknown name, with the most similar known one; `more` is a further sentence."""

    def __init__(self, what: str, name: str, known: Iterable[str], more: str = "") -> None:
        known = sorted(known)
        near = [*_containing(str(name), known),
                *difflib.get_close_matches(str(name), known, n=1, cutoff=_NEAR)]
        hint = f"; did you mean {near[0]!r}?" if near else "."
        super().__init__(f"unknown {what} {name!r}{hint} Known: {', '.join(known) or 'none'}."
                         + (f" {more}" if more else ""))


def _containing(name: str, known: Iterable[str]) -> list[str]:
    """Return the names that contain a part of at least three letters, the shortest first."""
    return sorted((one for one in known if name.lower() in one.lower()), key=len) \
        if len(name) > 2 else []


def expect(what: str, value: object, kind: type, remedy: str) -> None:
    """Raise a HierarchyError that says what was given and what is expected, or return None."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise HierarchyError(f"{what}: expected {article} {kind.__name__}, got {brief(value)}; "
                             f"{remedy}")


def brief(value: object) -> str:
    """Return the type of a value and the value itself, in at most 80 characters."""
    text = " ".join(repr(value).split())
    return f"{type(value).__name__} {text if len(text) <= 60 else text[:57] + '...'}"


class RobotError(HierarchyError):
    """A robot model that cannot be read, or a state that does not fit the robot."""
